"""The hand in the simulator does what its controller says, and no more than its motors can."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco")

import mujoco
from grips import box, faces, grip
from hands import coupled

from sgnlp.base.errors import InputError
from sgnlp.control.controller import Controller
from sgnlp.control.law import WEIGHTLESS, critical, freed
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.hand.kinematics import tip_jacobian, tips
from sgnlp.simulation import SimulationSettings
from sgnlp.simulation.protocol import Experiment, law
from sgnlp.simulation.settings import SAMPLE
from sgnlp.simulation.world import HAND

LEFT = load_hand("allegro_left")
WRIST = np.array([0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0])
SETTINGS = SimulationSettings()
GRIP = grip(LEFT, *faces(0.06, 0.045))
INWARDS = (LEFT.lower + LEFT.upper) / 2 - GRIP.joints
"""Away from the joint limits."""
HELD = replace(GRIP, joints_contact=GRIP.joints + 0.3, posture=0.5)
J = tip_jacobian(LEFT, GRIP.wrist, GRIP.joints)


def sampled(run: Experiment, count: int) -> None:
    for _ in zip(range(count), run.close(), strict=False):
        pass


def efforts(run: Experiment, hand: Hand) -> np.ndarray:
    """Torque of the motors of the hand's own joints [N m]."""
    dofs = [run.world.model.joint(HAND + name).dofadr[0] for name in hand.joint_names]
    return run.data.qfrc_actuator[dofs]


def moving(run: Experiment, speed: np.ndarray, time: float = 0.0) -> np.ndarray:
    """What the motors do at another speed and time."""
    run.data.qvel[run.world.hand_speeds], run.data.time = speed, time
    run.act()
    mujoco.mj_forward(run.world.model, run.data)
    return efforts(run, LEFT)


def test_in_each_step_the_motors_get_the_torques_of_the_controller_for_the_state_at_its_begin(monkeypatch):
    asked, torques = [], Controller.torques

    def noted(self, time, wrist, joints, speeds):
        asked.append((time, wrist.copy(), joints.copy(), speeds.copy(), torques(self, time, wrist, joints, speeds)))
        return asked[-1][-1]

    run = Experiment(replace(HELD, closing_seconds=0.4), box(), LEFT, SETTINGS)
    monkeypatch.setattr(Controller, "torques", noted)
    sampled(run, 5)
    steps = round(5 * SAMPLE / SETTINGS.timestep)
    assert [row[0] for row in asked] == pytest.approx([i * SETTINGS.timestep for i in range(steps)])
    time, wrist, joints, speeds, told = asked[-1]
    np.testing.assert_allclose(wrist, GRIP.wrist, atol=1e-9)
    np.testing.assert_allclose(efforts(run, LEFT), told, atol=1e-12)
    now = run.data.qpos[run.world.hand_joints]
    np.testing.assert_allclose(now - joints, SETTINGS.timestep * run.data.qvel[run.world.hand_speeds], atol=1e-9)
    assert np.abs(now - joints).max() > 1e-6
    assert np.abs(speeds).max() > 1e-3
    again = Controller(LEFT, replace(HELD, closing_seconds=0.4), law(SETTINGS))
    np.testing.assert_array_equal(torques(again, time, wrist, joints, speeds), told)


def test_the_controller_sees_the_wrist_where_the_lift_has_brought_it():
    run = Experiment(GRIP, box(), LEFT, replace(SETTINGS, lift_height=0.1))
    for _ in run.lift():
        pass
    mujoco.mj_fwdPosition(run.world.model, run.data)
    np.testing.assert_allclose(run.world.wrist(run.data), np.add(GRIP.wrist, [0, 0, 0.1, 0, 0, 0, 0]), atol=5e-4)


def test_the_simulator_bears_the_hand_and_the_controller_does_not():
    assert law(SETTINGS).gravity == WEIGHTLESS
    run = Experiment(replace(GRIP, targets=GRIP.tips), box(), LEFT, SETTINGS)
    np.testing.assert_allclose(efforts(run, LEFT), 0.0, atol=1e-9)


def test_the_torques_are_those_of_springs_and_posture_together():
    run = Experiment(replace(HELD, closing_seconds=0.0), box(), LEFT, SETTINGS)
    springs = J.T @ (np.repeat(GRIP.gains, 3) * (GRIP.targets - GRIP.tips).ravel())
    posture = freed(J, np.full(16, 0.5 * 0.3))
    assert np.abs(posture).max() > 0.05
    np.testing.assert_allclose(efforts(run, LEFT), np.clip(springs + posture, -0.7, 0.7), atol=1e-6)


