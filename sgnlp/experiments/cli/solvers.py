"""`sgnlp solvers`: the solvers that `--solver` and `sgnlp compare` know, and which of them run here."""

from dataclasses import dataclass

from rich.console import Console

from sgnlp.cli import codes
from sgnlp.experiments.compare.probe import missing
from sgnlp.planning.solvers import SOLVERS
from sgnlp.planning.solvers.solver import Entry
from sgnlp.show import tables


@dataclass
class Solvers:
    """List the nonlinear solvers, each tried on a small problem in a process of its own."""

    def run(self, console: Console) -> int:
        """One row a solver."""
        lines = [_line(name, entry, missing(entry.solver)) for name, entry in SOLVERS.items()]
        console.print(tables.rows_table("Solvers", lines, prose="what it is"))
        return codes.FEASIBLE


def _line(name: str, entry: Entry, missing: str) -> dict[str, str]:
    """The line of a solver, and what keeps it from running here."""
    about = [entry.summary, missing or entry.known]
    return {
        "name": name,
        "runs": "no" if missing else "yes",
        "what it is": f"{entry.kind}: {'; '.join(part for part in about if part)}",
    }
