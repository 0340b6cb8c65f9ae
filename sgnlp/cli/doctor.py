"""`sgnlp doctor`: what runs here."""

from dataclasses import dataclass
from typing import Any

from rich.console import Console

from sgnlp import environment, report


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
