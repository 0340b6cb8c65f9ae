"""Wider limits of the object's motion, where no start is feasible with the narrow ones."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from here import Here
from scenes import SMALL, hand, observation

from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.cli import again
from sgnlp.planning import results
from sgnlp.planning.batch import Task, batch
from sgnlp.planning.faraway import moved_cloud
from sgnlp.planning.improve import improve
from sgnlp.planning.plan import Plan
from sgnlp.planning.replan import replan
from sgnlp.planning.rounds import Searched
from sgnlp.planning.search import Search
from sgnlp.planning.solve import solve
from sgnlp.planning.widening import WIDE_ROTATION, WIDE_SHIFT, narrow, widened
from sgnlp.show.tables import headline

NARROW = replace(SMALL.limits, rotation_deg=ROBUST.limits.rotation_deg, shift=ROBUST.limits.shift)


def loaded(mass: float) -> Settings:
    """Springs of 400 N/m sag by 1.8 mm under 0.3 kg, by 3.7 mm under 0.6 kg, by 14 mm under 2.3 kg."""
    return replace(SMALL, contact=replace(SMALL.contact, mass=mass), limits=NARROW)


def planned(mass: float, **options: object) -> Plan:
    known = {"count": 1, "jobs": 1, "rounds": 1} | options
    return solve(observation(), hand(), loaded(mass), **known)  # type: ignore[arg-type]


def way(plan: Plan) -> float:
    g = plan.solutions[0].grasp
    return float(np.linalg.norm(g.contacts_eq - g.contacts, axis=1).max())


@pytest.fixture(scope="module")
def wide() -> Plan:
    return planned(0.6)


@pytest.fixture(scope="module")
def cut() -> Plan:
    """The same, without its wide limits."""
    return planned(0.6, widen=False)


def test_a_plan_without_a_feasible_start_is_made_again_with_wide_limits(wide, cut):
    limits = replace(NARROW, rotation_deg=WIDE_ROTATION, shift=WIDE_SHIFT)
    asked = solve(observation(), hand(), replace(loaded(0.6), limits=limits), count=1, jobs=1)
    assert (cut.best, cut.widened, cut.vain) == (None, False, 0)
    assert (wide.widened, wide.vain, wide.tried) == (True, 1, 1)
    assert (asked.widened, wide.problem.settings) == (False, asked.problem.settings)
    np.testing.assert_array_equal(wide.best.joints, asked.best.joints)  # type: ignore[union-attr]
    assert NARROW.shift < way(wide) <= WIDE_SHIFT
    assert next(check for check in wide.best.checks if check.name == "shift").upper == 1e3 * WIDE_SHIFT  # type: ignore[union-attr]


def test_a_plan_with_a_feasible_start_keeps_the_narrow_limits():
    plan = planned(0.3)
    assert plan.best is not None
    assert (plan.widened, plan.vain) == (False, 0)
    assert way(plan) <= NARROW.shift


def test_where_wide_limits_give_no_grasp_either_the_narrow_ones_stay():
    tried = []
    plan = planned(2.3, progress=tried.append)
    assert (len(tried), plan.best, plan.tried, plan.vain, plan.widened) == (2, None, 1, 1, False)
    assert plan.problem.settings == loaded(2.3)
    assert "1 more with wider limits of motion in vain" in headline(plan)
    assert not list(improve(plan))


def test_the_wide_limits_have_one_round_and_those_that_the_narrow_ones_left_over(monkeypatch):
    monkeypatch.setattr("sgnlp.planning.ending.NEAR", np.inf)  # every round is followed by another
    assert [(plan.tried, plan.vain) for plan in [planned(2.3, rounds=2)]] == [(2, 1)]
    monkeypatch.setattr("sgnlp.planning.ending.NEAR", 0.0)  # no round is
    assert [(plan.tried, plan.vain) for plan in [planned(2.3, rounds=2)]] == [(1, 1)]


def test_limits_of_a_user_s_own_are_not_widened_nor_those_without_an_equilibrium(wide, cut):
    assert widened(cut.problem, cut.solutions).settings == wide.problem.settings  # type: ignore[union-attr]
    assert widened(cut.problem, wide.solutions) is None  # one is feasible
    assert widened(cut.problem, ()) is None
    for limits in (replace(NARROW, shift=0.002), replace(NARROW, rotation_deg=5.0)):
        own = replace(cut.problem, settings=replace(loaded(0.6), limits=limits))
        assert widened(own, cut.solutions) is None
    closure = replace(loaded(0.6), contact=replace(SMALL.contact, metric="closure"))
    assert widened(replace(cut.problem, settings=closure), cut.solutions) is None


def test_limits_that_were_widened_are_told_as_they_were_asked_for(wide, cut):
    assert narrow(wide.problem.settings) == cut.problem.settings == narrow(cut.problem.settings)


def test_a_search_that_goes_on_ends_with_the_wide_limits_too(wide, cut):
    ending = replace(cut.ending, widen=True)
    *_, last = improve(replace(cut, ending=ending))
    assert (last.widened, last.vain, last.problem.settings) == (True, 1, wide.problem.settings)
    np.testing.assert_array_equal(last.best.joints, wide.best.joints)
    assert not list(improve(cut))
    assert not list(improve(last))


def test_a_plan_that_follows_its_object_keeps_the_wide_limits_and_one_made_afresh_tries_the_narrow_ones(wide):
    moved = replan(wide, moved_cloud(observation(), np.array([0.004, 0.0, 0.0])))
    assert (moved.replanned, moved.widened, moved.best is not None) == ("moved", True, True)
    afresh = replan(replace(wide, solutions=()))
    assert (afresh.replanned, afresh.widened, afresh.vain) == ("", True, 1)
    np.testing.assert_array_equal(afresh.best.joints, wide.best.joints)  # type: ignore[union-attr]


def test_a_deadline_that_cuts_the_wide_limits_leaves_them_to_be_tried(cut, monkeypatch):
    times = iter([0.0, 2.0])
    monkeypatch.setattr("sgnlp.planning.rounds.time.perf_counter", lambda: next(times, 2.0))
    monkeypatch.setattr("sgnlp.planning.rounds._rounds", lambda search, *_: Searched(search, [*cut.solutions]))
    from sgnlp.planning.rounds import in_rounds

    search = Search(cut.problem, observation(), np.zeros(3), cut.solver, 1, 0, 1, 60.0)
    assert in_rounds(search, replace(cut.ending, widen=True), 1.0, lambda result: None).vain == 0
    assert in_rounds(search, replace(cut.ending, widen=True), inf, lambda result: None).vain == 1


def test_caution_headline_and_the_command_that_makes_it_again_tell_of_the_wide_limits(wide, cut, tmp_path):
    said = [caution for caution in wide.summary()["cautions"] if "while it is grasped" in caution]
    assert len(said) == 1
    assert "moves by 2° and 3 mm at most" in said[0]
    assert "lets it move by 10° and 10 mm" in said[0]
    assert not any("while it is grasped" in caution for caution in cut.summary()["cautions"])
    assert "1 of 1 starts feasible, 1 more with narrower limits of motion in vain, in" in headline(wide)
    wide.save(tmp_path / "wide")
    meta = results.load_grasps(tmp_path / "wide").meta
    assert (meta["widened"], meta["vain"]) == (True, 1)
    assert "rotation" not in again.command(meta, tmp_path).replace("--limits.rotation-deg 2", "")
    assert "--limits.shift 0.01" not in again.command(meta, tmp_path)


def test_a_batch_knows_a_result_with_wide_limits_as_its_own(wide, tmp_path):
    np.savez(tmp_path / "one.npz", points=observation().points)
    task = Task(settings=loaded(0.6), count=1, ending=replace(wide.ending, rounds=1), root=tmp_path)

    def reused(task: Task) -> list[bool]:
        return [row.reused for row in batch([tmp_path / "one.npz"], task, tmp_path / "results", Here())]

    (row,) = batch([tmp_path / "one.npz"], task, tmp_path / "results", Here())
    assert (row.reused, row.feasible, row.widened) == (False, True, True)
    assert reused(task) == [True]
    assert reused(replace(task, settings=wide.problem.settings)) == [False]
    assert reused(replace(task, ending=replace(task.ending, widen=False))) == [False]  # and there is no grasp
    assert reused(task) == [False]
