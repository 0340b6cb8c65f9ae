"""The convergence study: does every start solve, is it feasible, and is its energy below that of AdamW?

For each object seen from one, two and three cameras, and each start: the plan in the formulation of the settings,
and in the penalty formulation Ipopt's smoothed energy against the lowest on the way of a first-order optimiser.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite, nan
from pathlib import Path
from statistics import median
from typing import Any, get_type_hints

from sgnlp.base.settings import Settings
from sgnlp.experiments.studies.study import Lines, Setup, Study, over_views
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation, load
from sgnlp.planning.kkt import SOLVED_FACTOR
from sgnlp.planning.planner import Planner
from sgnlp.planning.pool import Failure, map_starts, solve_start
from sgnlp.planning.problem import build_problem
from sgnlp.planning.solvers.first_order import descent
from sgnlp.planning.starts import Start, starts
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.nlp import ENERGY_UNIT
from sgnlp.show.plots import Panel, Series

OPTIMISER, STEPS = "adamw", 1000
"""The first-order opponent, and five times the steps that the release gives it."""


@dataclass(frozen=True)
class Row:
    """One start of one case. Energies are the smoothed ones of the penalty formulation, weighted."""

    object: str
    view_names: str
    start: int
    solved: bool
    feasible: bool
    worst_margin: float
    kkt: float
    iterations: int
    seconds: float
    status: str
    penalty_energy: float
    penalty_solved: bool
    penalty_iterations: int
    first_order_energy: float
    first_order_anywhere: float
    failure: str = ""

    @property
    def comparable(self) -> bool:
        """Whether the first-order optimiser came to a point that meets the rows."""
        return isfinite(self.first_order_energy)

    @property
    def lower(self) -> bool:
        """Whether Ipopt's penalty energy is below the first-order one, both taken where the rows are met."""
        return self.comparable and self.penalty_energy < self.first_order_energy

    @property
    def lower_than_anywhere(self) -> bool:
        """The same against the lowest first-order energy at any point, rows met or not."""
        return self.penalty_energy < self.first_order_anywhere


def compare(planner: Planner, start: Start) -> Row:
    """The row of one start."""
    problem = planner.problem
    solution = solve_start(planner, start)
    opponents = Planner(replace(problem, formulation=Penalty()))
    penalty = opponents.solve(start)
    first_order = descent(*opponents.begin(opponents.stages[-1], start), OPTIMISER, STEPS)
    return Row(
        object="",
        view_names="",
        start=start.index,
        solved=solution.solved(problem.settings.solver.tolerance),
        feasible=solution.feasible,
        worst_margin=solution.worst_margin,
        kkt=solution.kkt.worst,
        iterations=solution.iterations,
        seconds=solution.seconds,
        status=solution.status,
        penalty_energy=ENERGY_UNIT * penalty.objective,
        penalty_solved=penalty.kkt.worst <= SOLVED_FACTOR * opponents.tolerance,
        penalty_iterations=penalty.iterations,
        first_order_energy=ENERGY_UNIT * first_order.admissible,
        first_order_anywhere=ENERGY_UNIT * first_order.best,
    )


def case(
    observation: Observation,
    hand: Hand,
    settings: Settings,
    *,
    count: int,
    seed: int,
    timeout: float,
) -> list[Row]:
    """The rows of one observation, in the order of the starts; a failed start is a row that says why."""
    problem = build_problem(observation, hand, settings, seed)
    names = " ".join(observation.view_names)
    rows = []
    for result in map_starts(compare, problem, starts(problem, count, seed), 1, timeout):
        row = _failed(result) if isinstance(result, Failure) else result
        rows.append(replace(row, object=observation.name, view_names=names))
    return sorted(rows, key=lambda row: row.start)


def rows_of(setup: Setup, file: Path, views: list[str]) -> list[Row]:
    """The rows of an object as some cameras see it."""
    hand = load_hand(setup.hand, setup.settings.spheres)
    options = {"count": setup.starts, "seed": setup.seed, "timeout": setup.timeout}
    return case(load(file, views=views), hand, setup.settings, **options)  # type: ignore[arg-type]


def _failed(failure: Failure) -> Row:
    empty: dict[str, Any] = {"str": "", "int": 0, "float": float("nan"), "bool": False}
    values = {name: empty[kind.__name__] for name, kind in get_type_hints(Row).items()}
    return Row(**values | {"start": failure.start, "failure": failure.reason})


def table(rows: Sequence[Row]) -> Lines:
    """One line a case and a last one over all."""
    cases = dict.fromkeys((row.object, row.view_names) for row in rows)
    lines = [
        _line(name, views, [r for r in rows if (r.object, r.view_names) == (name, views)]) for name, views in cases
    ]
    return [*lines, _line("all", "", list(rows))]


def _line(name: str, views: str, rows: list[Row]) -> dict[str, str]:
    ended = [row for row in rows if not row.failure]
    numbers = {
        "starts": len(rows),
        "solved": sum(row.solved for row in rows),
        "feasible": sum(row.feasible for row in rows),
        "median iterations": median(row.iterations for row in ended) if ended else "-",
        "median time [s]": f"{median(row.seconds for row in ended):.2f}" if ended else "-",
        "penalty solved": sum(row.penalty_solved for row in rows),
        "AdamW meets the rows": sum(row.comparable for row in rows),
        "below AdamW there": sum(row.lower for row in rows),
        "below AdamW anywhere": sum(row.lower_than_anywhere for row in rows),
    }
    return {"object": name, "views": views} | {key: str(value) for key, value in numbers.items()}


def panels(rows: Sequence[Row]) -> list[Panel]:
    """Starts that solve, are feasible and end below AdamW, by the number of cameras."""
    counts = sorted({len(row.view_names.split()) for row in rows})
    groups = [[row for row in rows if len(row.view_names.split()) == count] for count in counts]
    shares = {
        "feasible": [_share([row.feasible for row in group]) for group in groups],
        "below AdamW where it meets the rows": [_share([r.lower for r in group if r.comparable]) for group in groups],
        "below AdamW anywhere": [_share([row.lower_than_anywhere for row in group]) for group in groups],
    }
    series = tuple(Series(label, counts, values) for label, values in shares.items())
    return [Panel("Starts", "cameras", "share [%]", series, bars=True)]


def _share(held: Sequence[bool]) -> float:
    """In percent, NaN of none."""
    return 100 * sum(held) / len(held) if held else nan


STUDY = Study(
    question="does every start solve, is it feasible, and is its energy below that of 1000 AdamW steps?",
    row=Row,
    cases=partial(over_views, rows_of),
    tables=lambda rows: {"Starts": table(rows)},
    panels=panels,
    caption=(
        "Share of the starts that end feasible, and of those whose penalty energy is below that of 1000 AdamW steps: "
        "where those meet the rows, and at any of their points, by the number of cameras."
    ),
)
