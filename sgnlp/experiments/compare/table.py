"""Raw rows as what the measures take, and as the tables of the report."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import median

from sgnlp.experiments.compare.measures import decreased, shifted_geometric_mean, wins
from sgnlp.experiments.compare.row import Instance, Row
from sgnlp.experiments.studies.significance import percent
from sgnlp.experiments.studies.study import Lines

SAME = 1e-3
"""Energies that differ by less, relative to the larger or absolute, are of the same local optimum."""
DECREASE = 1e-3
"""τ of Moré & Wild's test."""
ADMISSIBLE = 1e-3
"""Largest violation at a point whose energy counts."""

Times = dict[Instance, dict[str, float]]


@dataclass(frozen=True, eq=False)
class Table:
    """The rows of a study; of several repeats the last, which is warm, stands for all."""

    rows: Sequence[Row]

    @cached_property
    def solvers(self) -> list[str]:
        """Every solver, in the order of the rows."""
        return list(dict.fromkeys(row.solver for row in self.rows))

    @cached_property
    def formulations(self) -> list[str]:
        """Every formulation."""
        return list(dict.fromkeys(row.formulation for row in self.rows))

    @cached_property
    def tolerances(self) -> list[float]:
        """Every tolerance, the loosest first."""
        return sorted({row.tolerance for row in self.rows}, reverse=True)

    @cached_property
    def runs(self) -> dict[tuple[Instance, str, float], list[Row]]:
        """The repeats of each run."""
        found: dict[tuple[Instance, str, float], list[Row]] = defaultdict(list)
        for row in self.rows:
            found[row.instance, row.solver, row.tolerance].append(row)
        return dict(found)

    @cached_property
    def last(self) -> dict[tuple[Instance, str, float], Row]:
        """The warmest repeat of each run."""
        return {key: max(rows, key=lambda row: row.repeat) for key, rows in self.runs.items()}

    @cached_property
    def ends(self) -> dict[tuple[Instance, str], Row]:
        """The run of each solver on each instance with the tightest tolerance that was tried, and gave an answer."""
        found: dict[tuple[Instance, str], Row] = {}
        for (instance, solver, _), row in sorted(self.last.items(), key=lambda item: -item[0][2]):
            if math.isfinite(row.energy) or (instance, solver) not in found:
                found[instance, solver] = row
        return found

    def answers(self, formulation: str, solver: str) -> list[Row]:
        """The `ends` of a solver."""
        return [row for (instance, name), row in self.ends.items() if (instance[1], name) == (formulation, solver)]

    def unaided(self, instance: Instance, solver: str) -> Row | None:
        """The answer to the tightest tolerance at which the solver ended by itself."""
        rows = (self.last.get((instance, solver, tolerance)) for tolerance in reversed(self.tolerances))
        return next((row for row in rows if row and not row.failure), None)

    def of(self, formulation: str, solver: str, tolerance: float) -> list[Row]:
        """The warm rows of a solver."""
        return [
            row
            for (instance, s, t), row in self.last.items()
            if (instance[1], s, t) == (formulation, solver, tolerance)
        ]

    def times(self, formulation: str, tolerance: float) -> Times:
        """Processor times to the tolerance by instance and solver."""
        return self._values(formulation, tolerance, lambda row: row.time)

    def works(self, formulation: str, size: int) -> Times:
        """Calls of the functions, in units of n + 1, to the decrease of Moré & Wild with the rows met."""
        found: Times = defaultdict(dict)
        for (instance, solver), row in self.ends.items():
            if instance[1] == formulation:
                best = self.best.get(instance, math.nan)
                enough = row.primal <= ADMISSIBLE and decreased(row.energy, row.energy_start, best, DECREASE)
                found[instance][solver] = row.calls / (size + 1) if enough else math.inf
        return dict(found)

    def _values(self, formulation: str, tolerance: float, value: Callable[[Row], float]) -> Times:
        found: Times = defaultdict(dict)
        for (instance, solver, t), row in self.last.items():
            if (instance[1], t) == (formulation, tolerance):
                found[instance][solver] = value(row)
        return dict(found)

    @cached_property
    def best(self) -> dict[Instance, float]:
        """The lowest energy of any solver from each start where the rows are met."""
        found: dict[Instance, float] = {}
        for row in self.rows:
            if row.primal <= ADMISSIBLE and math.isfinite(row.energy):
                found[row.instance] = min(row.energy, found.get(row.instance, math.inf))
        return found

    def solved_at(self, formulation: str, solver: str, tolerance: float) -> tuple[int, int]:
        """How many instances reached a tolerance, of how many."""
        rows = self.of(formulation, solver, tolerance)
        return sum(row.reached for row in rows), len(rows)

    def order(self, formulation: str) -> list[str]:
        """Solvers from the best on: by success at the tightest tolerance, at the loosest, then by mean time."""

        def rank(solver: str) -> tuple[float, float, float]:
            tight, n = self.solved_at(formulation, solver, self.tolerances[-1])
            loose, _ = self.solved_at(formulation, solver, self.tolerances[0])
            mean = self.mean_time(formulation, solver, self.tolerances[0])
            return (-tight / max(n, 1), -loose / max(n, 1), mean if math.isfinite(mean) else math.inf)

        return sorted((s for s in self.solvers if self.of(formulation, s, self.tolerances[0])), key=rank)

    def mean_time(self, formulation: str, solver: str, tolerance: float) -> float:
        """The shifted geometric mean of the times of what it solved [s]."""
        return shifted_geometric_mean([r.cpu for r in self.of(formulation, solver, tolerance) if r.reached])


