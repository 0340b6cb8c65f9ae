"""Child processes that end when their parent ends, however it ends, and what Ctrl-C may not interrupt."""

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

PR_SET_PDEATHSIG = 1
"""The option of Linux's prctl(2) that sets the signal to send when the parent ends."""


def follow_parent() -> None:
    """Leave Ctrl-C to the parent of this process, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent()


@contextmanager
def with_children() -> Iterator[None]:
    """Allow this process to fork even if it is a daemon, as the workers of `multiprocessing.Pool` are.

    multiprocessing denies that to daemons, whose children would be left behind. Ours end with their parent.
    """
    process = multiprocessing.current_process()
    before, process.daemon = process.daemon, False
    try:
        yield
    finally:
        process.daemon = before


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back until the end; processes and threads that are started meanwhile never receive it.

    Those inherit the blocked signal. Blocking is not enough for the main thread: the kernel gives the signal to another
    thread that does not block it, and Python then interrupts the main one. So its handler is replaced, too.
    """
    handler, came = signal.getsignal(signal.SIGINT), list[int]()
    replaced = threading.current_thread() is threading.main_thread() and handler is not None
    if replaced:
        signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if replaced:
            signal.signal(signal.SIGINT, handler)
        if came:
            signal.raise_signal(signal.SIGINT)


def die_with_parent() -> None:
    """Let the kernel kill this process when the thread that started it ends. Only Linux can do this.

    Without it a worker can be left behind. It waits for work forever, because it holds both ends of its parent's pipe.
    And a pool forks a new worker when one is killed, so killing the processes one by one leaves the new one.
    """
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    parent = multiprocessing.parent_process()
    if parent is not None and parent.pid != os.getppid():  # the parent has ended already
        os._exit(1)