def test_the_posture_is_damped_critically_for_the_rotor():
    settings = replace(SETTINGS, joint_armature=2e-3)
    run = Experiment(replace(HELD, targets=GRIP.tips), box(), LEFT, settings)
    speed = np.linspace(-0.05, 0.05, 16)
    springs = -J.T @ (np.repeat(critical(GRIP.gains, 1.0), 3) * (J @ speed))
    expected = springs + freed(J, 0.5 * 0.3 - 2 * np.sqrt(0.5 * 2e-3) * speed)
    np.testing.assert_allclose(moving(run, speed), expected, atol=1e-7)


def test_springs_and_posture_together_give_no_more_torque_than_the_hand_can():
    run = Experiment(replace(HELD, gains=np.full(4, 1000.0), posture=50.0, closing_seconds=0.0), box(), LEFT, SETTINGS)
    found = efforts(run, LEFT)
    assert np.abs(found).max() == pytest.approx(0.7)
    assert (np.abs(found) > 0.7 - 1e-9).sum() > 3


def test_joints_that_mimic_have_no_motor(tmp_path):
    hand = load_hand(coupled(tmp_path))
    begin = tips(hand, WRIST, hand.reference)
    told = replace(GRIP, wrist=WRIST, joints=hand.reference, tips=begin, targets=begin, gains=np.full(3, 200.0))
    run = Experiment(replace(told, forces_eq=None, contacts_eq=None), box(), hand, SETTINGS)
    assert run.world.model.nu == len(hand.joint_names) == 8
    assert run.begin.torques.shape == (8,)


def test_the_posture_turns_what_the_tips_leave_free_towards_the_planned_joints_and_leaves_the_tips():
    loose = replace(SETTINGS, joint_friction=0.0)
    still = replace(GRIP, targets=GRIP.tips, gains=np.full(4, 400.0), closing_seconds=0.0)
    free = np.linalg.svd(J)[2][12:]  # the four free motions, away from the limits
    aim = GRIP.joints + 0.2 * np.sign(free @ INWARDS) @ free
    run = Experiment(replace(still, joints_contact=aim, posture=0.3), box(), LEFT, loose)
    readings = [*run.close(), *run.hold()]
    left = np.linalg.norm(aim - run.data.qpos[run.world.hand_joints]) / np.linalg.norm(aim - GRIP.joints)
    assert left < 0.3
    assert np.abs(readings[-1].tips - GRIP.tips).max() < 5e-4


def steepest(joints: np.ndarray, step: float) -> float:
    """h λ of steps h [s], λ the largest eigenvalue of the damping over the inertia, all gains the largest of a plan."""
    run = Experiment(replace(GRIP, joints=joints), box(), LEFT, SETTINGS)
    full = np.zeros((run.world.model.nv, run.world.model.nv))
    mujoco.mj_fullM(run.world.model, run.data, full)
    own = np.ix_(run.world.hand_speeds, run.world.hand_speeds)
    inertia = full[own] + step * SETTINGS.joint_damping * np.eye(16)  # its own damping is implicit
    J = tip_jacobian(LEFT, GRIP.wrist, joints)
    return step * np.linalg.eigvals(np.linalg.solve(inertia, J.T @ J)).real.max() * critical(LEFT.gain_upper.max(), 1.0)


def test_a_step_is_short_enough_for_damping_by_the_speed_at_its_begin():
    """Explicit steps bear h λ < 2; the numbers are those of docs/pages/howto/controller.md."""
    assert steepest(GRIP.joints, SETTINGS.timestep) == pytest.approx(0.7, abs=0.1)
    assert steepest(GRIP.joints, 2 * SETTINGS.timestep) == pytest.approx(1.3, abs=0.1)
    assert steepest(np.clip(0.0, LEFT.lower, LEFT.upper), SETTINGS.timestep) < 1.1  # stretched


# --- position control ------------------------------------------------------------------------------------------------

POSITION = replace(SETTINGS, control="position")
SQUEEZED = replace(GRIP, joints_squeeze=GRIP.joints + 0.1, joint_stiffness=3.0, closing_seconds=0.4)


def test_under_position_control_each_joint_is_a_spring_whose_setpoint_ramps_to_the_squeezing_joints():
    run = Experiment(SQUEEZED, box(), LEFT, POSITION)
    assert run.world.model.nu == 16
    np.testing.assert_allclose(efforts(run, LEFT), 0.0, atol=1e-12)
    speed, damping = np.linspace(-0.5, 0.5, 16), 2 * np.sqrt(3.0 * SETTINGS.joint_armature)
    np.testing.assert_allclose(moving(run, speed, 0.2), 3.0 * 0.05 - damping * speed, atol=1e-9)


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
    with pytest.raises(InputError, match=r"position control needs the command's `joints_squeeze`"):
        Experiment(GRIP, box(), LEFT, POSITION)


def test_an_unknown_control_is_refused():
    with pytest.raises(InputError, match="impedance, position"):
        replace(SETTINGS, control="force")
