"""The law of the fingers by itself: setpoints that ramp, springs, dampers, and a posture that no tip feels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sgnlp.base.errors import InputError
from sgnlp.control.law import Law, critical, freed, joint_torque, ramped, spring_forces
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.program.equilibrium import GRAVITY

LEFT = load_hand("allegro_left")
WRIST = np.array([0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0])
STEP = 1e-6


def jacobian(hand: Hand, joints: np.ndarray, wrist: np.ndarray = WRIST) -> np.ndarray:
    """Of the tips (3m, n), by central differences: mimic joints follow."""
    columns = []
    for step in STEP * np.eye(len(joints)):
        ahead, behind = (frames(hand, wrist, joints + sign * step)[0] for sign in (1, -1))
        columns.append((ahead - behind).ravel() / (2 * STEP))
    return np.array(columns).T


def postures(hand: Hand, count: int = 6) -> list[np.ndarray]:
    """Joints well inside their limits."""
    rng = np.random.default_rng(3)
    return [hand.lower + rng.uniform(0.25, 0.75, len(hand.lower)) * (hand.upper - hand.lower) for _ in range(count)]


def projector(J: np.ndarray) -> np.ndarray:
    """N (n, n)."""
    return freed(J, np.eye(J.shape[1]))


# --- the ramp --------------------------------------------------------------------------------------------------------


def test_a_setpoint_goes_from_its_begin_to_its_end_at_one_speed_and_stays_there():
    begin, end = np.array([1.0, -2.0]), np.array([3.0, 2.0])
    np.testing.assert_array_equal(ramped(begin, end, 0.0, 0.8), begin)
    np.testing.assert_allclose(ramped(begin, end, 0.2, 0.8), [1.5, -1.0])
    np.testing.assert_allclose(ramped(begin, end, 0.6, 0.8), [2.5, 1.0])
    for time in (0.8, 0.9, 1e3):
        np.testing.assert_array_equal(ramped(begin, end, time, 0.8), end)


def test_in_no_time_it_jumps():
    np.testing.assert_array_equal(ramped(np.zeros(2), np.ones(2), 0.0, 0.0), np.ones(2))


@pytest.mark.parametrize("seconds", [0.0, 0.8])
def test_before_its_time_it_stays_where_it_begins(seconds):
    np.testing.assert_array_equal(ramped(np.zeros(2), np.ones(2), -0.1, seconds), np.zeros(2))


# --- springs and dampers ---------------------------------------------------------------------------------------------


def test_a_spring_pulls_towards_its_target_as_its_stretch_says_and_against_its_speed():
    error, speed = np.array([[0.01, 0, 0], [0, -0.02, 0]]), np.array([[0, 0, 0.1], [0.2, 0, 0]])
    found = spring_forces(error, speed, np.array([100.0, 300.0]), np.array([20.0, 30.0]))
    np.testing.assert_allclose(found, [[1.0, 0, -2.0], [-6.0, -6.0, 0]])


@given(arrays(float, (4, 3), elements=st.floats(-10, 10)), arrays(float, 4, elements=st.floats(1, 2000)))
def test_dampers_never_drive(speed, gains):
    """Their power Σ F·ȧ is not positive."""
    assert (spring_forces(np.zeros((4, 3)), speed, gains, critical(gains, 1.0)) * speed).sum() <= 0.0


@settings(max_examples=30)
@given(arrays(float, 16, elements=st.floats(-10, 10)), st.integers(0, 5))
def test_no_damper_of_the_posture_drives_either(speed, at):
    """N is symmetric with eigenvalues between 0 and 1; rounding alone gives power."""
    torque = freed(jacobian(LEFT, postures(LEFT)[at]), joint_torque(np.zeros(16), speed, 0.1, 0.02))
    assert torque @ speed <= 1e-9
    assert joint_torque(np.zeros(16), speed, 0.1, 0.02) @ speed <= 0.0


def test_critical_damping_returns_without_overshoot_and_less_does_not():
    k, inertia = 0.1, 1e-3

    def lowest(damping: float) -> float:
        q, speed, least, dt = 1.0, 0.0, 1.0, 1e-4
        for _ in range(20000):
            speed += dt * (-k * q - damping * speed) / inertia
            q += dt * speed
            least = min(least, q)
        return least

    assert lowest(critical(k, inertia)) > -1e-3
    assert lowest(0.7 * critical(k, inertia)) < -1e-2


# --- the null space --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["allegro_left", "dlr_hit_right"])
def test_what_is_free_moves_no_tip_and_only_that_is_kept(name):
    hand = load_hand(name)
    for joints in postures(hand):
        J = jacobian(hand, joints)
        N, smallest = projector(J), np.linalg.svd(J, compute_uv=False)[np.linalg.matrix_rank(J) - 1]
        assert smallest > 0.005
        assert np.abs(J @ N).max() < 1e-6 / smallest  # λ²/σ
        np.testing.assert_allclose(N, N.T, atol=1e-12)
        loose = np.linalg.svd(J)[2][np.linalg.matrix_rank(J) :]
        np.testing.assert_allclose(N @ loose.T, loose.T, atol=1e-9)


def test_a_small_step_within_what_is_free_leaves_the_tips_to_second_order():
    joints = postures(LEFT)[0]
    N = projector(jacobian(LEFT, joints))
    step = N @ np.random.default_rng(0).normal(size=16)
    tips = frames(LEFT, WRIST, joints)[0]
    moved = [np.abs(frames(LEFT, WRIST, joints + h * step)[0] - tips).max() for h in (0.4, 0.2)]
    assert 3.4 < moved[0] / moved[1] < 4.6
    other = (np.eye(16) - N) @ np.ones(16)
    assert np.abs(frames(LEFT, WRIST, joints + 0.2 * other)[0] - tips).max() > 10 * moved[1]


def test_the_posture_makes_no_force_at_tips_that_are_held():
    rng = np.random.default_rng(1)
    for joints in postures(LEFT):
        J = jacobian(LEFT, joints)
        torque = freed(J, joint_torque(rng.normal(size=16), rng.normal(size=16), 0.1, 0.02))
        force = np.linalg.solve(J @ J.T, J @ torque)  # what holds the tips: least squares of Jᵀ f = τ
        assert np.abs(torque).max() > 0.01
        assert np.abs(force).max() < 0.02


def test_it_is_the_projection_of_spring_and_damper():
    joints = postures(LEFT)[1]
    J, error, speed = jacobian(LEFT, joints), np.linspace(-0.3, 0.3, 16), np.linspace(1.0, -1.0, 16)
    wanted = 0.2 * error - 0.05 * speed
    exact = wanted - np.linalg.pinv(J) @ J @ wanted
    np.testing.assert_allclose(freed(J, joint_torque(error, speed, 0.2, 0.05)), exact, atol=2e-3)


def test_a_stretched_finger_makes_no_torque_that_is_larger_than_the_springs():
    joints = LEFT.reference.copy()
    joints[:] = np.clip(0.0, LEFT.lower, LEFT.upper)  # straight fingers
    J = jacobian(LEFT, joints)
    assert np.linalg.svd(J, compute_uv=False).min() < 1e-3
    N = projector(J)
    assert np.isfinite(N).all()
    assert np.linalg.norm(N, 2) < 1 + 1e-9


def test_fingers_that_share_no_joint_have_each_its_own():
    N = projector(jacobian(LEFT, postures(LEFT)[2]))
    for first in range(0, 16, 4):
        apart = np.delete(np.arange(16), range(first, first + 4))
        np.testing.assert_allclose(N[first : first + 4, apart], 0.0, atol=1e-9)


# --- its numbers -----------------------------------------------------------------------------------------------------


def test_weight_points_down_and_is_that_of_the_plan():
    assert Law().gravity == (0.0, 0.0, -GRAVITY)


@pytest.mark.parametrize("wrong", [{"control": "force"}, {"tip_mass": 0.0}, {"joint_inertia": -1.0}])
def test_a_law_that_makes_no_sense_is_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong)).replace("_", "-")):
        Law(**wrong)


@pytest.mark.parametrize("wrong", [(0, -9.81), (), (0, 0, 0, -9.81), -9.81, "down", (0, 0, np.nan)])
def test_gravity_that_is_not_three_numbers_is_refused(wrong):
    with pytest.raises(InputError, match=r"--law.gravity must be"):
        Law(gravity=wrong)


def test_gravity_may_be_an_array():
    assert Law(gravity=np.array([0, 0, -1])) == Law(gravity=(0.0, 0.0, -1.0))
