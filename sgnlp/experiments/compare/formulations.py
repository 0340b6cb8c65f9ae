"""One solver on several formulations of the same problems from the same starts."""

import math

import numpy as np

from sgnlp.experiments.compare.table import Table, middle, short
from sgnlp.experiments.frames import Frame, Lines
from sgnlp.experiments.studies.significance import percent


def across(table: Table, solver: str) -> Lines:
    """A line for each formulation; none unless the solver ran on two or more.

    Energies are of different functions. So solutions are compared by the exact worst margin of each object's widest
    feasible one, as `sgnlp solve` ranks them.
    """
    ran = [name for name in table.formulations if len(table.of(name, solver, table.tolerances[0]))]
    return [_line(table, name, solver) for name in ran] if len(ran) > 1 else []


def advice(table: Table, solver: str) -> list[str]:
    """Which formulation is feasible most often, which meets the test of optimality, and which is quickest."""
    lines, tight = across(table, solver), f"{table.tolerances[-1]:g}"

    def first(column: str, sign: int) -> str:
        line = min(lines, key=lambda line: sign * float(line[column].split()[0]))
        shares = f"{line['feasible [%]']} % of {line['starts']} starts are feasible, {line[f'{tight} [%]']} % reach"
        return f"`{line['formulation']}`. {shares} {tight}; the median time is {line['time [s]']} s."

    return [
        f"Feasible most often: {first('feasible [%]', -1)}",
        f"Reaches {tight} most often: {first(f'{tight} [%]', -1)}",
        f"Fastest: {first('time [s]', 1)}",
    ]


def _line(table: Table, formulation: str, solver: str) -> dict[str, str]:
    ends = table.answers(formulation, solver)
    margins = widest(ends)
    planned = margins[np.isfinite(margins)]
    line = {"formulation": formulation, "starts": str(len(ends))}
    line |= {f"{t:g} [%]": percent(*table.solved_at(formulation, solver, t)) for t in table.tolerances}
    line |= {"feasible [%]": percent(ends.feasible.sum(), len(ends)), "iterations": middle(ends.iterations)}
    line |= {"time [s]": middle(ends.cpu), "mean time [s]": short(ends.cpu[np.isfinite(ends.cpu)].mean(), 3)}
    return line | {"objects planned": f"{len(planned)} of {len(margins)}", "margin, mean": short(planned.mean(), 3)}


def widest(ends: Frame) -> Frame:
    """The widest worst margin of a feasible end for each object, -∞ where there is none."""
    return ends.margin.where(ends.feasible, -math.inf).groupby(ends.object).max()
