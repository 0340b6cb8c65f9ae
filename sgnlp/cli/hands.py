"""`sgnlp hands`: the hands that come with the package."""

from dataclasses import dataclass

from rich.console import Console

from sgnlp.hand.listing import listed_hands
from sgnlp.show import tables


@dataclass
class Hands:
    """List the hands that come with the package, and how to install what a hand still needs."""

    def run(self, console: Console) -> int:
        """One row a hand."""
        console.print(tables.hands_table(listed_hands()))
        return 0
