"""One command at a time in a folder of rows."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from sgnlp.base.errors import InputError

LOCK = ".lock"


@contextmanager
def alone(folder: Path, holder: Callable[[], str]) -> Iterator[None]:
    """Make a folder and lock it. The kernel releases the lock when the process ends, however it ends.

    `holder` names the process that may have the lock. Some network file systems have no locks; there nothing is locked.

    Raises:
        InputError: another process has the lock.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        said = f"'{folder}' is in use by another command ({holder()})"
        raise InputError(f"{said}; wait until it ends, or choose another --out") from None
    except (NotImplementedError, OSError):
        yield
        return
    try:
        yield
    finally:
        lock.release()
