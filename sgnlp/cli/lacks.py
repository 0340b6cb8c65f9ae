"""What this machine lacks, told where a command does without it."""

from rich.console import Console

from sgnlp.base import semaphores


def tell(console: Console) -> None:
    """Say that the work is done in one process, where there are no semaphores."""
    if fault := semaphores.fault():
        console.print(f"One process at a time: {fault}.", style="dim", soft_wrap=True)
