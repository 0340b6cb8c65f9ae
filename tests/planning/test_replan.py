"""Plans carried over to an object that has moved, has changed, or was touched."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from scenes import REACHING, SMALL, hand, observation

from sgnlp.base.errors import InputError
from sgnlp.hand.kinematics import frames
from sgnlp.perception.observation import Observation
from sgnlp.planning import reopen, resuming
from sgnlp.planning.faraway import moved_cloud
from sgnlp.planning.kkt import SOLVED_FACTOR
from sgnlp.planning.plan import Plan
from sgnlp.planning.planner import STILL_SOLVED, Planner
from sgnlp.planning.replan import BESIDE, REACH, Touch, replan, touched
from sgnlp.planning.solve import solve
from sgnlp.planning.warm_start import WarmStart
from sgnlp.program.variables import AtContact, posture
from sgnlp.surface.registration import PlanarMotion

STEP = PlanarMotion(np.array([0.01, 0.0, 0.05]), 0.05, np.array([0.01, -0.003, 0.0]))
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def plan() -> Plan:
    return solve(observation(), hand(), SMALL, count=2, jobs=2)


def seen(cloud: Observation, points: np.ndarray) -> Observation:
    """Other points in the place of a cloud's."""
    return replace(cloud, points=points, digest="another")


def test_an_object_that_moved_is_grasped_by_the_same_grasp_moved(plan):
    again = replan(plan, seen(plan.observation, STEP(plan.observation.points)))
    assert again.replanned == "moved"
    assert again.meta()["replanned"] == "moved"
    assert len(again.solutions) == 1
    assert again.best.feasible
    assert again.best.start == plan.best.start
    np.testing.assert_allclose(again.best.grasp.tips, STEP(plan.best.grasp.tips), atol=1e-3)
    np.testing.assert_allclose(again.best.wrist[:3], STEP(plan.best.wrist[:3]), atol=1e-3)
    assert again.best.energy == pytest.approx(plan.best.energy, rel=1e-4)
    assert again.best.solved(again.tolerance)
    assert again.best.iterations < plan.best.iterations


def test_an_object_that_only_moved_needs_no_iteration_for_its_multipliers_move_too():
    reached = solve(observation(), hand(), REACHING, count=1, jobs=1)
    nlp = Planner(reached.problem).stages[-1].nlp
    assert "reach" in {constraint.name for constraint in nlp.constraints}  # rows that are vectors
    for yaw in (0.0, 2.0):
        step = replace(STEP, yaw=yaw)
        problem = replace(reached.problem, gpis=step.moved(reached.problem.gpis), com=step(reached.problem.com))
        ended = Planner(problem).resume(reached.solutions[0].ended.moved(nlp, step))
        assert (ended.status, ended.iterations) == (STILL_SOLVED, 0)
        assert ended.kkt.worst <= SOLVED_FACTOR * reached.tolerance


def test_what_is_kept_of_a_step_makes_no_difference_to_the_next(plan, monkeypatch):
    clouds = [STEP(plan.observation.points), 0.95 * plan.observation.points, 0.9 * plan.observation.points]
    built = []
    for keeps in (True, False):
        now = plan
        for points in clouds:
            if not keeps:
                monkeypatch.setattr(resuming, "_kept", threading.local())
            now = replan(now, seen(plan.observation, points))
        built.append(now)
    kept, new = built
    assert kept.best.iterations == new.best.iterations > 0
    np.testing.assert_array_equal(kept.best.ended.x, new.best.ended.x)


def test_the_planner_is_kept_for_problems_that_differ_in_numbers_alone(plan):
    problem, solver = plan.problem, plan.solver
    first = resuming.resuming(problem, solver)
    assert resuming.resuming(replace(problem, table_height=-0.01), solver) is first
    assert first.problem.table_height == -0.01
    heavier = replace(problem.settings, contact=replace(problem.settings.contact, mass=0.2))
    for other, by in (
        (replace(problem, settings=heavier), solver),
        (replace(problem, hand=replace(problem.hand)), solver),
        (replace(problem, terms=problem.terms[1:]), solver),
        (problem, replace(solver, tolerance=1e-5)),
    ):
        assert resuming.resuming(problem, solver) is not (found := resuming.resuming(other, by))
        assert found.problem is other


def test_a_stream_of_clouds_is_followed_and_the_number_of_starts_kept(plan):
    now = plan
    for _ in range(3):
        now = replan(now, seen(now.observation, STEP(now.observation.points)))
        assert now.replanned == "moved"
        assert now.best is not None
    thrice = STEP(STEP(STEP(plan.best.grasp.tips)))
    np.testing.assert_allclose(now.best.grasp.tips, thrice, atol=2e-3)
    assert now.count == plan.count


def test_a_table_that_rises_lifts_the_grasp(plan):
    higher = moved_cloud(plan.observation, 0.02 * UP)
    again = replan(plan, higher)
    assert again.replanned == "moved"
    np.testing.assert_allclose(again.best.grasp.tips, plan.best.grasp.tips + 0.02 * UP, atol=1e-3)


def test_another_body_is_fitted_anew(plan):
    thinner = plan.observation.points * [1.0, 0.8, 1.0]
    again = replan(plan, seen(plan.observation, thinner))
    assert again.replanned == "fitted"
    assert again.best is not None
    assert abs(again.problem.gpis.distance(thinner[::50])).max() < 0.005


