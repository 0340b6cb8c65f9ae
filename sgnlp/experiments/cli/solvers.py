"""`sgnlp solvers`: the solvers that `sgnlp compare` knows, and which of them run here."""

from dataclasses import dataclass

from rich.console import Console

from sgnlp.cli import codes
from sgnlp.planning import solvers
from sgnlp.planning.solvers.probe import missing
from sgnlp.show import tables


@dataclass
class Solvers:
    """List the nonlinear solvers, each tried on a small problem in a process of its own."""

    def run(self, console: Console) -> int:
        """One row a solver."""
        lines = []
        for method in solvers.found().values():
            lack = missing(method)
            about = "; ".join(filter(None, (method.summary, lack or method.known)))
            lines.append(
                {"name": method.name, "runs": "no" if lack else "yes", "what it is": f"{method.kind}: {about}"}
            )
        console.print(tables.rows_table("Solvers", lines, prose="what it is"))
        return codes.FEASIBLE
