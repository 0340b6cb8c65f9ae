"""`sgnlp solvers`: the solvers that `sgnlp compare` knows, and which of them run here."""

from dataclasses import dataclass

from rich.console import Console

from sgnlp import report, solvers
from sgnlp.solvers.probe import missing


@dataclass
class Solvers:
    """List the nonlinear solvers, each tried on a small problem in a process of its own."""

    def run(self, console: Console) -> int:
        """One row a solver."""
        lines = [
            {
                "name": method.name,
                "kind": method.kind,
                "derivatives": str(method.derivatives),
                "runs": missing(method) or "yes",
                "what it is": f"{method.summary}; {method.known}" if method.known else method.summary,
            }
            for method in solvers.found().values()
        ]
        console.print(report.rows_table("Solvers", lines))
        return 0
