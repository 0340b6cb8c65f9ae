"""`sgnlp arms`: the arms that come with the package."""

from dataclasses import dataclass

from rich.console import Console

from sgnlp.hand.arm import available_arms, load_arm
from sgnlp.show import tables


@dataclass
class Arms:
    """List the arms that come with the package."""

    def run(self, console: Console) -> int:
        """One row an arm."""
        console.print(tables.arms_table([load_arm(name) for name in available_arms()]))
        return 0
