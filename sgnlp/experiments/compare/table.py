"""The rows of a comparison as frames, and the tables of the report."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from sgnlp.experiments.compare.row import Row
from sgnlp.experiments.frames import Frame, Lines, frame, lines, percent, pick
from sgnlp.planning.solvers.casadi_call import CALLS

SAME = 1e-3  # energies that differ by less, relative to the larger or absolute, are of the same local optimum
DECREASE = 1e-3  # τ of Moré & Wild's test of convergence, f(x₀) - f(x) ≥ (1 - τ)(f(x₀) - f_best)
ADMISSIBLE = 1e-3  # largest violation at a point whose energy counts
INSTANCE = ["object", "formulation", "start"]  # what is the same for all solvers
RUN = [*INSTANCE, "solver"]
SHIFT = 0.1  # shift of the geometric mean [s]: differences below it hardly count; Ipopt takes about as long here


class Table:
    """The rows of a comparison, and two selections of them with additional columns.

    `last` has the last repeat of each run, which is warm. `ends` has, for each instance and solver, the row of the
    tightest tolerance that gave an answer. `best` is the lowest energy of any solver from the same start with the rows
    satisfied. `time` is `cpu` if the tolerance was reached, else infinite. `calls` counts all functions. `cold`,
    `warm`, `least` and `most` are `cpu` over the repeats; `way` is the first repeat's trace.
    """

    def __init__(self, rows: Sequence[Row]):
        self.rows = found = frame(rows)
        self.solvers, self.formulations = list(found.solver.unique()), list(found.formulation.unique())
        self.tolerances = sorted(map(float, found.tolerance.unique()), reverse=True)
        met = found[(found.primal <= ADMISSIBLE) & np.isfinite(found.energy)]
        repeats = found.groupby([*RUN, "tolerance"], sort=False)
        times = {"cold": "first", "warm": "last", "least": "min", "most": "max"}
        over = repeats.agg(count=("cpu", "size"), way=("trace", "first"), **{k: ("cpu", v) for k, v in times.items()})
        last = found.loc[repeats.repeat.idxmax()].join(over, [*RUN, "tolerance"])
        last = last.join(met.groupby(INSTANCE).energy.min().rename("best"), INSTANCE)
        self.last = last.assign(time=last.cpu.where(last.reached, math.inf), calls=last[[*CALLS.values()]].sum(axis=1))
        tightness = (1 / last.tolerance).where(np.isfinite(last.energy), -1 / last.tolerance)
        self.ends = self.last.loc[tightness.groupby([last[name] for name in RUN], sort=False).idxmax()]
        self._answers = dict(list(self.ends.groupby(["formulation", "solver"])))
        self._of = dict(list(self.last.groupby(["formulation", "solver", "tolerance"])))

    def answers(self, formulation: str, solver: str) -> Frame:
        """The `ends` of a solver."""
        return self._answers.get((formulation, solver), self.ends.iloc[:0])

    def of(self, formulation: str, solver: str, tolerance: float) -> Frame:
        """The warm rows of a solver."""
        return self._of.get((formulation, solver, tolerance), self.last.iloc[:0])

    def times(self, formulation: str, tolerance: float) -> Frame:
        """Processor times to the tolerance: a line for each instance, a column for each solver."""
        return _wide(pick(self.last, formulation=formulation, tolerance=tolerance), "time")

    def works(self, formulation: str, size: int) -> Frame:
        """Calls of the functions, in units of n + 1, to the decrease of Moré & Wild with the rows met."""
        ends = pick(self.ends, formulation=formulation)
        enough = ends.energy_start - ends.energy >= (1 - DECREASE) * (ends.energy_start - ends.best)
        work = (ends.calls / (size + 1)).where(enough & (ends.primal <= ADMISSIBLE), math.inf)
        return _wide(ends.assign(work=work), "work")

    def solved_at(self, formulation: str, solver: str, tolerance: float) -> tuple[int, int]:
        """The number of instances that reached a tolerance, and the number of all instances."""
        rows = self.of(formulation, solver, tolerance)
        return int(rows.reached.sum()), len(rows)

    def mean_time(self, formulation: str, solver: str, tolerance: float) -> float:
        """The shifted geometric mean of the times of solved instances [s]."""
        rows = self.of(formulation, solver, tolerance)
        return shifted_geometric_mean(rows.cpu[rows.reached])

    def order(self, formulation: str) -> list[str]:
        """Solvers from the best on: by success at the tightest tolerance, at the loosest, then by mean time."""
        loosest, tightest = self.tolerances[0], self.tolerances[-1]

        def rank(solver: str) -> tuple[float, float, float]:
            tight, n = self.solved_at(formulation, solver, tightest)
            loose, _ = self.solved_at(formulation, solver, loosest)
            mean = self.mean_time(formulation, solver, loosest)
            return -tight / max(n, 1), -loose / max(n, 1), mean if math.isfinite(mean) else math.inf

        return sorted((s for s in self.solvers if len(self.of(formulation, s, loosest))), key=rank)


def _wide(rows: Frame, value: str) -> Frame:
    return rows.pivot(index=INSTANCE, columns="solver", values=value)


def shifted_geometric_mean(times: Sequence[float], shift: float = SHIFT) -> float:
    """exp(mean log(t + s)) - s, infinite if one is; NaN of none."""
    return float(np.exp(np.log(np.add(times, shift)).mean()) - shift) if len(times) else math.nan


def short(value: float, digits: int = 2) -> str:
    """A number for a table, `-` of NaN and `∞` of infinity."""
    return "-" if math.isnan(value) else "∞" if math.isinf(value) else f"{value:.{digits}g}"


def middle(values: Any, digits: int = 3) -> str:
    """The median of what is finite."""
    return short(float(values[np.isfinite(values)].median()), digits)


def success(table: Table, formulation: str) -> Lines:
    """A line for each solver: what it reaches, in which time, and where it is feasible."""
    found, tight = [], table.tolerances[-1]
    for solver in table.order(formulation):
        ends, rows = table.answers(formulation, solver), table.of(formulation, solver, tight)
        line = {"solver": solver, "runs": str(len(rows))}
        line |= {f"{t:g} [%]": percent(*table.solved_at(formulation, solver, t)) for t in table.tolerances}
        line |= {f"time to {t:g} [s]": short(table.mean_time(formulation, solver, t)) for t in table.tolerances}
        line["with failures"] = short(shifted_geometric_mean(rows.time))
        found.append(line | {"feasible [%]": percent(ends.feasible.sum(), len(ends))})
    return found


def effort(table: Table, formulation: str) -> Lines:
    """Median iterations and calls of the runs that reached the loosest tolerance they could, and their times."""
    found = []
    for solver in table.order(formulation):
        ends = table.answers(formulation, solver)
        rows = ends[np.isfinite(ends.cpu)]
        again = rows[rows["count"] > 1]
        columns = {"iterations": rows.iterations} | {call: rows[call] for call in CALLS.values()}
        columns |= {"build [s]": rows.build, "setup [s]": rows.setup, "cold [s]": rows.cold, "warm [s]": again.warm}
        columns |= {"slowest over fastest": again.most / again.least}
        columns |= {"wall over processor": (rows.seconds / rows.cpu)[rows.cpu > 0]}
        found.append({"solver": solver} | {name: middle(values) for name, values in columns.items()})
    return found


def optima(table: Table, formulation: str) -> Lines:
    """How far each solver ends above the best known energy, from the same start and for the same object."""
    found, objects = [], pick(table.ends, formulation=formulation).groupby("object").best.min()
    for solver in table.order(formulation):
        ends = table.answers(formulation, solver)
        rows = ends[ends.primal <= ADMISSIBLE]
        over = rows.energy - rows.best
        same = (over <= SAME * rows.energy.abs().clip(lower=1)).sum()
        line = {"solver": solver, "rows met": f"{len(rows)} of {len(ends)}"}
        line |= {"best of its start [%]": percent(same, len(ends)), "above it, median": middle(over)}
        found.append(
            line | {"above the object's best, median": middle(rows.energy - rows.object.map(objects).astype(float))}
        )
    return found


def pairs(table: Table, formulation: str, most: int = 8) -> Lines:
    """In how many percent of the common instances the solver of the line is faster than that of the column."""
    times, names = table.times(formulation, table.tolerances[-1]), table.order(formulation)[:most]

    def share(one: str, other: str) -> str:
        common = times[[one, other]].dropna()
        return f"{100 * (common[one] < common[other]).mean():.0f}" if len(common) else "-"

    if len(names) < 2:
        return []
    return [{"faster": a} | {b: "" if a == b else share(a, b) for b in names} for a in names]


def failures(table: Table) -> Lines:
    """Why runs have no answer, or none within the limit, counted."""
    failed = table.rows[(table.rows.failure != "") & ~table.rows.failure.str.startswith("not tried")]
    counts = failed.groupby(["solver", "formulation", "failure"], sort=False).size().reset_index(name="runs")
    return lines(counts[["solver", "formulation", "runs", "failure"]].rename(columns={"failure": "reason"}))


def liars(table: Table) -> Lines:
    """Runs that the solver calls a success but that miss the tolerance, or the other way round."""
    rows = table.last[(table.last.status != "") & (table.last.failure == "")]
    said = rows.status.map(claims).astype(bool)
    columns = {"says success": said, "of these missed": said & ~rows.reached}
    columns["reached without saying so"] = ~said & rows.reached
    counts = rows[["solver"]].assign(**columns).groupby("solver").sum().reindex(table.solvers, fill_value=0)
    return lines(counts[counts.iloc[:, 1:].any(axis=1)].reset_index())


def claims(status: str) -> bool:
    """Whether a solver's status claims success."""
    words = ("success", "succeeded", "optimal", "converged", "solve_succeeded", "convergence", "satisfied")
    return any(word in status.lower() for word in words) and "not optimal" not in status.lower()
