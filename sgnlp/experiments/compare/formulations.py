"""One solver on several formulations of the same problems from the same starts."""

from collections import defaultdict
from collections.abc import Sequence
from math import isfinite
from statistics import fmean

from sgnlp.experiments.compare.row import Row
from sgnlp.experiments.compare.table import Table, middle, short
from sgnlp.experiments.studies.significance import percent
from sgnlp.experiments.studies.study import Lines


def across(table: Table, solver: str) -> Lines:
    """A line for each formulation; none unless the solver ran on two or more.

    Energies are of different functions, so what the solutions are worth is told by the exact worst margin of each
    object's widest feasible one, as `sgnlp solve` ranks them.
    """
    ran = [name for name in table.formulations if table.of(name, solver, table.tolerances[0])]
    return [_line(table, name, solver) for name in ran] if len(ran) > 1 else []


def advice(table: Table, solver: str) -> list[str]:
    """Which formulation is feasible most often, which meets the test of optimality, and which is quickest."""
    lines, tight = across(table, solver), table.tolerances[-1]

    def first(column: str, sign: int) -> str:
        line = min(lines, key=lambda line: sign * float(line[column].split()[0]))
        shares = f"feasible on {line['feasible [%]']} %, at {tight:g} on {line[f'{tight:g} [%]']} %"
        return f"`{line['formulation']}`, {shares} of {line['starts']} starts, {line['time [s]']} s."

    return [
        f"Feasible most often: {first('feasible [%]', -1)}",
        f"At {tight:g} most often: {first(f'{tight:g} [%]', -1)}",
        f"Quickest, in the median: {first('time [s]', 1)}",
    ]


def _line(table: Table, formulation: str, solver: str) -> dict[str, str]:
    ends = table.answers(formulation, solver)
    margins = widest(ends)
    planned = [margin for margin in margins.values() if isfinite(margin)]
    return {
        "formulation": formulation,
        "starts": str(len(ends)),
        **{f"{t:g} [%]": percent(*table.solved_at(formulation, solver, t)) for t in table.tolerances},
        "feasible [%]": percent(sum(row.feasible for row in ends), len(ends)),
        "iterations": middle(row.iterations for row in ends),
        "time [s]": middle(row.cpu for row in ends),
        "mean time [s]": short(fmean(row.cpu for row in ends if isfinite(row.cpu)), 3),
        "objects planned": f"{len(planned)} of {len(margins)}",
        "margin, mean": short(fmean(planned), 3) if planned else "-",
    }


def widest(ends: Sequence[Row]) -> dict[str, float]:
    """The widest worst margin of a feasible end for each object, -∞ where there is none."""
    found: dict[str, float] = defaultdict(lambda: float("-inf"))
    for row in ends:
        found[row.object] = max(found[row.object], row.margin if row.feasible else float("-inf"))
    return dict(found)
