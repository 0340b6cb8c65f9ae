"""`sgnlp hands`: the hands that come with the package."""

from dataclasses import dataclass

from rich.console import Console

from sgnlp.hand.hand import available_hands, load_hand
from sgnlp.show import tables


@dataclass
class Hands:
    """List the hands that come with the package."""

    def run(self, console: Console) -> int:
        """One row a hand."""
        console.print(tables.hands_table([load_hand(name) for name in available_hands()]))
        return 0
