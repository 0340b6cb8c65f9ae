"""One command at a time in a folder of rows."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from sgnlp.base.errors import InputError

LOCK = ".lock"


@contextmanager
def alone(folder: Path, holder: Callable[[], str]) -> Iterator[None]:
    """Hold a folder, which is made. The kernel lets go of it when the process ends, however that ends.

    `holder` tells who else may have it. A file system without locks (some of a network) holds nothing.

    Raises:
        InputError: another process has it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        said = f"'{folder}' is in use by another command ({holder()})"
        raise InputError(f"{said}; wait for its end or choose another --out") from None
    except (NotImplementedError, OSError):
        yield
        return
    try:
        yield
    finally:
        lock.release()
