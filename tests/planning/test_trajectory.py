"""The whole motion of a planned grasp: it goes through what was planned, within limits, and knows what it hits."""

import json
import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from plans import small_plan
from scenes import SEMI_AXES
from scipy.spatial.transform import Rotation

from sgnlp import load_trajectory
from sgnlp.base.errors import InputError
from sgnlp.hand.arm import load_arm, with_base
from sgnlp.hand.arm_inverse import reach_all, way_ends
from sgnlp.hand.arm_kinematics import arm_spheres, wrist_pose
from sgnlp.hand.hand import on_arm
from sgnlp.hand.kinematics import frames, tips
from sgnlp.perception.shape import Shape
from sgnlp.planning import results
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion import files
from sgnlp.planning.motion.clearances import surface_distance
from sgnlp.planning.motion.plan_motion import trajectory
from sgnlp.planning.motion.timing import PEAK, UNSTATED, quintic, seconds, shares, stated
from sgnlp.planning.motion.trajectory import APPROACH, CLOSE, LIFT, PHASES, SQUEEZE, Trajectory
from sgnlp.planning.motion.way import way
from sgnlp.planning.problem import Problem
from sgnlp.planning.surroundings import Surroundings
from sgnlp.program.constraint import Check

BASE = np.array([-0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
"""Of an arm that reaches the ellipsoid, x y z qx qy qz qw."""


@lru_cache
def moved(problem: Problem | None = None, grasps: Grasps | None = None) -> Trajectory:
    """The motion of the best grasp of the small plan, made once for the same problem and grasps."""
    plan = small_plan()
    return trajectory(problem or plan.problem, grasps or plan.arrays(), plan.observation.points)


def among(*obstacles: Shape) -> Problem:
    """The small plan's problem with obstacles that the plan did not know."""
    return replace(small_plan().problem, surroundings=Surroundings(obstacles))


def asked(**motion: float) -> Problem:
    """The small plan's problem with other settings of the motion."""
    problem = small_plan().problem
    return replace(problem, settings=replace(problem.settings, motion=replace(problem.settings.motion, **motion)))


def check(made: Trajectory, name: str) -> Check:
    (found,) = [check for check in made.checks if check.name == name]
    return found


# Where it goes -------------------------------------------------------------------------------------------------------


def test_every_phase_ends_exactly_where_the_grasp_was_planned():
    made, g = moved(), small_plan().arrays()
    end = {phase: made.last(phase) for phase in PHASES}
    exact = {"rtol": 0, "atol": 1e-12}
    for phase in (APPROACH, CLOSE, SQUEEZE):
        np.testing.assert_allclose(made.wrist[end[phase]], g.wrist[0], **exact)
    np.testing.assert_allclose(made.joints[end[APPROACH]], g.joints[0], **exact)
    np.testing.assert_allclose(made.joints[end[CLOSE]], g.joints_contact[0], **exact)
    np.testing.assert_allclose(made.joints[end[SQUEEZE]], g.joints_squeeze[0], **exact)
    np.testing.assert_allclose(made.joints[end[LIFT]], g.joints_squeeze[0], **exact)
    np.testing.assert_allclose(made.setpoints[end[APPROACH]], g.tips_pregrasp[0], **exact)
    np.testing.assert_allclose(made.setpoints[end[CLOSE]], g.contacts[0], **exact)
    np.testing.assert_allclose(made.setpoints[end[SQUEEZE]], g.targets[0], **exact)
    np.testing.assert_array_equal(made.gains, g.gains[0])


def test_it_begins_at_the_stand_off_behind_the_palm_and_the_springs_begin_at_the_tips():
    plan, made = small_plan(), moved(asked(standoff=0.07))
    palm = pin.XYZQUATToSE3(made.wrist[0]).rotation @ plan.problem.hand.palm
    np.testing.assert_allclose(made.wrist[0, :3] + 0.07 * palm, plan.best.wrist[:3], atol=1e-12)
    for k in (0, 30, made.last(APPROACH)):
        np.testing.assert_allclose(
            tips(plan.problem.hand, made.wrist[k], made.joints[k]), made.setpoints[k], atol=1e-12
        )


def test_the_approach_is_straight_and_does_not_turn():
    made = moved()
    at = made.phase == APPROACH
    way = made.wrist[at, :3] - made.wrist[0, :3]
    along = way[-1] / np.linalg.norm(way[-1])
    np.testing.assert_allclose(way - np.outer(way @ along, along), 0, atol=1e-12)
    assert (np.diff(way @ along) > 0).all()
    assert (made.wrist[at, 3:] == made.wrist[0, 3:]).all()
    assert (made.joints[at] == made.joints[0]).all()


def test_the_lift_raises_wrist_and_springs_by_its_height_and_nothing_else():
    made = moved(asked(lift=0.17))
    begin, up = made.last(SQUEEZE), np.array([0, 0, 0.17])
    np.testing.assert_allclose(made.wrist[-1, :3] - made.wrist[begin, :3], up, atol=1e-12)
    np.testing.assert_allclose(made.setpoints[-1] - made.setpoints[begin], np.tile(up, (4, 1)), atol=1e-12)
    np.testing.assert_array_equal(made.wrist[begin:, 3:], made.wrist[[begin] * len(made.wrist[begin:]), 3:])
    assert (made.joints[begin:] == made.joints[-1]).all()


def test_the_phases_follow_each_other_at_steps_of_one_length():
    made = moved(asked(step=0.03))
    np.testing.assert_allclose(np.diff(made.times), 0.03)
    assert made.times[0] == 0
    assert list(dict.fromkeys(made.phase.tolist())) == list(PHASES)
    assert made.seconds == pytest.approx(sum(made.phase_seconds().values()))


# How fast it goes ----------------------------------------------------------------------------------------------------


def test_it_starts_and_ends_at_rest_and_is_fastest_in_the_middle():
    u = np.linspace(0, 1, 2001)
    s, h = quintic(u), u[1]
    speed, acceleration = np.gradient(s, h), np.gradient(np.gradient(s, h), h)
    np.testing.assert_allclose([s[0], s[-1], s[1000]], [0, 1, 0.5], atol=1e-15)
    np.testing.assert_allclose(speed[[0, -1]], 0, atol=1e-5)
    np.testing.assert_allclose(acceleration[[1, -2]], 0, atol=0.1)
    assert speed.argmax() == 1000
    assert speed.max() == pytest.approx(PEAK, rel=1e-5)


@settings(max_examples=15)
@given(
    speed=st.floats(0.02, 1.0), share=st.floats(0.02, 1.0), step=st.floats(0.004, 0.05), standoff=st.floats(0.01, 0.2)
)
def test_neither_joints_nor_wrist_are_ever_faster_than_they_may(speed, share, step, standoff):
    problem = asked(speed=speed, speed_share=share, step=step, standoff=standoff)
    found = way(problem.hand, problem.settings.motion, problem.settings.closing, small_plan().arrays(), 0)
    limits = share * np.array(problem.hand.model.velocityLimit)
    assert (np.abs(np.diff(found.joints, axis=0)) / step <= limits * (1 + 1e-9)).all()
    assert (np.linalg.norm(np.diff(found.wrist[:, :3], axis=0), axis=1) / step <= speed * (1 + 1e-9)).all()


def test_the_velocities_are_those_of_the_joints_and_nothing_moves_where_a_phase_ends():
    made = moved()
    k = made.last(APPROACH) + 5
    np.testing.assert_allclose(made.velocities[k], (made.joints[k + 1] - made.joints[k - 1]) / 0.04, atol=1e-9)
    assert np.abs(made.velocities[k]).max() > 0.1
    assert (made.velocities[made.ends] == 0).all()
    assert made.times[made.ends].tolist() == [0.0, *made.times[[made.last(phase) for phase in PHASES]]]


def test_a_phase_that_no_motion_has_is_refused_with_those_that_it_has():
    made = small_plan().motion
    with pytest.raises(InputError, match="unknown phase of a motion 'reach'; valid: approach, close, lift, squeeze"):
        made.last("reach")


def test_the_slowest_limit_says_how_long_a_phase_lasts():
    made = moved(asked(speed=0.05, speed_share=0.05))
    assert made.phase_seconds()[APPROACH] == pytest.approx(PEAK * 0.1 / 0.05, abs=0.021)
    g, limits = small_plan().arrays(), 0.05 * np.array(small_plan().problem.hand.model.velocityLimit)
    slowest = float((np.abs(g.joints_contact[0] - g.joints[0]) / limits).max())
    assert made.phase_seconds()[CLOSE] == pytest.approx(PEAK * slowest, abs=0.021)


def test_closing_and_squeezing_take_the_seconds_of_the_closing_where_joints_could_be_faster():
    problem = asked(speed_share=1.0, step=0.01)
    problem = replace(problem, settings=replace(problem.settings, closing=replace(problem.settings.closing, seconds=2)))
    spans = moved(problem).phase_seconds()
    assert spans[CLOSE] == pytest.approx(2 * (1 - 0.7), abs=0.011)
    assert spans[SQUEEZE] == pytest.approx(2 * 0.7, abs=0.011)


def test_joints_without_a_limit_of_their_velocity_have_one_that_is_stated():
    np.testing.assert_array_equal(stated(np.array([0.0, 2.0, np.inf, 1e39, 1000.0])), [UNSTATED, 2.0, *[UNSTATED] * 3])
    assert seconds(np.zeros(0), np.zeros(0)) == 0
    np.testing.assert_array_equal(shares(0.0, 0.02), [0, 1])
    assert len(shares(0.06, 0.02)) == 4


# What it hits --------------------------------------------------------------------------------------------------------


def test_an_obstacle_in_the_way_is_found_with_its_sphere_and_its_time():
    hand, free, k = small_plan().problem.hand, moved(), 60
    centres = frames(hand, free.wrist[k], free.joints[k])[1]
    ahead = free.wrist[free.last(APPROACH), :3] - free.wrist[0, :3]
    last = int(np.argmin(centres @ ahead))
    radius = hand.spheres[last].radius
    made = moved(among(Shape.sphere([9.0, 0, 0], 0.01, "far"), Shape.sphere(centres[last], 0.001, "pebble")))
    found = check(made, "approach: obstacles")
    assert not found.passed
    assert not made.clear
    assert found.row == f"{hand.spheres[last].name} to pebble at {made.times[k]:.2f} s"
    assert found.value == pytest.approx(1e3 * (-0.001 - radius), abs=1e-6)
    assert any("not clear in the approach: obstacles" in line and "pebble" in line for line in made.told())


def test_an_obstacle_may_be_as_near_as_its_margin_and_no_nearer():
    plan = small_plan()
    margin = plan.problem.settings.limits.obstacle_margin
    made = moved()
    centres = frames(plan.problem.hand, made.wrist[-1], plan.best.joints_contact)[1]
    top = float((centres[:, 2] + [sphere.radius for sphere in plan.problem.hand.spheres]).max())
    for gap, passes in ((1.5 * margin + 1e-3, True), (0.5 * margin - 1e-3, False)):
        shelf = Shape.box([0, 0, top + gap + 0.05], [2, 2, 0.1], name="shelf")
        found = check(moved(among(shelf)), "lift: obstacles")
        assert found.passed == passes
        assert found.value == pytest.approx(1e3 * gap, abs=1e-6)
        assert found.lower == pytest.approx(1e3 * margin)


def test_the_object_itself_is_not_lifted_into_an_obstacle():
    plan = small_plan()
    g, points = plan.arrays(), plan.observation.points
    top = float((points @ g.rotation_eq[0].T + g.translation_eq[0])[:, 2].max())
    shelf = Shape.box([0, 0, top + 0.1 - 0.003 + 0.5], [2, 2, 1], name="shelf")
    found = check(moved(among(shelf)), "lift: object and obstacles")
    assert not found.passed
    assert found.value == pytest.approx(-3.0, abs=1e-6)
    assert check(moved(among(shelf.moved(np.array([0, 0, 0.01])))), "lift: object and obstacles").passed


def test_a_table_that_is_too_high_is_hit_by_the_lowest_sphere():
    plan, made = small_plan(), moved()
    k, hand = made.last(APPROACH), plan.problem.hand
    low = frames(hand, made.wrist[k], made.joints[k])[1][:, 2] - [sphere.radius for sphere in hand.spheres]
    height = float(low.min()) + 0.004
    found = check(moved(replace(plan.problem, table_height=height)), "approach: table")
    assert not found.passed
    assert found.value == pytest.approx(-4.0, abs=1e-6)
    assert found.row.startswith(hand.spheres[int(low.argmin())].name)


@pytest.mark.parametrize(("phase", "pads"), [(APPROACH, True), (CLOSE, False)])
def test_the_nearest_to_the_object_is_that_of_every_sample_and_pads_may_touch_when_they_close(phase, pads):
    plan, made = small_plan(), moved()
    hand, at = plan.problem.hand, made.phase == phase
    centres = np.array([frames(hand, w, q)[1] for w, q in zip(made.wrist[at], made.joints[at], strict=True)])
    clear = plan.problem.gpis.distance(centres.reshape(-1, 3)).reshape(centres.shape[:2])
    clear -= [sphere.radius for sphere in hand.spheres]
    clear = clear if pads else np.delete(clear, hand.tip_spheres, axis=1)
    assert check(made, f"{phase}: object").value == pytest.approx(1e3 * clear.min(), abs=1e-6)


def test_a_pad_is_to_stay_off_the_object_until_the_fingers_close():
    problem = small_plan().problem
    pads = [problem.hand.spheres[i] for i in problem.hand.tip_spheres]
    spheres = tuple(replace(sphere, radius=0.04) if sphere in pads else sphere for sphere in problem.hand.spheres)
    made = moved(replace(problem, hand=replace(problem.hand, spheres=spheres)))
    names = [pad.name for pad in pads]
    assert not check(made, "approach: object").passed
    assert check(made, "approach: object").row.partition(" at ")[0] in names
    assert check(made, "close: object").passed


def test_a_finger_that_sweeps_through_the_object_on_the_way_in_is_found():
    problem = small_plan().problem
    found = check(moved(replace(problem, hand=replace(problem.hand, palm=-problem.hand.palm))), "approach: object")
    assert not found.passed
    assert found.value < -5


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_far_from_the_object_the_distance_is_bounded_from_below(seed):
    problem = small_plan().problem
    x = np.random.default_rng(seed).normal(size=(50, 3))
    x *= np.random.default_rng(seed).uniform(0.06, 1.5, (50, 1)) / np.linalg.norm(x, axis=1, keepdims=True)
    x[:, 2] += SEMI_AXES[2]
    found = surface_distance(problem.gpis, problem.box, x)
    nearest = np.linalg.norm(x[:, None] - _skin(), axis=2).min(axis=1)
    assert (found <= nearest + 0.004).all()  # the surface of 60 points is off by less
    assert (found >= 0.3 * nearest - 0.03).all()


def _skin() -> np.ndarray:
    """Points of the true ellipsoid."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 60), np.linspace(0, np.pi, 40))
    ball = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1).reshape(-1, 3)
    return ball * SEMI_AXES + [0, 0, SEMI_AXES[2]]


def test_beyond_the_ball_of_the_model_the_distance_grows_with_the_way_to_the_ball():
    gpis = small_plan().problem.gpis
    small = replace(gpis, radius=0.06)
    far = gpis.centre + np.array([[0.0, 0.0, 0.11]])
    edge = gpis.centre + np.array([[0.0, 0.0, 0.06]])
    box = np.array([gpis.centre - 0.2, gpis.centre + 0.2])
    expected = np.hypot(0.05, gpis.distance(edge))
    np.testing.assert_allclose(surface_distance(small, box, far), expected, rtol=1e-6)


def test_fingers_that_are_one_inside_another_are_found_with_both_names():
    problem = small_plan().problem
    spheres = tuple(replace(sphere, radius=0.5) for sphere in problem.hand.spheres)
    found = check(moved(replace(problem, hand=replace(problem.hand, spheres=spheres))), "close: self")
    assert not found.passed
    assert " to " in found.row


# On an arm -----------------------------------------------------------------------------------------------------------


@lru_cache
def carried() -> tuple[Problem, Grasps]:
    """The small plan's problem on an arm, and its grasps with joints that reach pregrasp, stand-off and lift."""
    problem, grasps = small_plan().problem, small_plan().arrays()
    hand = on_arm(problem.hand, with_base(load_arm("panda"), BASE))
    q = reach_all(hand.arm, grasps.wrist[0], 0, 20)[0]
    ends = way_ends(hand.arm, q, -0.1 * hand.palm, 0.1)
    arm = np.repeat(np.stack([q, *ends])[None], len(grasps), axis=0)
    names = np.array(hand.arm.joint_names)
    return replace(problem, hand=hand), replace(grasps, arm=arm, arm_joint_names=names)


def test_an_arm_carries_the_wrist_along_its_path_from_the_planned_joints_without_a_jump():
    problem, grasps = carried()
    arm, made = problem.hand.arm, moved(problem, grasps)
    assert tuple(made.arm_joint_names) == arm.joint_names
    for phase in (APPROACH, CLOSE, SQUEEZE):
        np.testing.assert_array_equal(made.arm[made.last(phase)], grasps.arm[0, 0])
    for k in range(0, len(made), 7):
        error = pin.log6(pin.XYZQUATToSE3(wrist_pose(arm, made.arm[k])).actInv(pin.XYZQUATToSE3(made.wrist[k])))
        assert np.linalg.norm(error.vector) < 2e-4
    assert ((arm.lower <= made.arm) & (made.arm <= arm.upper)).all()
    assert (np.abs(np.diff(made.arm, axis=0)) / 0.02 <= 0.31 * arm.velocity).all()
    assert np.abs(made.arm[made.last(APPROACH)] - made.arm[made.last(APPROACH) - 1]).max() < 1e-5
    assert check(made, "approach: arm off the path").passed
    assert check(made, "lift: arm speed").passed


def test_an_arm_slows_the_motion_down_where_its_joints_are_slow():
    problem, grasps = carried()
    fast = moved(problem, grasps)
    slow_arm = replace(problem.hand.arm, velocity=problem.hand.arm.velocity / 10)
    slow = moved(replace(problem, hand=replace(problem.hand, arm=slow_arm)), grasps)
    assert slow.phase_seconds()[APPROACH] > 1.5 * fast.phase_seconds()[APPROACH]
    assert (np.abs(np.diff(slow.arm, axis=0)) / 0.02 <= 0.31 * slow_arm.velocity).all()


def test_a_lift_out_of_the_arm_s_reach_is_told():
    problem, grasps = carried()
    motion = replace(problem.settings.motion, lift=1.5)
    made = moved(replace(problem, settings=replace(problem.settings, motion=motion)), grasps)
    assert check(made, "approach: arm off the path").passed
    found = check(made, "lift: arm off the path")
    assert not found.passed
    assert found.value > 100
    assert any("arm off the path" in line for line in made.told())


def test_an_arm_that_hits_an_obstacle_is_found():
    problem, grasps = carried()
    made = moved(problem, grasps)
    arm = problem.hand.arm
    elbow = next(i for i, sphere in enumerate(arm.spheres) if "link4" in sphere.link)
    lamp = Shape.sphere(arm_spheres(arm, made.arm[0])[elbow], 0.01, "lamp")
    problem = replace(problem, surroundings=Surroundings((lamp,)))
    found = check(moved(problem, grasps), "approach: obstacles")
    assert not found.passed
    assert found.row.partition(" to ")[0] in {sphere.name for sphere in arm.spheres}
    assert "to lamp" in found.row


def test_a_finger_that_its_own_arm_meets_is_found():
    problem, grasps = carried()
    hand = problem.hand
    long = tuple(replace(s, radius=0.5) if s.link == hand.fingers[0].frame else s for s in hand.spheres)
    assert check(moved(problem, grasps), "approach: self").passed
    made = moved(replace(problem, hand=replace(hand, spheres=long, pairs=())), grasps)
    found = check(made, "approach: self")
    assert not found.passed
    assert any(name in found.row for name in [s.name for s in hand.arm.spheres])


def test_an_arm_keeps_its_elbow_where_the_plan_has_another_one_at_the_ends():
    problem, grasps = carried()
    arm = grasps.arm.copy()
    arm[0, 1:] = problem.hand.arm.home
    np.testing.assert_array_equal(moved(problem, replace(grasps, arm=arm)).arm, moved(problem, grasps).arm)


def test_a_step_that_the_arm_s_joints_cannot_make_in_its_time_is_a_jump():
    problem, grasps = carried()
    lame = replace(problem.hand.arm, velocity=problem.hand.arm.velocity / 1000)
    found = check(moved(replace(problem, hand=replace(problem.hand, arm=lame)), grasps), "approach: arm speed")
    assert not found.passed
    assert found.value > 1
    assert found.row.partition(" at ")[0] in lame.joint_names


# Files ---------------------------------------------------------------------------------------------------------------


def test_a_saved_trajectory_is_loaded_bit_for_bit(tmp_path):
    plan = small_plan()
    plan.save(tmp_path)
    for found in (load_trajectory(tmp_path), load_trajectory(tmp_path / results.MOTION[0])):
        for name in files.ARRAYS:
            a, b = getattr(found, name), getattr(plan.motion, name)
            assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()), name
        assert found.checks == plan.motion.checks
        assert found.meta == plan.motion.meta
    with np.load(tmp_path / results.MOTION[0], allow_pickle=False) as data:
        assert {data[key].dtype.kind for key in data.files} <= set("fU")


def test_the_json_has_the_same_arrays(tmp_path):
    small_plan().save(tmp_path)
    told = json.loads((tmp_path / "trajectory.json").read_text(encoding="utf-8"))
    for name in files.ARRAYS:
        np.testing.assert_array_equal(
            np.array(told[name]).reshape(np.shape(getattr(moved(), name))), getattr(moved(), name)
        )
    assert told["meta"]["frame"] == "world"
    assert [c["name"] for c in told["checks"]] == [c.name for c in moved().checks]


def test_a_result_without_a_feasible_grasp_has_no_trajectory_and_takes_the_old_one_away(tmp_path):
    plan = small_plan()
    plan.save(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} >= set(results.MOTION)
    bad = replace(plan.solutions[0], checks=(replace(plan.solutions[0].checks[0], passed=False),))
    none = replace(plan, solutions=(bad,))
    assert none.motion is None
    assert none.summary()["motion"] is None
    none.save(tmp_path)
    assert not {path.name for path in tmp_path.iterdir()} & set(results.MOTION)
    with pytest.raises(InputError, match=r"a result with a feasible grasp has trajectory\.npz"):
        load_trajectory(tmp_path)


def test_a_trajectory_of_another_plan_is_refused_beside_the_grasps_and_read_alone(tmp_path):
    plan, file = small_plan(), tmp_path / "trajectory.npz"
    plan.save(tmp_path)
    replace(plan, seed=1).save(tmp_path / "other")
    file.write_bytes((tmp_path / "other" / "trajectory.npz").read_bytes())
    for path in (tmp_path, file):
        with pytest.raises(InputError, match=r"trajectory\.npz' belongs to another plan than the grasps\.npz"):
            load_trajectory(path)
    (tmp_path / "grasps.npz").unlink()
    assert load_trajectory(file).meta["plan"] == replace(plan, seed=1).arrays().digest


def test_what_is_no_trajectory_is_refused(tmp_path):
    file = tmp_path / "trajectory.npz"
    for content in (b"", b"PK\x05\x06" + 18 * b"\0"):  # no file, and an archive with nothing in it
        file.write_bytes(content)
        with pytest.raises(InputError, match=r"trajectory\.npz"):
            load_trajectory(tmp_path)
    small_plan().save(tmp_path)
    file.write_bytes(file.read_bytes()[: len(file.read_bytes()) // 2])
    with pytest.raises(InputError, match=r"trajectory\.npz"):
        load_trajectory(file)


def test_the_summary_says_how_long_the_motion_takes_and_whether_it_is_clear():
    told = small_plan().summary()["motion"]
    assert told["seconds"] == small_plan().motion.seconds
    assert set(told["phases"]) == set(PHASES)
    assert told["clear"] is True
    assert set(told["checks"]) == {c.name for c in small_plan().motion.checks}


# Messages ------------------------------------------------------------------------------------------------------------

TIME = {"sec": int, "nanosec": int}
HEADER = {"stamp": TIME, "frame_id": str}
VECTOR = dict.fromkeys("xyz", float)
POINT = {name: [float] for name in ("positions", "velocities", "accelerations", "effort")} | {"time_from_start": TIME}
JOINT_TRAJECTORY = {"header": HEADER, "joint_names": [str], "points": [POINT]}
POSE = {"position": VECTOR, "orientation": dict.fromkeys("xyzw", float)}
POSE_STAMPED = {"header": HEADER, "pose": POSE}
TRANSLATION = {
    "direction": {"header": HEADER, "vector": VECTOR},
    "desired_distance": float,
    "min_distance": float,
}
GRASP = {
    "id": str,
    "pre_grasp_posture": JOINT_TRAJECTORY,
    "grasp_posture": JOINT_TRAJECTORY,
    "grasp_pose": POSE_STAMPED,
    "grasp_quality": float,
    "pre_grasp_approach": TRANSLATION,
    "post_grasp_retreat": TRANSLATION,
    "post_place_retreat": TRANSLATION,
    "max_contact_force": float,
    "allowed_touch_objects": [str],
}
"""The fields of trajectory_msgs, geometry_msgs and moveit_msgs in ROS 2 Humble, in their order."""


def fits(value, kind) -> bool:
    """Whether a value of YAML is a message of a kind, with all of its fields in their order and none beside them."""
    if isinstance(kind, dict):
        return list(value) == list(kind) and all(fits(value[name], kind[name]) for name in kind)
    if isinstance(kind, list):
        return isinstance(value, list) and all(fits(item, kind[0]) for item in value)
    return type(value) is kind


def told_in(text: str) -> dict:
    """What a file of YAML says; libyaml, where it is there, reads it in a tenth of the time."""
    return yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))


@pytest.fixture(scope="module")
def messages(tmp_path_factory) -> dict[str, dict]:
    folder = tmp_path_factory.mktemp("messages")
    small_plan().save(folder)
    return {name: told_in((folder / name).read_text(encoding="utf-8")) for name in results.MOTION[2:]}


def test_the_messages_have_exactly_the_fields_of_their_definitions(messages):
    for message, kind in zip(messages.values(), (JOINT_TRAJECTORY, GRASP, POSE_STAMPED), strict=True):
        assert fits(message, kind)
        assert not fits(message | {"more": 1}, kind)


def test_the_joint_trajectory_has_every_sample_with_its_time(messages):
    told, made = messages["trajectory.yaml"], small_plan().motion
    assert told["joint_names"] == made.joint_names.tolist()
    np.testing.assert_array_equal([point["positions"] for point in told["points"]], made.joints)
    np.testing.assert_array_equal([point["velocities"] for point in told["points"]], made.velocities)
    since = [point["time_from_start"] for point in told["points"]]
    assert all(0 <= time["nanosec"] < 10**9 for time in since)
    np.testing.assert_allclose([t["sec"] + 1e-9 * t["nanosec"] for t in since], made.times, rtol=0, atol=1e-9)


def test_the_grasp_message_says_how_to_come_how_to_hold_and_how_to_leave(messages):
    told, s, plan = messages["grasp.yaml"], small_plan().best, small_plan()
    assert told["grasp_pose"] == messages["pregrasp.yaml"]
    pose = told["grasp_pose"]["pose"]
    np.testing.assert_array_equal([pose["position"][a] for a in "xyz"], s.wrist[:3])
    np.testing.assert_array_equal([pose["orientation"][a] for a in "xyzw"], s.wrist[3:])
    np.testing.assert_array_equal(told["pre_grasp_posture"]["points"][0]["positions"], s.joints)
    np.testing.assert_array_equal(told["grasp_posture"]["points"][0]["positions"], s.joints_squeeze)
    np.testing.assert_array_equal(told["grasp_posture"]["points"][0]["effort"], s.grasp.torques_eq)
    come, leave, away = (told[n] for n in ("pre_grasp_approach", "post_grasp_retreat", "post_place_retreat"))
    palm = Rotation.from_quat(s.wrist[3:]).as_matrix() @ plan.problem.hand.palm
    np.testing.assert_allclose([come["direction"]["vector"][a] for a in "xyz"], palm, atol=1e-9)
    np.testing.assert_allclose([away["direction"]["vector"][a] for a in "xyz"], -palm, atol=1e-9)
    np.testing.assert_allclose([leave["direction"]["vector"][a] for a in "xyz"], [0, 0, 1], atol=1e-9)
    assert come["desired_distance"] == pytest.approx(0.1)
    assert told["max_contact_force"] == pytest.approx(np.linalg.norm(s.grasp.forces_eq, axis=1).max())
    assert told["grasp_quality"] == (-1.0 if math.isnan(s.confidence) else s.confidence)
    assert told["allowed_touch_objects"] == ["ellipsoid"]


def test_the_frame_of_the_messages_has_the_name_that_is_asked_for():
    problem = asked(frame="base_link")  # type: ignore[arg-type]
    found = files.contents(moved(problem), small_plan().arrays())
    for name in results.MOTION[2:]:
        assert b"frame_id: base_link" in found[name]
        assert b"frame_id: world" not in found[name]


def test_an_arm_s_joints_come_before_the_hand_s_in_the_joint_trajectory():
    problem, grasps = carried()
    made = moved(problem, grasps)
    told = told_in(files.contents(made, small_plan().arrays())["trajectory.yaml"])
    assert told["joint_names"] == [*problem.hand.arm.joint_names, *problem.hand.joint_names]
    assert fits(told, JOINT_TRAJECTORY)
    np.testing.assert_array_equal(told["points"][0]["positions"], [*made.arm[0], *made.joints[0]])
