"""Each solver's first choice carried out in simulation: does the better optimum hold better?"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from sgnlp.experiments.compare.route import Run
from sgnlp.experiments.compare.runs import chosen
from sgnlp.experiments.compare.table import Table
from sgnlp.experiments.studies.significance import percent
from sgnlp.experiments.studies.study import Case, Key, Lines
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
    load: str
    start: int
    margin: float
    ending: str
    score: float


def cases(table: Table, runs: Mapping[Key, Run]) -> list[Case]:
    """A case for each object, formulation and solver; the first choice is the feasible one of the widest margin.

    Of each start the answer to the tightest tolerance counts at which the solver ended by itself.
    """
    groups: dict[Key, list[Run]] = defaultdict(list)
    for (name, formulation, solver, _), run in runs.items():
        groups[name, formulation, solver].append(run)
    found = []
    for (name, formulation, solver), tried in groups.items():
        ends = [table.unaided((name, formulation, run.start), solver) for run in tried]
        feasible = [(row.margin, run, row) for run, row in zip(tried, ends, strict=True) if row and row.feasible]
        best = max(feasible, key=lambda item: (item[0], -item[1].start), default=None)
        first = Row(name, formulation, solver, len(tried), "", -1, float("nan"), NO_PLAN, 0.0)
        again = replace(best[1], tolerances=(best[2].tolerance,)) if best else None
        if best:
            first = replace(first, start=best[1].start, margin=best[0])
        found.append(Case((name, formulation, solver, str(len(tried))), partial(rows_of, again, first)))
    return found


def rows_of(run: Run | None, first: Row) -> list[Row]:
    """The rows of a first choice, one for each load."""
    solution = chosen(run) if run else NO_PLAN
    if run is None or isinstance(solution, str):
        return [replace(first, load=load) for load in LOADS]
    observation, hand = load(run.file), load_hand(run.hand, run.settings.spheres)
    problem = build_problem(observation, hand, run.settings, run.seed)
    plan = Plan(observation, problem, (solution,), (), run.seed, 1, run.limit, {})
    found = []
    for name, settings in LOADS.items():
        outcome = carried_out(plan, settings)
        found.append(replace(first, load=name, ending=outcome.ending, score=outcome.score))
    return found


def lines(rows: Sequence[Row]) -> Lines:
    """Success in percent under each load, objects without a first choice failed, for solvers that have one at all.

    The best first in each formulation.
    """
    groups = _groups(rows)
    formulations = list(dict.fromkeys(formulation for formulation, _ in groups))
    order = sorted(groups, key=lambda key: (formulations.index(key[0]), -sum(row.score for row in groups[key])))
    return [_line(*key, groups[key]) for key in order if _planned(groups[key])]


def without(rows: Sequence[Row]) -> dict[str, list[str]]:
    """For each formulation the solvers that have no first choice on any object, and so hold none."""
    found: dict[str, list[str]] = defaultdict(list)
    for (formulation, solver), group in _groups(rows).items():
        if not _planned(group):
            found[formulation].append(solver)
    return dict(found)


def _groups(rows: Iterable[Row]) -> dict[tuple[str, str], list[Row]]:
    """The rows of each formulation and solver."""
    groups: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row.formulation, row.solver].append(row)
    return groups


def _planned(rows: Sequence[Row]) -> set[str]:
    return {row.object for row in rows if row.start >= 0}


def _line(formulation: str, solver: str, rows: Sequence[Row]) -> dict[str, str]:
    shares = {}
    for name in LOADS:
        scores = [row.score for row in rows if row.load == name]
        shares[name] = percent(sum(scores), len(scores))
    objects = len({row.object for row in rows})
    return {"formulation": formulation, "solver": solver, "planned": f"{len(_planned(rows))} of {objects}"} | shares
