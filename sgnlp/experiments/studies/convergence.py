"""The convergence study: does every start solve, is it feasible, and is its energy below that of AdamW?

Each object is seen from one, two and three cameras. For each start there is the plan in the formulation of the
settings, and in the penalty formulation Ipopt's smoothed energy against the lowest that a first-order optimiser met.
"""

from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path

import numpy as np

from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Lines, curves
from sgnlp.experiments.studies.study import Setup, Study, over_views
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
from sgnlp.show.plots import Panel

OPTIMISER, STEPS = "adamw", 1000  # the first-order opponent, and five times the steps that the release gives it


@dataclass(frozen=True)
class Row:
    """One start of one case. Energies are the smoothed ones of the penalty formulation, weighted.

    `first_order_energy` is the lowest where the rows are met, infinite if they never are; `first_order_anywhere` is the
    lowest at any point.
    """

    object: str
    view_names: str
    start: int
    solved: bool = False
    feasible: bool = False
    worst_margin: float = nan
    kkt: float = nan
    iterations: int = 0
    seconds: float = nan
    status: str = ""
    penalty_energy: float = nan
    penalty_solved: bool = False
    penalty_iterations: int = 0
    first_order_energy: float = nan
    first_order_anywhere: float = nan
    failure: str = ""


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
    observation: Observation, hand: Hand, settings: Settings, *, count: int, seed: int, timeout: float
) -> list[Row]:
    """The rows of one observation, in the order of the starts; a failed start is a row that says why."""
    problem = build_problem(observation, hand, settings, seed)
    found = map_starts(compare, problem, starts(problem, count, seed), 1, timeout)
    rows = [Row("", "", row.start, failure=row.reason) if isinstance(row, Failure) else row for row in found]
    views = " ".join(observation.view_names)
    named = (replace(row, object=observation.name, view_names=views) for row in rows)
    return sorted(named, key=lambda row: row.start)


def rows_of(setup: Setup, file: Path, views: list[str]) -> list[Row]:
    """The rows of an object as some cameras see it."""
    hand, seen = load_hand(setup.hand, setup.settings.spheres), load(file, views=views)
    return case(seen, hand, setup.settings, count=setup.starts, seed=setup.seed, timeout=setup.timeout)


def judged(rows: Frame) -> Frame:
    """The rows with two more columns: whether AdamW satisfies the constraint rows, and whether Ipopt ends below it."""
    met = np.isfinite(rows.first_order_energy)
    below = met & (rows.penalty_energy < rows.first_order_energy)
    return rows.assign(met=met, below=below, below_anywhere=rows.penalty_energy < rows.first_order_anywhere)


def table(rows: Frame) -> Lines:
    """One line for each case, and a last one over all."""
    rows = judged(rows)
    cases = rows.groupby(["object", "view_names"], sort=False)
    return [*(_line(str(name), str(views), case) for (name, views), case in cases), _line("all", "", rows)]


def _line(name: str, views: str, rows: Frame) -> dict[str, str]:
    ended = rows[rows.failure == ""]
    return {
        "object": name,
        "views": views,
        "starts": str(len(rows)),
        "solved": str(rows.solved.sum()),
        "feasible": str(rows.feasible.sum()),
        "median iterations": f"{ended.iterations.median():g}" if len(ended) else "-",
        "median time [s]": f"{ended.seconds.median():.2f}" if len(ended) else "-",
        "penalty solved": str(rows.penalty_solved.sum()),
        "AdamW meets the rows": str(rows.met.sum()),
        "below AdamW there": str(rows.below.sum()),
        "below AdamW anywhere": str(rows.below_anywhere.sum()),
    }


def panels(rows: Frame) -> list[Panel]:
    """The shares of starts that are feasible and that end below AdamW, by the number of cameras."""
    rows = judged(rows)
    shares = {
        "feasible": rows.feasible,
        "below AdamW where it meets the rows": rows.below.astype(float).where(rows.met),
        "below AdamW anywhere": rows.below_anywhere,
    }
    means = 100 * rows.assign(**shares)[[*shares]].groupby(rows.view_names.str.split().str.len()).mean()
    return [Panel("Starts", "cameras", "share [%]", curves(means), bars=True)]


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
