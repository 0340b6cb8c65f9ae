"""Each solver's first choice carried out in simulation: does the better optimum hold better?"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import nan

from sgnlp.experiments.compare.route import Run
from sgnlp.experiments.compare.runs import chosen
from sgnlp.experiments.compare.table import RUN, Table
from sgnlp.experiments.frames import Frame, Lines, percent, pick
from sgnlp.experiments.studies.study import Case, Key
from sgnlp.experiments.studies.trials import LOADS, NO_PLAN, carried_out
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import load
from sgnlp.planning.plan import Plan
from sgnlp.planning.problem import build_problem


@dataclass(frozen=True)
class Row:
    """The first choice of a solver among its starts for an object, under one load; `start` -1: none is feasible."""

    object: str
    formulation: str
    solver: str
    starts: int
    load: str = ""
    start: int = -1
    margin: float = nan
    ending: str = NO_PLAN
    score: float = 0.0


def cases(table: Table, runs: Mapping[Key, Run]) -> list[Case]:
    """A case for each object, formulation and solver; the first choice is the feasible one with the widest margin.

    For each start the answer to the tightest tolerance counts at which the solver ended by itself.
    """
    groups: dict[tuple[str, str, str], list[Run]] = defaultdict(list)
    for (name, formulation, solver, _), run in runs.items():
        groups[name, formulation, solver].append(run)
    ended = table.last[table.last.failure == ""].sort_values("tolerance").drop_duplicates(RUN)
    ended = ended[ended.feasible].sort_values(["margin", "start"], ascending=[False, True])
    found = []
    for key, tried in groups.items():
        first, again = Row(*key, len(tried)), None
        feasible = pick(ended, object=key[0], formulation=key[1], solver=key[2])
        by_start = {run.start: run for run in tried}
        for best in feasible[feasible.start.isin(list(by_start))].head(1).itertuples():
            again = replace(by_start[best.start], tolerances=(best.tolerance,))
            first = replace(first, start=best.start, margin=best.margin)
        found.append(Case((*key, str(len(tried))), partial(rows_of, again, first)))
    return found


def rows_of(run: Run | None, first: Row) -> list[Row]:
    """The rows of a first choice, one for each load."""
    solution = chosen(run) if run else NO_PLAN
    if run is None or isinstance(solution, str):
        return [replace(first, load=load) for load in LOADS]
    observation, hand = load(run.file), load_hand(run.hand, run.settings.spheres)
    problem = build_problem(observation, hand, run.settings, run.seed)
    plan = Plan(observation, problem, (solution,), (), 1, run.seed, 1, run.limit, {})
    outcomes = {name: carried_out(plan, settings) for name, settings in LOADS.items()}
    return [replace(first, load=name, ending=o.ending, score=o.score) for name, o in outcomes.items()]


def lines(rows: Frame) -> Lines:
    """Success in percent under each load; an object without a first choice counts as failed.

    The best solver comes first in each formulation. Those that have no first choice at all are left out.
    """
    found = []
    for formulation, group in rows.groupby("formulation", sort=False):
        solvers = group.groupby("solver", sort=False)
        for solver in solvers.score.sum().sort_values(ascending=False, kind="stable").index:
            own = solvers.get_group(solver)
            planned, objects = own.object[own.start >= 0].nunique(), own.object.nunique()
            scores = {load: own.score[own.load == load] for load in LOADS}
            line = {"formulation": str(formulation), "solver": str(solver), "planned": f"{planned} of {objects}"}
            if planned:
                found.append(line | {load: percent(score.sum(), len(score)) for load, score in scores.items()})
    return found


def without(rows: Frame) -> dict[str, list[str]]:
    """For each formulation, the solvers without a first choice on any object, which hold none."""
    best = rows.groupby(["formulation", "solver"], sort=False).start.max()
    none = best[best < 0].reset_index()
    return {str(name): list(group.solver) for name, group in none.groupby("formulation", sort=False)}
