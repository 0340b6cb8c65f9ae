"""Ctrl-C ends a command at any point, and the interrupted code prints nothing."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

AGAIN = 0.05
"""A Ctrl-C that was lost is raised again after this time [s]."""


@dataclass
class _CtrlC:
    """Whether Ctrl-C has come, and whether the command has certainly seen it."""

    owner: int = field(default_factory=os.getpid)
    report_ignored: Callable[[Any], object] = field(default_factory=lambda: sys.unraisablehook)
    report_ended: Callable[[Any], object] = field(default_factory=lambda: threading.excepthook)
    come: bool = False
    told: bool = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt, but not inside the hooks of a fork: that would leave the lock of logging held."""
        if os.getpid() != self.owner:  # a process just forked is ended by its parent
            return
        self.come = True
        if frame is not None and frame.f_globals.get("__name__") == "logging":
            self.again()
        else:
            raise KeyboardInterrupt

    def again(self) -> None:
        """Raise it again a moment later, by a timer of the kernel: a thread cannot be started everywhere."""
        signal.setitimer(signal.ITIMER_REAL, AGAIN)

    def handle_again(self, number: int, frame: FrameType | None) -> None:
        """The timer has run out."""
        if not self.told:
            self.handle(number, frame)

    def ignored(self, unraisable: Any) -> None:
        """Replaces Python's report on an exception that cannot be caught."""
        if not self.come:
            self.report_ignored(unraisable)
        elif issubclass(unraisable.exc_type, KeyboardInterrupt):
            self.again()

    def ended(self, thread: Any) -> None:
        """Replaces Python's report on an exception that ends a thread."""
        if not self.come:
            self.report_ended(thread)


_now = _CtrlC()


@contextmanager
def listening() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt, and raises it again where it would be lost:

    * in a destructor, a callback or a hook of a fork, where Python would print it as ignored: a moment later;
    * in CasADi, which clears errors while it converts arguments, and with them one Ctrl-C of ten during the building
      of symbolic functions; or in a thread that starts, where it becomes another error: at `check`.

    Errors in destructors and threads after a Ctrl-C are its consequence and are not printed.
    """
    global _now
    _now = _CtrlC()
    handlers = {signal.SIGINT: _now.handle, signal.SIGALRM: _now.handle_again}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    sys.unraisablehook, threading.excepthook = _now.ignored, _now.ended
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook, threading.excepthook = _now.report_ignored, _now.report_ended


def check() -> None:
    """Raise KeyboardInterrupt if Ctrl-C has come."""
    if _now.come:
        _now.told = True
        raise KeyboardInterrupt


def silence() -> None:
    """After Ctrl-C, let the interpreter end without output, and at once at a second Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.unraisablehook = lambda ignored: None
    threading.excepthook = lambda ended: None
