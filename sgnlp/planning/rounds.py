"""Starts in rounds, then again with wider limits of the object's motion, until a grasp is feasible."""

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace

from sgnlp.planning.ending import Ending, any_feasible, hopeful
from sgnlp.planning.search import Result, Search
from sgnlp.planning.widening import widened

Progress = Callable[[Result], None]


@dataclass(frozen=True, eq=False)
class Searched:
    """A search with the starts of all its rounds, and the result of each.

    `vain` starts were solved with other limits of motion and count no more: with the narrow ones if the plan is `wide`,
    else with the wide ones.
    """

    search: Search
    results: list[Result]
    wide: bool = False
    vain: int = 0


def in_rounds(search: Search, ending: Ending, until: float, progress: Progress) -> Searched:
    """All rounds that were needed. Those with wide limits of motion count only if they give a feasible grasp."""
    ended = _rounds(search, ending, until, progress)
    return ended if time.perf_counter() >= until else with_wide_limits(ended, search.count, ending, until, progress)


def with_wide_limits(ended: Searched, count: int, ending: Ending, until: float, progress: Progress) -> Searched:
    """The same, or one round of `count` starts with wide limits, and as many more as the narrow ones left over."""
    problem = widened(ended.search.problem, ended.results) if ending.widen else None
    if problem is None:
        return ended
    left = replace(ending, rounds=ending.rounds + 1 - ended.search.count // count)
    wide = _rounds(replace(ended.search, problem=problem, count=count), left, until, progress)
    if any_feasible(wide.results):
        return replace(wide, wide=True, vain=len(ended.results))
    whole = time.perf_counter() < until
    return replace(ended, vain=len(wide.results) if whole else 0)


def _rounds(search: Search, ending: Ending, until: float, progress: Progress) -> Searched:
    results: list[Result] = []
    for total in ending.totals(search.count):
        search = replace(search, count=total)
        with closing(search.results({result.start for result in results}, until)) as ended:
            for result in ended:
                progress(result)
                results.append(result)
                if kept := ending.kept(results, search.order):
                    return Searched(search, kept)
        if not hopeful(results) or time.perf_counter() >= until:
            break
    return Searched(search, results)
