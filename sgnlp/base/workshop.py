"""Builds that may be interrupted: finished files stay in the cache, and the next build of the same target resumes.

A build has its own folder beside its target. It holds the sources, part by part, each with a list of its files that is
written last, and then the object files. The folder is removed when the library is complete.
"""

import json
import os
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from sgnlp.base import toolchain
from sgnlp.base.errors import SgnlpError

LIST = ".files"
"""Suffix of the list of a part's files."""
NOTE = "note"
FORGOTTEN = 7 * 24 * 3600.0
"""A build that was not resumed for this long belongs to an earlier version, and is removed [s]."""


def build(
    target: Path,
    parts: Mapping[str, Callable[[], Mapping[str, str]]],
    note: Callable[[], bytes],
    flags: Sequence[str],
    jobs: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """As `toolchain.build`, from parts that return their sources when called; only missing parts are called.

    Call it inside `toolchain.once`, which excludes other processes.

    Raises:
        SolverError: the compiler fails; then nothing is kept for a later build.
        MachineError: the disk is full; then nothing is kept either.
    """
    folder = place(target)
    _forget(target.parent)
    folder.mkdir(parents=True, exist_ok=True)
    os.utime(folder)
    try:
        if not (folder / NOTE).exists():
            _write(folder / NOTE, note())
        files = [file for name, make in parts.items() for file in _sources(folder, name, make)]
        toolchain.finish(folder, target, files, flags, jobs, progress, (folder / NOTE).read_bytes())
    except (SgnlpError, OSError):
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)


def place(target: Path) -> Path:
    """The folder of a build."""
    return target.parent / f"{toolchain.BUILDING}{target.stem}"


def done(target: Path) -> float:
    """The share of a build's files that are compiled by now; 0 if there is no build."""
    files = [file for listed in place(target).glob(f"*{LIST}") for file in json.loads(listed.read_bytes())]
    return len(list(place(target).glob("*.o"))) / len(files) if files else 0.0


def _sources(folder: Path, name: str, make: Callable[[], Mapping[str, str]]) -> list[str]:
    """The files of a part, which are written unless they exist."""
    listed = folder / f"{name}{LIST}"
    if listed.exists():
        found: list[str] = json.loads(listed.read_bytes())
        return found
    sources = make()
    for file, text in sources.items():
        (folder / file).write_text(text, encoding="utf-8")
    _write(listed, json.dumps(list(sources)).encode())
    return list(sources)


def _write(file: Path, content: bytes) -> None:
    """A file, whole or not at all."""
    part = file.with_name(file.name + toolchain.PART)
    part.write_bytes(content)
    os.replace(part, file)


def _forget(cache: Path) -> None:
    for folder in cache.glob(f"{toolchain.BUILDING}*"):
        if time.time() - folder.stat().st_mtime > FORGOTTEN:
            shutil.rmtree(folder, ignore_errors=True)
