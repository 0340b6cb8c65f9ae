"""Work behind a command, in a process of the lowest priority that ends with it, or soon after.

It ends when the command ends, whether by an error, Ctrl-C or a kill. If the command has its result and the work reports
that it is nearly done, it may go on for a while. Its children end with it. It must keep by itself what it has done.
"""

import mmap
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from ctypes import c_double

NICE = 19
"""Lowest priority of Unix: the work runs only when the processor is idle."""
NEARLY = 20.0
"""Work that reports at most this much time left may outlive the command [s], by at most twice this time."""
GO_ON = b"g"

Left = Callable[[float], None]
"""Reports how much time the work still needs [s]."""


class Work:
    """Work in a process of its own."""

    def __init__(self, do: Callable[[Left], None]):
        self._left = c_double.from_buffer(mmap.mmap(-1, 8))  # shared, without a file: /dev/shm may be read-only
        self._left.value = float("inf")
        ours, self._line = os.pipe()
        self._process = os.fork()
        if self._process == 0:
            os.close(self._line)
            _child(ours, do, self._left)
        os.close(ours)
        with suppress(OSError):  # the process ended it first
            os.setpgid(self._process, self._process)

    def finish(self) -> bool:
        """Let the work go on if it is nearly done, else end it. Returns whether it goes on or is complete."""
        ended, status = os.waitpid(self._process, os.WNOHANG)
        if ended:
            os.close(self._line)
            return status == 0
        if self._left.value > NEARLY:
            self.end()
            return False
        os.write(self._line, GO_ON)
        os.close(self._line)
        return True

    def end(self) -> None:
        """End it and its children."""
        with suppress(OSError):
            os.killpg(self._process, signal.SIGKILL)
        with suppress(OSError):
            os.waitpid(self._process, 0)
        os.close(self._line)


def _child(line: int, do: Callable[[Left], None], left: c_double) -> None:
    """Body of the process: silent, in its own group, which Ctrl-C at a terminal does not reach. It never returns."""
    code = 1
    try:
        os.setpgid(0, 0)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.nice(NICE)
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nothing, stream)
        threading.Thread(target=_watch, args=(line,), daemon=True).start()

        def tell(seconds: float) -> None:
            left.value = seconds

        do(tell)
        code = 0
    finally:
        os._exit(code)


def _watch(line: int) -> None:
    """End the process and its children when the command ends without a message, or a while after its message."""
    if os.read(line, 1) == GO_ON:
        time.sleep(2 * NEARLY)
    os.killpg(0, signal.SIGKILL)
