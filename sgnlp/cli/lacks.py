"""A note on what this machine lacks, for commands that work without it."""

from rich.console import Console

from sgnlp.base import semaphores


def tell(console: Console) -> None:
    """Print that only one process works, if the machine has no semaphores."""
    if fault := semaphores.fault():
        console.print(f"One process at a time: {fault}.", style="dim", soft_wrap=True)
