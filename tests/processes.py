"""Processes for tests that must not depend on how fast the machine is: starts that hang, and waiting for what is so."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

PATIENT = 1e4
"""A process may wait for its turn so many times as long as it works: for `WALL_FACTOR` of the solvers' processes."""
TESTS = Path(__file__).parent
COMMAND = [sys.executable, "-c", "from sgnlp.cli import main; main()"]
ALIVE = 300.0
"""Longer than anything here takes on a busy machine [s]; nothing waits for it in vain unless it fails."""


def hang(planner: object, start: object) -> None:
    """In the place of `solve_start`: leaves the file `hanging` and never ends."""
    Path("hanging").touch()
    time.sleep(1000)


def command_with(code: str) -> list[str]:
    """The command `sgnlp` after some code, which may import from the tests of every room."""
    folders = [str(TESTS), *(str(folder) for folder in TESTS.iterdir() if folder.is_dir())]
    return [sys.executable, "-c", f"import sys; sys.path[:0] = {folders!r}; {code}; {COMMAND[2]}"]


def wait_for(condition: Callable[[], object], seconds: float = ALIVE) -> bool:
    """Whether a condition is met in time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def group(leader: int) -> list[int]:
    """The living processes of a process group."""
    alive = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, of_group = stat.read_text(encoding="utf-8").rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if int(of_group) == leader and state != "Z":
            alive.append(int(stat.parent.name))
    return alive


@contextmanager
def running(command: list[str], **options: object) -> Iterator[subprocess.Popen[str]]:
    """A command in a process group of its own, which is killed at the end."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "encoding": "utf-8", "start_new_session": True}
    process = subprocess.Popen(command, **pipes | options)  # type: ignore[call-overload]
    try:
        yield process
    finally:
        for pid in group(process.pid):
            os.kill(pid, signal.SIGKILL)
        process.communicate()


def interrupted(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Ctrl-C to a command and all its processes: its exit code and what it printed, once none of them is left."""
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=ALIVE)
    assert wait_for(lambda: not group(process.pid)), "a process is left"
    return process.returncode, out, err
