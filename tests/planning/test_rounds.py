"""Wider limits of the object's motion, where no start is feasible with the narrow ones."""

from dataclasses import replace

import numpy as np
import pytest
from here import Here
from scenes import SMALL, hand, observation

from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Limits, Settings
from sgnlp.planning.batch import Task, batch
from sgnlp.planning.ending import Ending
from sgnlp.planning.improve import improve
from sgnlp.planning.plan import Plan
from sgnlp.planning.problem import with_limits
from sgnlp.planning.rounds import widened
from sgnlp.planning.solve import solve

STILL = 1e-3
"""Springs of 400 N/m sag by more than this [m] under the object's weight."""


def moving(shift: float, wide: float, widened: bool = False) -> Settings:
    limits = replace(SMALL.limits, shift=shift, wide_shift=wide, widened=widened)
    return replace(SMALL, contact=replace(SMALL.contact, mass=0.3), limits=limits)


def planned(settings: Settings, **options: object) -> Plan:
    return solve(observation(), hand(), settings, count=1, jobs=1, rounds=1, **options)  # type: ignore[arg-type]


def way(plan: Plan) -> float:
    g = plan.solutions[0].grasp
    return float(np.linalg.norm(g.contacts_eq - g.contacts, axis=1).max())


@pytest.fixture(scope="module")
def wide() -> Plan:
    return planned(moving(STILL, 0.01))


def test_a_plan_without_a_feasible_start_is_made_again_with_wide_limits(wide):
    asked = planned(moving(STILL, 0.01, widened=True))
    assert wide.best is not None
    assert wide.problem.settings == asked.problem.settings
    np.testing.assert_array_equal(wide.best.joints, asked.best.joints)  # type: ignore[union-attr]
    assert STILL < way(wide) <= 0.01
    assert next(check for check in wide.best.checks if check.name == "shift").upper == 10  # mm


def test_a_plan_with_a_feasible_start_keeps_the_narrow_limits():
    plan = planned(moving(0.01, 0.02))
    assert plan.best is not None
    assert not plan.problem.settings.limits.widened
    assert way(plan) <= 0.01


def test_where_wide_limits_give_no_grasp_either_the_narrow_ones_stay():
    tried = []
    plan = planned(moving(STILL, 1.2 * STILL), progress=tried.append)
    assert (len(tried), plan.best, plan.tried) == (2, None, 1)
    assert not plan.problem.settings.limits.widened
    assert "sag" in plan.solutions[0].violated


def test_the_wide_limits_have_one_round_and_those_that_the_narrow_ones_left_over(monkeypatch):
    monkeypatch.setattr("sgnlp.planning.ending.NEAR", np.inf)  # every round is followed by another
    tried = []
    plan = solve(observation(), hand(), moving(STILL, 1.2 * STILL), count=1, jobs=1, rounds=2, progress=tried.append)
    assert (len(tried), plan.tried, plan.best) == (3, 2, None)
    monkeypatch.setattr("sgnlp.planning.ending.NEAR", 0.0)  # no round is
    tried.clear()
    solve(observation(), hand(), moving(STILL, 1.2 * STILL), count=1, jobs=1, rounds=2, progress=tried.append)
    assert len(tried) == 2


def test_nothing_is_tried_again_with_limits_that_are_no_wider_or_without_an_equilibrium(wide):
    narrow = with_limits(wide.problem, moving(STILL, 0.0).limits)
    assert widened(narrow, [replace(wide.solutions[0], checks=(failed(wide),))]) is None
    assert widened(with_limits(wide.problem, moving(STILL, 0.01).limits), wide.failures) is None
    closure = replace(narrow.settings, contact=replace(SMALL.contact, metric="closure"), limits=ROBUST.limits)
    assert widened(replace(narrow, settings=closure), [replace(wide.solutions[0], checks=(failed(wide),))]) is None


def failed(plan: Plan) -> object:
    return replace(plan.solutions[0].checks[0], passed=False)


def test_a_search_that_goes_on_ends_with_the_wide_limits_too(wide):
    narrow = planned(moving(STILL, 0.0))
    problem = with_limits(narrow.problem, moving(STILL, 0.01).limits)
    *_, last = improve(replace(narrow, problem=problem, ending=Ending(rounds=1)))
    assert last.problem.settings == wide.problem.settings
    np.testing.assert_array_equal(last.best.joints, wide.best.joints)  # type: ignore[union-attr]


def test_a_caution_says_how_far_the_object_may_move_and_how_far_it_may_not(wide):
    said = [caution for caution in wide.summary()["cautions"] if "while it is grasped" in caution]
    assert len(said) == 1
    assert "move by 10 mm" in said[0]
    assert "1 mm no start was feasible" in said[0]
    assert not any("while it is grasped" in caution for caution in planned(moving(0.01, 0.02)).summary()["cautions"])


def test_a_batch_knows_a_result_with_wide_limits_as_its_own(wide, tmp_path):
    np.savez(tmp_path / "one.npz", points=observation().points)
    task = Task(settings=moving(STILL, 0.01), count=1, ending=Ending(rounds=1), root=tmp_path)

    def rows(task: Task) -> list[bool]:
        return [row.reused for row in batch([tmp_path / "one.npz"], task, tmp_path / "results", Here())]

    assert rows(task) == [False]
    assert rows(task) == [True]
    assert rows(replace(task, settings=moving(STILL, 0.02))) == [False]


def test_wide_limits_are_never_narrower():
    limits = Limits(rotation_deg=5.0, shift=0.004, wide_rotation_deg=2.0, wide_shift=0.01)
    assert limits.motion(0.0) == limits.motion(0.0, wide=False) == (5.0, 0.004)
    assert replace(limits, widened=True).motion(0.0) == limits.motion(0.0, wide=True) == (5.0, 0.01)
    assert ROBUST.limits.motion(3.0, wide=True) > ROBUST.limits.motion(3.0)


def test_a_heavy_object_may_sag_by_more_than_both_limits():
    limits = Limits(shift=0.003, give=0.001, wide_shift=0.01)
    assert limits.motion(5.0)[1] == 0.005
    assert limits.motion(20.0)[1] == limits.motion(20.0, wide=True)[1] == 0.02
