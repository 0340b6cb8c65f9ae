"""Starts in rounds, then again with wider limits of the object's motion, until a grasp is feasible.

Little motion makes a plan happen as planned. But a finger with few joints presses only along some directions, so the
object moves more before the forces balance. Wider limits change only bounds of the program, not its functions.
"""

import time
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import replace

from sgnlp.planning.ending import Ending, hopeful
from sgnlp.planning.problem import Problem, with_limits
from sgnlp.planning.search import Result, Search
from sgnlp.planning.solution import Solution
from sgnlp.program.equilibrium import GRAVITY

Progress = Callable[[Result], None]
Ended = tuple[Search, list[Result]]
"""The search with the starts of all its rounds, and the result of each."""


def in_rounds(search: Search, ending: Ending, until: float, progress: Progress) -> Ended:
    """All rounds that were needed. Those with wide limits of motion count only if they give a feasible grasp."""
    narrow = _rounds(search, ending, until, progress)
    problem = widened(search.problem, narrow[1]) if time.perf_counter() < until else None
    if problem is not None:
        left = left_over(ending, narrow[0].count, search.count)
        wide = _rounds(replace(search, problem=problem), left, until, progress)
        if _feasible(wide[1]):
            return wide
    return narrow


def widened(problem: Problem, results: Iterable[Result]) -> Problem | None:
    """The problem with the wide limits of motion; None if they are no wider, or are not needed, or no start ended."""
    settings, solutions = problem.settings, [result for result in results if isinstance(result, Solution)]
    limits, weight = settings.limits, settings.contact.mass * GRAVITY
    wider = settings.contact.metric == "spring" and limits.motion(weight) != limits.motion(weight, wide=True)
    if not wider or not solutions or _feasible(solutions):
        return None
    return with_limits(problem, replace(limits, widened=True))


def left_over(ending: Ending, tried: int, count: int) -> Ending:
    """An ending after one round with wide limits, and as many more as `tried` starts of the narrow ones left over."""
    return replace(ending, rounds=ending.rounds + 1 - tried // count)


def _rounds(search: Search, ending: Ending, until: float, progress: Progress) -> Ended:
    results: list[Result] = []
    for total in ending.totals(search.count):
        search = replace(search, count=total)
        with closing(search.results({result.start for result in results}, until)) as ended:
            for result in ended:
                progress(result)
                results.append(result)
                if kept := ending.kept(results, search.order):
                    return search, kept
        if not hopeful(results) or time.perf_counter() >= until:
            break
    return search, results


def _feasible(results: Iterable[Result]) -> bool:
    return any(isinstance(result, Solution) and result.feasible for result in results)
