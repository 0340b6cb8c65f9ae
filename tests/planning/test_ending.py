"""Searches that end with enough grasps or at a deadline, and that go on afterwards."""

import time
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from processes import hang, wait_for
from scenes import SMALL, hand, observation, posed

from sgnlp.base.errors import InputError, SolverError
from sgnlp.base.settings import Solver
from sgnlp.planning.ending import ENOUGH, NEAR, Ending
from sgnlp.planning.faraway import moved_cloud
from sgnlp.planning.improve import improve
from sgnlp.planning.plan import Plan
from sgnlp.planning.planner import Planner
from sgnlp.planning.pool import TOO_LATE, Failure, map_starts, solve_start
from sgnlp.planning.replan import replan
from sgnlp.planning.solution import Solution
from sgnlp.planning.solve import solve
from sgnlp.planning.starts import Start, starts
from sgnlp.planning.violations import Violation

STARTS = 3
FOREVER = 1e8
"""Three years [s]: longer than any machine here has run."""
FAR = np.array([120.0, -45.0, 30.0])


@pytest.fixture(scope="module")
def whole() -> Plan:
    return solve(observation(), hand(), SMALL, count=STARTS, jobs=2)


class Ended(Solution):
    """A solution of which only its start and whether it is feasible are known."""

    def __init__(self, start: int, feasible: bool):
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "told", feasible)

    feasible = property(lambda self: self.told)  # type: ignore[assignment]


def same(one: Plan, other: Plan) -> bool:
    """Whether two plans have the same solutions in the same order, bit for bit."""
    pairs = zip(one.solutions, other.solutions, strict=True)
    return all(a.start == b.start and np.array_equal(a.wrist, b.wrist) and a.energy == b.energy for a, b in pairs)


@given(st.permutations(range(6)), st.lists(st.booleans(), min_size=6, max_size=6), st.integers(1, 6))
def test_what_is_kept_is_the_shortest_beginning_with_enough_grasps_in_whatever_order_starts_end(order, fine, first):
    results, kept = [], None
    for start in order:
        results.append(Ended(start, fine[start]))
        kept = kept or Ending(first).kept(results, range(6))
    expected = next((k for k in range(1, 7) if sum(fine[:k]) == first), None)
    if expected is None:
        assert kept is None
    else:
        assert [r.start for r in kept] == list(range(6))
        assert all(isinstance(r, Ended) for r in kept[:expected])
        assert kept[expected:] == [Failure(i, ENOUGH) for i in range(expected, 6)]


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_plan_that_ends_with_its_first_grasp_has_the_same_of_the_whole_plan(whole, jobs):
    plan = solve(observation(), hand(), SMALL, count=STARTS, jobs=jobs, first=1)
    first = next(s for s in sorted(whole.solutions, key=lambda s: s.start) if s.feasible)
    assert same(plan, replace(whole, solutions=(first,)))
    assert plan.failures == tuple(Failure(i, ENOUGH) for i in range(1, STARTS))
    assert plan.meta()["first"] == 1
    assert plan.meta()["left"] == STARTS - 1
    assert not [said for said in plan.summary()["cautions"] if "starts" in said]  # those left out have not failed
    assert plan.meta()["starts"] == STARTS


def test_an_ended_search_goes_on_to_the_whole_plan(whole):
    plan = solve(observation(), hand(), SMALL, count=STARTS, jobs=1, first=1)
    plans = list(improve(plan))
    assert [len(p.solutions) for p in plans] == list(range(2, STARTS + 1))
    assert [len(p.solutions) + len(p.failures) for p in plans] == [STARTS] * (STARTS - 1)
    assert [p.ending for p in plans] == [Ending(1)] * (STARTS - 2) + [Ending()]
    assert same(plans[-1], whole)
    assert not list(improve(whole))


def test_a_search_can_have_more_starts_than_it_began_with(whole):
    plan = solve(observation(), hand(), SMALL, count=STARTS - 1, jobs=1)
    *_, more = improve(plan, STARTS)
    assert same(more, whole)


def test_a_search_goes_on_far_from_the_origin():
    far = moved_cloud(observation(), FAR)
    plan = solve(far, hand(), SMALL, count=2, jobs=1)
    *_, improved = improve(solve(far, hand(), SMALL, count=2, jobs=1, first=1))
    assert improved.best.start == plan.best.start
    np.testing.assert_allclose(improved.best.wrist, plan.best.wrist, atol=1e-6)  # moved twice, it is rounded twice


