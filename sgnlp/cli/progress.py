"""Progress bars, shown on a terminal only. Whatever moves one hears Ctrl-C."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from sgnlp.cli.interrupts import check

COLUMNS = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())


@dataclass(frozen=True)
class Bar:
    """One bar."""

    progress: Progress
    task: TaskID

    def advance(self, result: object) -> None:
        """One more is done."""
        check()
        self.progress.advance(self.task)

    def move(self, done: int, total: int) -> None:
        """So many are done of so many."""
        check()
        self.progress.update(self.task, completed=done, total=total)


@contextmanager
def bars(console: Console, show: bool = True) -> Iterator[Callable[[str, int | None], Bar]]:
    """Several bars below each other; gives what makes one of a text and the total, if that is known."""
    hidden = not (show and console.is_terminal)
    with Progress(*COLUMNS, console=console, disable=hidden, transient=True) as progress:
        yield lambda text, total: Bar(progress, progress.add_task(text, total=total))