def test_a_plan_without_a_feasible_grasp_is_made_afresh(plan):
    hopeless = replace(plan, solutions=())
    again = replan(hopeless, plan.observation)
    assert again.replanned == ""
    assert len(again.solutions) == plan.count
    assert again.best.energy == pytest.approx(plan.best.energy)


def test_a_move_across_the_metre_at_which_the_planning_frame_changes_is_followed():
    cloud = moved_cloud(observation(), np.array([20.497, 0.0, 0.0]))
    far = solve(cloud, hand(), SMALL, count=1, jobs=1)
    again = replan(far, moved_cloud(cloud, np.array([0.01, 0.0, 0.0])))
    assert again.replanned == "moved"
    moved = far.best.grasp.tips + np.array([0.01, 0.0, 0.0])
    np.testing.assert_allclose(again.best.grasp.tips, moved, atol=1e-3)


@pytest.mark.parametrize("out", [0.0, 0.004, -0.004])
def test_the_surface_goes_through_a_touched_point_with_its_normal(plan, out):
    normal = plan.best.grasp.normals[0]
    point = plan.best.contact_points[0] + out * normal
    again = replan(plan, touches=[Touch(point, normal)])
    assert again.replanned == "moved"
    assert again.best is not None
    assert abs(again.problem.gpis.distance(point[None])[0]) < 0.002
    assert again.problem.gpis.normal(point[None])[0] @ normal > np.cos(np.radians(20))
    assert len(again.problem.gpis.X) == len(plan.problem.gpis.X) + 3


def test_a_touch_tilts_the_surface_towards_its_normal(plan):
    gpis, point = plan.problem.gpis, plan.best.contact_points[0]
    before = gpis.normal(point[None])[0]
    tilted = before + 0.4 * np.cross(before, UP)
    tilted /= np.linalg.norm(tilted)
    after = touched(gpis, [Touch(point, tilted)]).normal(point[None])[0]
    assert after @ tilted > before @ tilted + 0.01


@pytest.mark.parametrize(
    ("point", "normal", "said"),
    [
        ([0.0, 0.0], UP, "the point of a touch' must be an array of real numbers of shape"),
        ([0.0, np.nan, 0.0], UP, "the point of a touch must be three finite numbers"),
        ([0.0, 0.0, 0.1], [0.0, 0.0, 0.0], "normal of a touch must not be 0"),
        ([0.0, 0.0, 100.0], UP, "is it in metres"),
    ],
)
def test_a_touch_that_is_none_is_refused(plan, point, normal, said):
    with pytest.raises(InputError, match=said):
        replan(plan, touches=[Touch(point, normal)])


def test_a_touch_that_is_refused_is_named_where_the_cloud_is_though_it_is_far_from_the_origin():
    far = moved_cloud(observation(), np.array([5000.0, -3000.0, 20.0]))
    plan = solve(far, hand(), SMALL, count=1, jobs=1, rounds=1, widen=False)
    with pytest.raises(InputError, match=r"the touch at \[5001\.0, -3000\.0, 20\.0\] m is more than 3 cm beside"):
        replan(plan, touches=[Touch([5001.0, -3000.0, 20.0], UP)])


def test_a_touch_whose_normal_points_into_the_object_is_told(plan):
    point, normal = plan.best.contact_points[0], plan.best.grasp.normals[0]
    slanted = normal + 1.5 * np.cross(normal, UP)
    for outward in (normal, slanted):
        assert replan(plan, touches=[Touch(point, outward)]).observation.notes == plan.observation.notes
    (said,) = set(replan(plan, touches=[Touch(point, -normal)]).observation.notes) - set(plan.observation.notes)
    assert f"The normal of the touch at {point.round(3).tolist()} m points into the object as it is known" in said
    assert said.endswith("give it the other sign.")


def test_a_touch_just_beside_the_seen_points_is_taken(plan):
    side = plan.problem.box.mean(axis=0)
    side[0] = plan.problem.box[0, 0] - REACH + BESIDE
    again = replan(plan, touches=[Touch(side, [-1.0, 0, 0])])
    assert len(again.problem.gpis.X) > len(plan.problem.gpis.X)


def test_a_moved_warm_start_stands_for_the_moved_grasp(plan):
    ended, robot = plan.best.ended, plan.problem.hand
    nlp = Planner(plan.problem).stages[-1].nlp
    assert isinstance(ended, WarmStart)
    motion = PlanarMotion(np.array([0.1, 0.2, 0.0]), 0.8, np.array([0.05, -0.02, 0.01]))
    before, after = (
        posture(robot, AtContact(), (warm.start.wrist, warm.start.joints), warm.x, 0.5)
        for warm in (ended, ended.moved(nlp, motion))
    )
    np.testing.assert_allclose(after.targets, motion(before.targets), atol=1e-12)
    np.testing.assert_allclose(after.joints, before.joints)
    here, there = (frames(robot, at.wrist, at.joints) for at in (before, after))
    for points, moved in zip(here, there, strict=True):
        np.testing.assert_allclose(moved, motion(points), atol=1e-12)


def test_a_replanned_result_is_not_posed_again_from_its_cloud_alone(plan):
    again = replan(plan, seen(plan.observation, STEP(plan.observation.points)))
    with pytest.raises(InputError, match="it was replanned"):
        reopen.problem(again.arrays(), again.observation, again.problem.hand)
