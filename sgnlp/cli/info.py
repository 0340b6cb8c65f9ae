"""`sgnlp hands` and `sgnlp doctor`: what there is and what runs here."""

from dataclasses import dataclass
from typing import Any

from rich.console import Console

from sgnlp import environment, report
from sgnlp.hand import available_hands, load_hand


@dataclass
class Hands:
    """List the hands that come with the package."""

    def run(self, console: Console) -> int:
        """One row a hand."""
        table = report.hands_table([load_hand(name) for name in available_hands()])
        console.print(table)
        return 0


@dataclass
class Doctor:
    """Show versions, the solvers found, and which forward kinematics runs."""

    def run(self, console: Console) -> int:
        """One block a question."""
        facts: dict[str, Any] = {
            "machine": environment.machine(),
            "versions": environment.versions(),
            "solvers": {name: "found" if found else "missing" for name, found in environment.solvers().items()},
            "evaluated by": {
                "forward kinematics": environment.kinematics_backend(),
                "surface": environment.surface_backend(),
            },
        }
        for title, rows in facts.items():
            console.print(report.facts_table(title, rows))
        return 0