def test_a_start_that_hangs_ends_at_the_deadline(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", hang)
    plan = solve(observation(), hand(), SMALL, count=STARTS, jobs=2, deadline=1.0)
    assert plan.failures == tuple(Failure(i, TOO_LATE) for i in range(STARTS))
    assert plan.meta()["left"] == plan.left == STARTS
    assert plan.best is None


def answer_first(planner: object, start: Start) -> int:
    """A task that answers, but hangs for every start but the first."""
    if start.index:
        Path("hanging").touch()
        time.sleep(1000)
    return start.index


@pytest.mark.parametrize("fault", ["", "no semaphores"])
def test_what_ended_before_the_deadline_is_kept(monkeypatch, tmp_path, fault):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sgnlp.planning.pool.semaphores.fault", lambda: fault)
    monkeypatch.setattr("sgnlp.planning.pool.Planner", lambda *given: None)
    lefts = iter([inf, 0.1, 0.0])

    def left(until: float) -> float:
        """The deadline comes when the second start hangs, however long that takes."""
        assert until == 1.0
        return next(lefts) if fault else 1.0 * wait_for(Path("hanging").exists)

    monkeypatch.setattr("sgnlp.planning.pool._left", left)
    problem = posed(replace(SMALL, solver=Solver(formulation="penalty")))
    found = map_starts(answer_first, problem, starts(problem, STARTS, 0), 1, None, None, 1.0)
    assert list(found) == [0, Failure(1, TOO_LATE), Failure(2, TOO_LATE)]


def fail(planner: Planner, start: Start) -> Solution:
    raise SolverError("it refuses the program")


@dataclass(frozen=True)
class Failing:
    """Solves a start; those before the given one end infeasible."""

    until: int

    def __call__(self, planner: Planner, start: Start) -> Solution:
        found = solve_start(planner, start)
        return found if start.index >= self.until else replace(found, checks=(replace(found.checks[0], passed=False),))


@pytest.mark.parametrize("jobs", [1, 2])
def test_where_a_round_gives_no_feasible_grasp_the_next_one_follows(whole, monkeypatch, jobs):
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", Failing(2))
    tried = []
    plan = solve(observation(), hand(), SMALL, count=1, jobs=jobs, rounds=STARTS + 2, progress=tried.append)
    assert [s.feasible for s in plan.solutions] == [True, False, False]
    assert [result.start for result in tried] == [0, 1, 2]
    third = next(s for s in whole.solutions if s.start == 2)
    assert same(replace(plan, solutions=plan.solutions[:1]), replace(whole, solutions=(third,)))
    assert (plan.meta()["starts"], plan.meta()["tried"], plan.meta()["rounds"]) == (1, 3, STARTS + 2)


@pytest.mark.parametrize(("rounds", "tried"), [(1, 2), (2, 4)])
def test_no_more_rounds_are_tried_than_asked_for(monkeypatch, rounds, tried):
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", Failing(100))
    plan = solve(observation(), hand(), SMALL, count=2, jobs=2, rounds=rounds)
    assert plan.best is None
    assert sorted(s.start for s in plan.solutions) == list(range(tried))


def test_a_search_that_goes_on_has_the_rounds_of_the_whole_plan(whole, monkeypatch):
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", Failing(2))
    plan = solve(observation(), hand(), SMALL, count=1, jobs=1, rounds=1)
    *_, more = improve(replace(plan, ending=Ending(rounds=5)))
    assert (more.tried, more.count, more.best.start) == (3, 1, 2)
    assert not list(improve(more))


def test_no_round_follows_one_of_which_every_start_failed(monkeypatch):
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", fail)
    plan = solve(observation(), hand(), SMALL, count=2, jobs=1)
    assert [failure.start for failure in plan.failures] == [0, 1]
    assert not plan.solutions


@dataclass(frozen=True)
class Off:
    """Solves a start, which ends infeasible; its worst row is violated by this, in the row's scale."""

    size: float

    def __call__(self, planner: Planner, start: Start) -> Solution:
        violated = Violation("contact[index]", 10 * self.size, 0.0, "mm", self.size)
        return replace(Failing(100)(planner, start), violations=(violated,))


@pytest.mark.parametrize(("size", "tried"), [(0.9 * NEAR, 3), (1.1 * NEAR, 1)])
def test_a_round_follows_only_where_a_start_comes_near(monkeypatch, size, tried):
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", Off(size))
    plan = solve(observation(), hand(), SMALL, count=1, jobs=1, rounds=3)
    assert (plan.tried, len(plan.solutions)) == (tried, tried)


def test_no_round_begins_after_the_deadline(monkeypatch):
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", Failing(100))
    late = SimpleNamespace(perf_counter=lambda: 2 * FOREVER)  # when the first round has ended
    monkeypatch.setattr("sgnlp.planning.solve.time", SimpleNamespace(perf_counter=lambda: 0.0))
    monkeypatch.setattr("sgnlp.planning.rounds.time", late)
    plan = solve(observation(), hand(), SMALL, count=1, jobs=1, deadline=FOREVER, rounds=3)
    assert [s.start for s in plan.solutions] == [0]
    assert plan.failures == ()


BAD = [(0, None, "first"), (None, 0.0, "deadline"), (None, -1.0, "deadline")]


@pytest.mark.parametrize(("first", "deadline", "named"), BAD)
def test_an_end_that_comes_before_the_beginning_is_refused(first, deadline, named):
    with pytest.raises(InputError, match=f"{named} must be positive"):
        solve(observation(), hand(), SMALL, first=first, deadline=deadline)


def test_a_search_without_a_round_is_refused():
    with pytest.raises(InputError, match="rounds must be positive"):
        solve(observation(), hand(), SMALL, rounds=0)


def test_going_on_with_what_is_no_plan_is_refused_by_name(whole):
    for wrong, said in ((None, "plan is of type NoneType; sgnlp.solve"), (whole.best, "plan is of type Solution")):
        with pytest.raises(InputError, match=said):
            list(improve(wrong))
        with pytest.raises(InputError, match=said):
            replan(wrong)
    with pytest.raises(InputError, match="count is of type str"):
        list(improve(whole, "3"))  # type: ignore[arg-type]
