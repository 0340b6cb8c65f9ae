"""The control of the hand: setpoints that ramp, a posture that no tip feels, joints under position control."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from grips import box, faces, grip
from hands import coupled

from sgnlp.base.errors import InputError
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.simulation import SimulationSettings
from sgnlp.simulation.control import critical, null_space, posture_torque, ramped
from sgnlp.simulation.settings import SAMPLE

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


# --- the null space --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["allegro_left", "dlr_hit_right"])
def test_what_is_free_moves_no_tip_and_only_that_is_kept(name):
    hand = load_hand(name)
    for joints in postures(hand):
        J = jacobian(hand, joints)
        N, smallest = null_space(J), np.linalg.svd(J, compute_uv=False)[np.linalg.matrix_rank(J) - 1]
        assert smallest > 0.005
        assert np.abs(J @ N).max() < 1e-6 / smallest  # λ²/σ
        np.testing.assert_allclose(N, N.T, atol=1e-12)
        loose = np.linalg.svd(J)[2][np.linalg.matrix_rank(J) :]
        np.testing.assert_allclose(N @ loose.T, loose.T, atol=1e-9)


def test_a_small_step_within_what_is_free_leaves_the_tips_to_second_order():
    joints = postures(LEFT)[0]
    N = null_space(jacobian(LEFT, joints))
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
        torque = posture_torque(null_space(J), rng.normal(size=16), rng.normal(size=16), 0.1, 0.02)
        force = np.linalg.solve(J @ J.T, J @ torque)  # what holds the tips: least squares of Jᵀ f = τ
        assert np.abs(torque).max() > 0.01
        assert np.abs(force).max() < 0.02


def test_it_is_the_projection_of_spring_and_damper():
    joints = postures(LEFT)[1]
    J, error, speed = jacobian(LEFT, joints), np.linspace(-0.3, 0.3, 16), np.linspace(1.0, -1.0, 16)
    wanted = 0.2 * error - 0.05 * speed
    exact = wanted - np.linalg.pinv(J) @ J @ wanted
    np.testing.assert_allclose(posture_torque(null_space(J), error, speed, 0.2, 0.05), exact, atol=2e-3)


def test_a_stretched_finger_makes_no_torque_that_is_larger_than_the_springs():
    joints = LEFT.reference.copy()
    joints[:] = np.clip(0.0, LEFT.lower, LEFT.upper)  # straight fingers
    J = jacobian(LEFT, joints)
    assert np.linalg.svd(J, compute_uv=False).min() < 1e-3
    N = null_space(J)
    assert np.isfinite(N).all()
    assert np.linalg.norm(N, 2) < 1 + 1e-9


def test_fingers_that_share_no_joint_have_each_its_own():
    N = null_space(jacobian(LEFT, postures(LEFT)[2]))
    for first in range(0, 16, 4):
        apart = np.delete(np.arange(16), range(first, first + 4))
        np.testing.assert_allclose(N[first : first + 4, apart], 0.0, atol=1e-9)


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


# --- in the simulator ------------------------------------------------------------------------------------------------

mujoco = pytest.importorskip("mujoco")
from sgnlp.simulation.protocol import Experiment  # noqa: E402
from sgnlp.simulation.world import HAND  # noqa: E402

SETTINGS = SimulationSettings()
GRIP = grip(LEFT, *faces(0.06, 0.045))
INWARDS = (LEFT.lower + LEFT.upper) / 2 - GRIP.joints
"""Away from the joint limits."""
HELD = replace(GRIP, joints_contact=GRIP.joints + 0.3, posture=0.5)


def sampled(run: Experiment, count: int) -> None:
    for _ in zip(range(count), run.close(), strict=False):
        pass


def efforts(run: Experiment, hand: Hand) -> np.ndarray:
    """Torque of the actuators of the hand's own joints [N m]."""
    dofs = [run.world.model.joint(HAND + name).dofadr[0] for name in hand.joint_names]
    return run.data.qfrc_actuator[dofs]


def test_the_setpoints_of_the_springs_are_on_their_way_in_proportion_to_the_time():
    run = Experiment(replace(GRIP, closing_seconds=0.4), box(), LEFT, SETTINGS)
    sampled(run, 10)
    share = (10 * SAMPLE - SETTINGS.timestep) / 0.4  # those of the last step
    expected = GRIP.tips + share * (GRIP.targets - GRIP.tips)
    np.testing.assert_allclose(run.data.ctrl.reshape(4, 3), expected, atol=1e-12)
    sampled(run, 31)
    np.testing.assert_array_equal(run.data.ctrl.reshape(4, 3), GRIP.targets)


def test_the_tips_jacobian_of_the_simulator_is_that_of_the_planned_hand():
    run = Experiment(GRIP, box(), LEFT, SETTINGS)
    expected = jacobian(LEFT, GRIP.joints, GRIP.wrist)
    np.testing.assert_allclose(run.world.tip_jacobian(run.data), expected, atol=1e-7)


def test_joints_that_mimic_are_in_the_jacobian_of_those_that_they_follow(tmp_path):
    hand = load_hand(coupled(tmp_path))
    tips = frames(hand, WRIST, hand.reference)[0]
    told = replace(GRIP, wrist=WRIST, joints=hand.reference, tips=tips, targets=tips, gains=np.full(3, 200.0))
    run = Experiment(replace(told, forces_eq=None, contacts_eq=None), box(), hand, SETTINGS)
    expected = jacobian(hand, hand.reference)
    assert expected.shape == (9, len(hand.joint_names))
    np.testing.assert_allclose(run.world.tip_jacobian(run.data), expected, atol=1e-7)