def short(value: float, digits: int = 2) -> str:
    """A number for a table, `-` of NaN and `∞` of infinity."""
    if math.isnan(value):
        return "-"
    return "∞" if math.isinf(value) else f"{value:.{digits}g}"


def middle(values: Iterable[float], digits: int = 3) -> str:
    """The median of what is finite."""
    finite = [value for value in values if math.isfinite(value)]
    return short(median(finite), digits) if finite else "-"


def success(table: Table, formulation: str) -> Lines:
    """A line for each solver: what it reaches, in which time, and where it is feasible."""
    tight, lines = table.tolerances[-1], []
    for solver in table.order(formulation):
        ends = table.answers(formulation, solver)
        rows = table.of(formulation, solver, tight)
        all_ = shifted_geometric_mean([row.time for row in rows])
        lines.append(
            {"solver": solver, "runs": str(len(rows))}
            | {f"{t:g} [%]": percent(*table.solved_at(formulation, solver, t)) for t in table.tolerances}
            | {f"time to {t:g} [s]": short(table.mean_time(formulation, solver, t)) for t in table.tolerances}
            | {"with failures": short(all_), "feasible [%]": percent(sum(r.feasible for r in ends), len(ends))}
        )
    return lines


def effort(table: Table, formulation: str) -> Lines:
    """Median iterations and calls of the runs that reached the loosest tolerance they could, and their times."""
    lines = []
    for solver in table.order(formulation):
        rows = [row for row in table.answers(formulation, solver) if math.isfinite(row.cpu)]
        runs = [table.runs[r.instance, solver, r.tolerance] for r in rows]
        cold, warm = [run[0].cpu for run in runs], [run[-1].cpu for run in runs if len(run) > 1]
        spread = [max(r.cpu for r in run) / min(r.cpu for r in run) for run in runs if len(run) > 1]
        lines.append(
            {"solver": solver, "iterations": middle(r.iterations for r in rows)}
            | {call: middle(getattr(r, call) for r in rows) for call in ("f", "grad", "g", "jac", "hess")}
            | {"build [s]": middle(r.build for r in rows), "setup [s]": middle(r.setup for r in rows)}
            | {"cold [s]": middle(cold), "warm [s]": middle(warm), "slowest over fastest": middle(spread)}
            | {"wall over processor": middle(r.seconds / r.cpu for r in rows if r.cpu > 0)}
        )
    return lines


def optima(table: Table, formulation: str) -> Lines:
    """How far each solver ends above the best that is known, from the same start and of the same object."""
    objects: dict[str, float] = {}
    for (name, form, _), energy in table.best.items():
        if form == formulation:
            objects[name] = min(energy, objects.get(name, math.inf))
    lines = []
    for solver in table.order(formulation):
        ends = table.answers(formulation, solver)
        rows = [r for r in ends if r.primal <= ADMISSIBLE]
        over = [r.energy - table.best[r.instance] for r in rows]
        same = sum(gap <= SAME * max(1.0, abs(r.energy)) for gap, r in zip(over, rows, strict=True))
        lines.append(
            {
                "solver": solver,
                "rows met": f"{len(rows)} of {len(ends)}",
                "best of its start [%]": percent(same, len(ends)),
            }
            | {
                "above it, median": middle(over),
                "above the object's best, median": middle(r.energy - objects[r.object] for r in rows),
            }
        )
    return lines


def pairs(table: Table, formulation: str, most: int = 8) -> Lines:
    """In how many percent of the common instances the solver of the line is faster than that of the column."""
    times, names = table.times(formulation, table.tolerances[-1]), table.order(formulation)[:most]
    if len(names) < 2:
        return []
    lines: Lines = []
    for one in names:
        line = {"faster": one}
        for other in names:
            first, _, n = wins(times, one, other)
            line[other] = "" if one == other else f"{100 * first / n:.0f}" if n else "-"
        lines.append(line)
    return lines


def failures(table: Table) -> Lines:
    """Why runs have no answer, or none within the limit, counted."""
    counts: dict[tuple[str, str, str], int] = defaultdict(int)
    for row in table.rows:
        if row.failure and not row.failure.startswith("not tried"):
            counts[row.solver, row.formulation, row.failure] += 1
    return [
        {"solver": solver, "formulation": formulation, "runs": str(count), "reason": reason}
        for (solver, formulation, reason), count in counts.items()
    ]


def liars(table: Table) -> Lines:
    """Runs that the solver calls a success and that miss the tolerance, or the other way round."""
    lines = []
    for solver in table.solvers:
        rows = [r for r in table.last.values() if r.solver == solver and r.status and not r.failure]
        said = [r for r in rows if claims(r.status)]
        wrong, modest = sum(not r.reached for r in said), sum(r.reached for r in rows if not claims(r.status))
        if wrong or modest:
            line = {"solver": solver, "says success": str(len(said)), "of these missed": str(wrong)}
            lines.append(line | {"reached without saying so": str(modest)})
    return lines


def claims(status: str) -> bool:
    """Whether a solver's word is one of success."""
    words = ("success", "succeeded", "optimal", "converged", "solve_succeeded", "convergence", "satisfied")
    return any(word in status.lower() for word in words) and "not optimal" not in status.lower()
