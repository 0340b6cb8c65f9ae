"""The progress bar."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn


@contextmanager
def starts_bar(console: Console, total: int, show: bool) -> Iterator[Callable[[object], None]]:
    """A progress bar over starts, on a terminal only; gives the callback that advances it by one."""
    columns = (TextColumn("solving"), BarColumn(), MofNCompleteColumn(), TextColumn("starts"), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not (show and console.is_terminal), transient=True) as bar:
        task = bar.add_task("solve", total=total)
        yield lambda result: bar.advance(task)
