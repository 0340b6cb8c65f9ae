"""One command at a time in a folder."""

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from sgnlp.base.errors import InputError

LOCK, HOLDER = ".lock", ".lock-holder"


@contextmanager
def alone(folder: Path, flag: str) -> Iterator[None]:
    """Make a folder and lock it; the error names `flag`, which chooses another folder.

    The kernel releases the lock when the process ends, however it ends. Some network file systems have no locks; on
    those nothing is locked.

    Raises:
        InputError: another process has the lock; it is named.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock, holder = FileLock(folder / LOCK), folder / HOLDER
    try:
        lock.acquire(timeout=0)
    except Timeout:
        said = f"'{folder}' is in use by another command ({_read(holder)})"
        raise InputError(f"{said}; wait until it ends, or choose another {flag}") from None
    except (NotImplementedError, OSError):
        yield
        return
    with suppress(OSError):  # no room: the lock holds without a name
        holder.write_text(f"process {os.getpid()} on {platform.node()}", encoding="utf-8")
    try:
        yield
    finally:
        with suppress(OSError):
            holder.unlink()
        lock.release()


def _read(holder: Path) -> str:
    try:
        return holder.read_text(encoding="utf-8") or "which begins"
    except (OSError, UnicodeDecodeError):
        return "which begins"
