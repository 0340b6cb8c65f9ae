"""Fresh processes with a cache folder of their own, and the memory of a tree of processes."""

import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TypeVar
from unittest.mock import patch

T = TypeVar("T")

SAMPLING = 0.02  # time between two samples of the memory [s]
COMMAND = (sys.executable, "-c", "from sgnlp.cli import main; main()")  # the command `sgnlp`


def cache(folder: Path) -> AbstractContextManager[object]:
    """Let processes started meanwhile use this folder as their cache."""
    return patch.dict(os.environ, XDG_CACHE_HOME=str(folder))


def fresh(task: Callable[..., T], *arguments: object) -> T:
    """The result of a task in a process that has imported nothing yet."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(task, *arguments).result()


def python(code: str) -> None:
    """Run a line of Python in a fresh process."""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def command(arguments: Sequence[str], version: Path | None = None) -> None:
    """Run the command `sgnlp`, of another version if its checkout is named.

    A plan without a feasible grasp counts as success of the command.
    """
    environment = os.environ | ({"PYTHONPATH": str(version)} if version else {})
    done = subprocess.run([*COMMAND, *arguments], capture_output=True, encoding="utf-8", cwd=version, env=environment)
    _check(done.returncode, done.stderr)


def memory_course(arguments: Sequence[str], every: float = SAMPLING) -> list[float]:
    """Memory [MB] of the command `sgnlp` and all its workers, sampled every `every` seconds until it ends.

    Workers are forked, so shared memory is counted once: as the largest shared part of a process.
    """
    null, pipe = subprocess.DEVNULL, subprocess.PIPE
    process, course = subprocess.Popen([*COMMAND, *arguments], stdout=null, stderr=pipe, encoding="utf-8"), []
    while process.poll() is None:
        parts = [_memory(pid) for pid in _tree(process.pid)]
        course.append(sum(private for private, _ in parts) + max(shared for _, shared in parts))
        time.sleep(every)
    _check(process.returncode, process.communicate()[1])
    return course


def peak_memory(arguments: Sequence[str]) -> float:
    """The largest of `memory_course`."""
    return max(memory_course(arguments))


def _check(code: int, errors: str) -> None:
    if code not in (0, 1):
        raise RuntimeError(f"sgnlp ended with exit code {code}: {errors}")


def _tree(pid: int) -> Iterator[int]:
    """A process and all its descendants."""
    yield pid
    try:
        children = [tid.joinpath("children").read_text(encoding="utf-8") for tid in Path(f"/proc/{pid}/task").iterdir()]
    except OSError:  # ended meanwhile
        return
    for child in " ".join(children).split():
        yield from _tree(int(child))


def _memory(pid: int) -> tuple[float, float]:
    """Private and shared memory of a process [MB], 0 when it has ended."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8").splitlines()[1:]
    except OSError:
        return 0.0, 0.0
    sizes = {line.split()[0]: float(line.split()[1]) * 1024 / 1e6 for line in lines}
    private, shared = (sizes[f"{kind}_Clean:"] + sizes[f"{kind}_Dirty:"] for kind in ("Private", "Shared"))
    return private, shared