def test_the_torques_are_those_of_springs_and_posture_together():
    run = Experiment(replace(HELD, closing_seconds=0.0), box(), LEFT, SETTINGS)
    J = run.world.tip_jacobian(run.data)
    springs = J.T @ (np.repeat(GRIP.gains, 3) * (GRIP.targets - GRIP.tips).ravel())
    posture = posture_torque(null_space(J), np.full(16, 0.3), np.zeros(16), 0.5, 0.0)
    assert np.abs(posture).max() > 0.05
    np.testing.assert_allclose(efforts(run, LEFT), np.clip(springs + posture, -0.7, 0.7), atol=1e-6)


def test_the_posture_is_damped_critically_for_the_rotor():
    run = Experiment(HELD, box(), LEFT, SETTINGS)
    run.data.qvel[run.world.hand_speeds] = speed = np.linspace(-0.5, 0.5, 16)
    run.controller.act(run.data)
    N, damping = null_space(run.world.tip_jacobian(run.data)), 2 * np.sqrt(0.5 * SETTINGS.joint_armature)
    np.testing.assert_allclose(run.data.ctrl[12:], N @ (0.5 * 0.3 - damping * speed), atol=1e-9)


def test_springs_and_posture_together_give_no_more_torque_than_the_hand_can():
    run = Experiment(replace(HELD, gains=np.full(4, 1000.0), posture=50.0, closing_seconds=0.0), box(), LEFT, SETTINGS)
    assert np.abs(run.data.ctrl[12:]).max() > 1.0
    found = efforts(run, LEFT)
    assert np.abs(found).max() == pytest.approx(0.7)
    assert (np.abs(found) > 0.7 - 1e-9).sum() > 3


def test_the_posture_turns_what_the_tips_leave_free_towards_the_planned_joints_and_leaves_the_tips():
    loose = replace(SETTINGS, joint_friction=0.0)
    still = replace(GRIP, targets=GRIP.tips, gains=np.full(4, 400.0), closing_seconds=0.0)
    J = jacobian(LEFT, GRIP.joints, GRIP.wrist)
    free = np.linalg.svd(J)[2][12:]  # the four free motions, away from the limits
    aim = GRIP.joints + 0.2 * np.sign(free @ INWARDS) @ free
    run = Experiment(replace(still, joints_contact=aim, posture=0.3), box(), LEFT, loose)
    readings = [*run.close(), *run.hold()]
    left = np.linalg.norm(aim - run.data.qpos[run.world.hand_joints]) / np.linalg.norm(aim - GRIP.joints)
    assert left < 0.3
    assert np.abs(readings[-1].tips - GRIP.tips).max() < 5e-4


def test_without_planned_joints_or_stiffness_no_posture_is_held():
    for told in (replace(GRIP, posture=0.5), replace(HELD, posture=0.0)):
        assert Experiment(told, box(), LEFT, SETTINGS).world.model.nu == 12
    assert Experiment(HELD, box(), LEFT, SETTINGS).world.model.nu == 12 + 16


# --- position control ------------------------------------------------------------------------------------------------

POSITION = replace(SETTINGS, control="position")
SQUEEZED = replace(GRIP, joints_squeeze=GRIP.joints + 0.1, joint_stiffness=3.0, closing_seconds=0.4)


def test_under_position_control_each_joint_is_a_spring_whose_setpoint_ramps_to_the_squeezing_joints():
    run = Experiment(SQUEEZED, box(), LEFT, POSITION)
    assert run.world.model.nu == 16
    np.testing.assert_array_equal(run.data.ctrl, GRIP.joints)
    np.testing.assert_allclose(efforts(run, LEFT), 0.0, atol=1e-12)
    run.data.qvel[run.world.hand_speeds] = speed = np.linspace(-0.5, 0.5, 16)
    run.data.time = 0.2
    run.controller.act(run.data)
    mujoco.mj_forward(run.world.model, run.data)
    damping = 2 * np.sqrt(3.0 * SETTINGS.joint_armature)
    np.testing.assert_allclose(efforts(run, LEFT), 3.0 * 0.05 - damping * speed, atol=1e-9)


def test_under_position_control_the_effort_is_the_limit_too():
    run = Experiment(replace(SQUEEZED, joint_stiffness=100.0, closing_seconds=0.0), box(), LEFT, POSITION)
    np.testing.assert_allclose(efforts(run, LEFT), 0.7)


def test_under_position_control_the_joints_come_to_rest_where_they_are_sent():
    aim = GRIP.joints + 0.03 * np.sign(INWARDS)
    run = Experiment(replace(SQUEEZED, joints_squeeze=aim), box(), LEFT, POSITION)
    *_, _ = run.close()
    sag = SETTINGS.joint_friction / SQUEEZED.joint_stiffness
    np.testing.assert_allclose(run.data.qpos[run.world.hand_joints], aim, atol=1.1 * sag)


def test_position_control_of_a_plan_without_joints_is_refused():
    with pytest.raises(InputError, match=r"--simulation.control position needs a plan of the joints at contact"):
        Experiment(GRIP, box(), LEFT, POSITION)


def test_an_unknown_control_is_refused():
    with pytest.raises(InputError, match="impedance, position"):
        replace(SETTINGS, control="force")


def test_turns_are_those_of_pinocchio():
    """The twin of the Jacobian by differences."""
    data, joints = LEFT.model.createData(), postures(LEFT)[0]
    pin.computeJointJacobians(LEFT.model, data, joints)
    pin.updateFramePlacements(LEFT.model, data)
    own = [
        pin.getFrameJacobian(LEFT.model, data, LEFT.model.getFrameId(f.frame), pin.LOCAL_WORLD_ALIGNED)[:3]
        for f in LEFT.fingers
    ]
    np.testing.assert_allclose(jacobian(LEFT, joints), np.concatenate(own), atol=1e-8)
