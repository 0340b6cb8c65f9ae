"""The progress bar, and Ctrl-C while it is shown."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

AGAIN = 0.05
"""After this [s] a Ctrl-C that came inside the hooks of a fork is sent again."""


@contextmanager
def starts_bar(console: Console, total: int, show: bool) -> Iterator[Callable[[object], None]]:
    """A progress bar over starts, on a terminal only; gives the callback that advances it by one."""
    columns = (TextColumn("solving"), BarColumn(), MofNCompleteColumn(), TextColumn("starts"), TimeElapsedColumn())
    hidden = not (show and console.is_terminal)
    with interrupts() as check, Progress(*columns, console=console, disable=hidden, transient=True) as bar:
        task = bar.add_task("solve", total=total)

        def advance(result: object) -> None:
            check()
            bar.advance(task)

        yield advance


@contextmanager
def counting_bar(console: Console, text: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar, on a terminal only; gives the callback that sets it to (done, total)."""
    columns = (TextColumn(text), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with interrupts() as check, Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(text, total=None)

        def advance(done: int, total: int) -> None:
            check()
            bar.update(task, completed=done, total=total)

        yield advance


@contextmanager
def interrupts() -> Iterator[Callable[[], None]]:
    """Ctrl-C raises KeyboardInterrupt, and again wherever the given function is called and at the end, however reached.

    Once is not enough: CasADi clears the errors that it meets in converting arguments, and with them one Ctrl-C of
    ten that come while the symbolic functions are built; a thread that is starting turns it into another error.
    """
    caught, owner = False, os.getpid()

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal caught
        caught = True
        if os.getpid() != owner:  # a process just forked is ended by its parent
            return
        if frame is not None and frame.f_globals.get("__name__") == "logging":
            threading.Timer(AGAIN, os.kill, (owner, number)).start()  # a fork runs its hooks and prints what they raise
            return
        raise KeyboardInterrupt

    def check() -> None:
        if caught:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
        check()
