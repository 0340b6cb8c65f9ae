"""Going on with a plan that ended early."""

import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from math import inf

from sgnlp.base.errors import InputError
from sgnlp.planning import arguments
from sgnlp.planning.ending import ENOUGH, LEFT, hopeful
from sgnlp.planning.faraway import moved_cloud, moved_problem, origin
from sgnlp.planning.plan import Plan
from sgnlp.planning.pool import Failure
from sgnlp.planning.reach import OUT_OF_REACH
from sgnlp.planning.rounds import Searched, with_wide_limits
from sgnlp.planning.search import Found, Result, Search


def improve(plan: Plan, count: int = 0) -> Iterator[Plan]:
    """Go on with the starts that a plan left out, yielding a better plan whenever one of them ends.

    Leaving the iteration ends the processes. The last plan is the one that `solve` gives without `first` and
    `deadline`. A plan with wide limits of motion goes on with these. Far from the origin rounding may lead some starts
    elsewhere, since `solve` moves the cloud there and back.

    Args:
        plan: of `sgnlp.solve`, that ended with its `first` grasps or at its `deadline`.
        count: number of starts in all, if it is more than the plan has tried.

    Raises:
        InputError: `plan` is no plan, or `count` is negative or too large.
    """
    arguments.check({"plan": plan, "count": count}, {"plan": arguments.PLAN, "count": arguments.WHOLE})
    if count < 0:
        raise InputError(f"count {count} must not be negative")
    begin, now, count = time.perf_counter() - plan.seconds["solve"], plan, max(count, plan.count)
    arguments.check_search(count, plan.jobs, plan.timeout, plan.seed)
    search = _search(plan, max(count, plan.tried))
    for found, waits in _going_on(search, plan, count):
        now = _with(plan, (plan.problem, *found[1:]), begin, count)
        now = now if waits else replace(now, ending=plan.ending.whole)
        yield now
    if not now.vain:
        narrow = Searched(replace(search, count=now.tried), [*now.solutions, *now.failures])
        wide = with_wide_limits(narrow, count, plan.ending.whole, inf, lambda result: None)
        if wide.wide:
            better = _with(plan, wide.search.found(wide.results), begin, count)
            yield replace(better, ending=plan.ending.whole, widened=True, vain=wide.vain)


def _search(plan: Plan, count: int) -> Search:
    """The search for a plan, near the origin."""
    middle = origin(plan.observation)
    far = bool(middle.any())
    problem = moved_problem(plan.problem, -middle) if far else plan.problem
    cloud = moved_cloud(plan.observation, -middle) if far else plan.observation
    return Search(problem, cloud, middle, plan.solver, count, plan.seed, plan.jobs, plan.timeout)


def _going_on(search: Search, plan: Plan, count: int) -> Iterator[tuple[Found, bool]]:
    """What is found whenever a start ends, and whether others wait."""
    known: list[Result] = [*plan.solutions]
    known += [f for f in plan.failures if f.reason not in (*LEFT, OUT_OF_REACH)]
    reasons = {f.start: f.reason for f in plan.failures if f.reason in LEFT}
    results: list[Result] = []
    for total in [search.count, *(more for more in plan.ending.totals(count) if more > search.count)]:
        search = replace(search, count=total)
        done = {result.start for result in (*known, *results)}
        left = {index: reasons.get(index, ENOUGH) for index in search.order if index not in done}
        with closing(search.results(done)) as ended:
            for result in ended:
                results.append(result)
                del left[result.start]
                waiting = [Failure(index, reason) for index, reason in left.items()]
                yield search.found(results, [*known, *waiting]), bool(left)
        if not hopeful((*known, *results)):
            return


def _with(plan: Plan, found: Found, begin: float, count: int) -> Plan:
    """The plan with what was found since `begin` [s]."""
    problem, solutions, failures = found
    seconds = plan.seconds | {"solve": time.perf_counter() - begin}
    now = replace(plan, problem=problem, solutions=solutions, failures=failures)
    return replace(now, seconds=seconds, count=count)
