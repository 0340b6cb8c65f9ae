"""Processes that do not outlive the one that started them, however that one ends."""

import ctypes
import multiprocessing
import os
import signal
import sys

PR_SET_PDEATHSIG = 1
"""The option of Linux's prctl(2) that names the signal for when the parent ends."""


def die_with_parent() -> None:
    """Let the kernel kill this process when the thread that started it ends; on Linux alone.

    A pool whose process is killed forks another one: whoever kills the processes of a tree one by one leaves that. A
    worker that waits for work would wait for ever: it holds both ends of the pipe that its parent wrote to.
    """
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    parent = multiprocessing.parent_process()
    if parent is not None and parent.pid != os.getppid():  # it has ended already
        os._exit(1)
