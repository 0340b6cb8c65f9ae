"""`sgnlp solvers`: the solvers that `sgnlp compare` knows, and which of them run here."""

from dataclasses import dataclass

from rich.console import Console

from sgnlp.cli import codes
from sgnlp.planning import solvers
from sgnlp.planning.solvers.anatomy import Method
from sgnlp.planning.solvers.probe import missing
from sgnlp.show import tables


@dataclass
class Solvers:
    """List the nonlinear solvers, each tried on a small problem in a process of its own."""

    def run(self, console: Console) -> int:
        """One row a solver."""
        lines = [_line(method, missing(method)) for method in solvers.found().values()]
        console.print(tables.rows_table("Solvers", lines, prose="what it is"))
        return codes.FEASIBLE


def _line(method: Method, missing: str) -> dict[str, str]:
    """The line of a solver, and what keeps it from running here."""
    about = [method.summary, missing or method.known]
    return {
        "name": method.name,
        "runs": "no" if missing else "yes",
        "what it is": f"{method.kind}: {'; '.join(part for part in about if part)}",
    }
