"""`sgnlp export`: writes the nonlinear programs of problems for users of CasADi alone, with a catalogue."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from sgnlp.base.errors import InputError
from sgnlp.cli import codes
from sgnlp.cli.flags import ROWS, Observing, made
from sgnlp.experiments.testset import Entry, export
from sgnlp.perception.observation import load
from sgnlp.planning import results
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import build_problem
from sgnlp.planning.starts import starts
from sgnlp.show import tables

COLUMNS = {
    "name": "problem", "variables": "variables", "rows": "rows", "jacobian_nonzeros": "nnz J",
    "hessian_nonzeros": "nnz H", "surface_points": "surface points", "initial": "f(x0)", "best": "best known f",
    "residual": "its residual", "solver": "found by", "best_start": "from start",
}  # fmt: skip
"""The columns of the catalogue's table."""


@dataclass(kw_only=True)
class Export(Observing):
    """Write the nonlinear program of each cloud as CasADi functions with bounds, start and best known point.

    Each program has a folder with a `load.py`, which needs only CasADi; beside the folders there is a catalogue.
    """

    files: tyro.conf.Positional[tuple[Path, ...]]
    """the clouds"""
    start: int = 0
    """the start of the written program; all starts are solved for the best known point"""
    catalogue: bool = False
    """write only the catalogue"""
    out: Path = Path("results/testset")
    """folder of the programs and the catalogue"""

    def run(self, console: Console) -> int:
        """One program after the other, then the catalogue."""
        if not 0 <= self.start < self.starts:
            raise InputError(f"--start must be one of the {self.starts} starts, 0 to {self.starts - 1}")
        results.writable(self.out)
        rows, inputs = [], {}
        for file in self.files:
            observation = load(file, self.reading)
            problem = build_problem(observation, self.hand, self.settings, self.seed)
            guesses = starts(problem, self.starts, self.seed)
            program = export(observation.name, Planner(problem, self.solver), guesses, self.start, self.seed)
            if not self.catalogue:
                program.write(self.out / observation.name)
            rows.append(program.entry)
            inputs[observation.name] = observation.digest
            console.print(f"{observation.name}: best known {program.entry.best:.6f}", soft_wrap=True)
        results.write_rows(self.out / ROWS, rows)
        results.write_text(self.out / "table.md", tables.markdown([_line(row) for row in rows]))
        how: dict[str, Any] = made(inputs=inputs, hand=self.hand, settings=asdict(self.settings))
        results.write_text(self.out / "made.json", results.json_text(how))
        console.print(f"written: {self.out}", soft_wrap=True)
        return codes.FEASIBLE


def _line(row: Entry) -> dict[str, str]:
    values = {title: getattr(row, name) for name, title in COLUMNS.items()}
    return {title: f"{value:.9g}" if isinstance(value, float) else str(value) for title, value in values.items()}
