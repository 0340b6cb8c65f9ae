"""Inverse kinematics of arms: poses that they reach, within their limits, and poses that they do not."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from arms import rail
from scipy.optimize import least_squares

from sgnlp.hand.arm import Arm, available_arms, load_arm
from sgnlp.hand.arm_inverse import DISTINCT, NEAR, fitness, reach, reach_all
from sgnlp.hand.arm_kinematics import manipulability, wrist_pose

TRIES = 10
POSES = 12


@pytest.fixture(scope="module", params=available_arms())
def arm(request: pytest.FixtureRequest) -> Arm:
    return load_arm(request.param)


def off(arm: Arm, q: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Distance [m] and angle [rad] between the wrist and a pose."""
    found, wanted = pin.XYZQUATToSE3(wrist_pose(arm, q)), pin.XYZQUATToSE3(pose)
    angle = np.linalg.norm(pin.log3(found.rotation.T @ wanted.rotation))
    return np.array([np.linalg.norm(found.translation - wanted.translation), angle])


def inside(arm: Arm, q: np.ndarray) -> bool:
    return bool(((q >= arm.lower) & (q <= arm.upper)).all())


@pytest.mark.parametrize("seed", range(5))
def test_from_nearby_a_pose_is_reached_to_rounding(arm: Arm, seed: int):
    rng = np.random.default_rng(seed)
    wanted = np.clip(arm.home + 0.3 * rng.normal(size=len(arm.home)), arm.lower, arm.upper)
    pose = wrist_pose(arm, wanted)
    q, error = reach(arm, pose, arm.home)
    assert (error < 1e-8).all()
    assert (off(arm, q, pose) < 1e-7).all()
    assert inside(arm, q)


def test_nearly_every_pose_within_the_limits_is_reached_and_every_solution_is_one(arm: Arm):
    rng, none = np.random.default_rng(0), 0
    for k in range(POSES):
        pose = wrist_pose(arm, rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)))
        found = reach_all(arm, pose, k, TRIES)
        none += not found
        for i, q in enumerate(found):
            assert inside(arm, q)
            assert (off(arm, q, pose) <= NEAR + 1e-9).all()
            assert all(np.abs(q - other).max() > DISTINCT for other in found[:i])
        assert sorted((fitness(arm, q) for q in found), reverse=True) == [fitness(arm, q) for q in found]
    assert none <= 1


def test_the_same_seed_gives_the_same_solutions():
    arm = load_arm("panda")
    pose = wrist_pose(arm, arm.home + 0.2)
    one, other = reach_all(arm, pose, 3, TRIES), reach_all(arm, pose, 3, TRIES)
    assert len(one) == len(other) > 0
    assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_a_pose_out_of_reach_has_no_solution_and_an_error_that_says_how_far(arm: Arm):
    pose = wrist_pose(arm, arm.home)
    pose[0] += 3.0
    assert reach_all(arm, pose, 0, TRIES) == []
    q, error = reach(arm, pose, arm.home)
    assert inside(arm, q)
    np.testing.assert_allclose(error, off(arm, q, pose), atol=1e-9)
    assert error[0] > 1.0


@pytest.mark.parametrize(("joint", "side"), [(5, 1), (3, 1), (1, 1)])
def test_where_a_limit_is_in_the_way_the_error_is_the_least_within_the_limits(joint: int, side: int):
    arm = load_arm("panda")
    beyond = arm.home.copy()
    beyond[joint] = (arm.upper if side > 0 else arm.lower)[joint] + 0.4 * side
    pose = wrist_pose(arm, beyond)
    q, error = reach(arm, pose, arm.home)
    assert inside(arm, q)
    np.testing.assert_allclose(error, off(arm, q, pose), atol=1e-9)

    def residual(joints: np.ndarray) -> np.ndarray:
        found, wanted = pin.XYZQUATToSE3(wrist_pose(arm, joints)), pin.XYZQUATToSE3(pose)
        angle = pin.log3(wanted.rotation @ found.rotation.T)
        return np.concatenate([wanted.translation - found.translation, angle])

    least = least_squares(residual, q, bounds=(arm.lower - 1e-12, arm.upper + 1e-12))
    assert np.linalg.norm(error) < 1.02 * np.linalg.norm(least.fun) + 1e-8


def test_the_ur_finds_several_branches_in_the_turn_nearest_to_home():
    arm = load_arm("ur5")
    pose = wrist_pose(arm, arm.home + np.array([0.3, 0.2, -0.2, 0.1, 0.3, 0.4]))
    found = reach_all(arm, pose, 1, 30)
    assert len(found) >= 4
    assert all((np.abs(q - arm.home) <= np.pi + 1e-9).all() for q in found)


def test_fitness_is_manipulability_times_the_room_left():
    arm = load_arm("panda")
    middle = (arm.lower + arm.upper) / 2
    assert fitness(arm, middle) == pytest.approx(manipulability(arm, middle))
    assert manipulability(arm, np.array([*arm.home[:6], arm.upper[6]])) > 0
    assert fitness(arm, np.array([*arm.home[:6], arm.upper[6]])) == 0


def test_an_arm_of_three_joints_comes_as_near_as_it_can(tmp_path: Path):
    arm = load_arm(rail(tmp_path))
    q, error = reach(arm, wrist_pose(arm, np.array([0.5, -0.4, 0.6])), arm.home)
    np.testing.assert_allclose(q, [0.5, -0.4, 0.6], atol=1e-7)
    assert (error < 1e-7).all()
