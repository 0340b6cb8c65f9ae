"""Checks for the semaphores that pools of processes need; some containers have none."""

import multiprocessing
from functools import lru_cache


@lru_cache(maxsize=1)
def fault() -> str:
    """Why there are no semaphores, with the remedy; "" if there are."""
    try:
        multiprocessing.get_context("fork").Lock()
    except (OSError, ImportError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        return f"this machine has no semaphores ({reason}); several processes need a writable /dev/shm"
    return ""
