"""The simulator: sane grasps hold and bad ones do not; forces, energy and the step are sane; every run is the same."""

import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

pytest.importorskip("mujoco")

import mujoco
from grips import GAINS, box, cylinder, faces, grip, ring, sphere
from hands import coupled

from sgnlp.base.errors import InputError
from sgnlp.hand.hand import load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.simulation import SimulationSettings, body, execute
from sgnlp.simulation.protocol import Experiment
from sgnlp.simulation.world import HAND

UP = np.array([0.0, 0.0, 1.0])
HAND_LEFT = load_hand("allegro_left")
SETTINGS = SimulationSettings()
BODIES = {"sphere": sphere(), "cylinder": cylinder(), "box": box()}
PLACES = {"sphere": ring(0.035, 0.035), "cylinder": ring(0.033, 0.045), "box": faces(0.06, 0.045)}
GRIPS = {name: grip(HAND_LEFT, *places) for name, places in PLACES.items()}
FAST = replace(SETTINGS, push_weights=0.0, hold_time=0.5)
BRIEF = replace(SETTINGS, push_time=0.3, hold_time=0.5, lift_time=0.5)
"""All phases in a third of the time."""


@pytest.fixture(scope="module")
def outcomes():
    return {name: execute(GRIPS[name], BODIES[name], HAND_LEFT, SETTINGS) for name in BODIES}


@pytest.fixture(scope="module")
def brief():
    return {name: execute(GRIPS[name], BODIES[name], HAND_LEFT, BRIEF) for name in ("sphere", "box")}


@pytest.mark.parametrize("name", BODIES)
def test_a_sane_grasp_holds_against_every_push(outcomes, name):
    outcome = outcomes[name]
    assert outcome.ending == "held"
    assert outcome.score == outcome.score_strict == 1.0
    assert outcome.pushes_held == 6
    assert outcome.closing.rested
    assert outcome.closing.premature == ()
    assert np.all(outcome.closing.contact_times > 0.05)
    assert outcome.lift.slip.max() < 1e-3


@pytest.mark.parametrize("name", BODIES)
def test_a_held_object_creeps_by_less_than_a_tenth_of_a_millimetre_a_second(outcomes, name):
    assert outcomes[name].lift.creep < 1e-4


@pytest.mark.parametrize("name", BODIES)
def test_the_pads_of_a_held_object_bear_its_weight(outcomes, name):
    trace = outcomes[name].trace
    total = trace.forces[trace.phase == "hold"].sum(axis=1).mean(axis=0)
    np.testing.assert_allclose(total, [0, 0, SETTINGS.mass * GRAVITY], atol=0.02 * SETTINGS.mass * GRAVITY)


@pytest.mark.parametrize("name", BODIES)
def test_the_forces_are_those_of_the_plan_but_for_friction(outcomes, name):
    normals = PLACES[name][1]
    pressed = -np.einsum("mi,mi->m", outcomes[name].closing.forces, normals)
    planned = -np.einsum("mi,mi->m", GRIPS[name].forces_eq, normals)
    np.testing.assert_allclose(pressed, planned, rtol=0.25)
    assert outcomes[name].closing.shift_error < 2e-3


@pytest.mark.parametrize("name", ["sphere", "box"])
def test_half_the_step_gives_the_same_outcome(brief, name):
    finer = replace(BRIEF, timestep=BRIEF.timestep / 2)
    whole, half = brief[name], execute(GRIPS[name], BODIES[name], HAND_LEFT, finer)
    assert half.ending == whole.ending
    assert half.score_strict == whole.score_strict
    assert half.pushes_held == whole.pushes_held
    np.testing.assert_allclose(half.lift.rise, whole.lift.rise, atol=5e-4)
    np.testing.assert_allclose(half.closing.forces, whole.closing.forces, atol=0.5)


BAD = {
    "targets outside": (replace(GRIPS["box"], targets=GRIPS["box"].targets + 0.08 * PLACES["box"][1]), SETTINGS),
    "gain 1": (replace(GRIPS["box"], gains=np.ones(4)), SETTINGS),
    "friction 0.05": (GRIPS["box"], replace(SETTINGS, friction=0.05)),
    "5 kg": (GRIPS["box"], replace(SETTINGS, mass=5.0)),
}


@pytest.mark.parametrize("why", BAD)
def test_a_bad_grasp_does_not_lift(why):
    command, settings = BAD[why]
    outcome = execute(command, BODIES["box"], HAND_LEFT, settings)
    assert outcome.ending == "not lifted"
    assert outcome.score == outcome.score_strict == 0.0
    assert outcome.pushes == ()


def test_a_light_object_that_slides_scores_a_half():
    strict = replace(FAST, slip_limit=1e-6)
    outcome = execute(GRIPS["box"], BODIES["box"], HAND_LEFT, strict)
    assert (outcome.ending, outcome.score) == ("slid", 0.5)


def test_a_rise_of_less_than_the_strict_one_scores_only_in_the_other():
    outcome = execute(GRIPS["box"], BODIES["box"], HAND_LEFT, replace(FAST, lift_height=0.03))
    assert (outcome.score, outcome.score_strict) == (1.0, 0.0)


def test_the_same_arguments_give_the_same_bits(brief):
    arguments = pickle.loads(pickle.dumps((GRIPS["sphere"], BODIES["sphere"], BRIEF)))
    again = execute(arguments[0], arguments[1], HAND_LEFT, arguments[2])
    assert pickle.dumps(again) == pickle.dumps(brief["sphere"])


def test_the_wrist_rises_by_the_height_asked_for_whatever_it_holds(outcomes):
    trace = outcomes["box"].trace
    np.testing.assert_allclose(trace.qpos[trace.phase == "hold", 0], SETTINGS.lift_height, atol=5e-5)


@pytest.mark.parametrize("down", [0.5, 4.0])
def test_a_pregrasp_inside_the_object_is_refused(down):
    wrist = GRIPS["sphere"].wrist - [0, 0, 0.01 * down, 0, 0, 0, 0]
    outcome = execute(replace(GRIPS["sphere"], wrist=wrist), BODIES["sphere"], HAND_LEFT, FAST)
    assert (outcome.ending == "in collision") == (down > 1)
    assert (outcome.pregrasp.penetration_object > SETTINGS.max_penetration) == (down > 1)
    assert (outcome.closing is None) == (down > 1)


def test_a_pregrasp_inside_the_table_is_refused():
    lowered = replace(GRIPS["box"], wrist=GRIPS["box"].wrist - [0, 0, 0.045, 0, 0, 0, 0])
    depth = SETTINGS.max_penetration
    outcome = execute(lowered, BODIES["box"], HAND_LEFT, FAST)
    tips, _ = frames(HAND_LEFT, lowered.wrist, lowered.joints)
    assert outcome.ending == "in collision"
    assert outcome.pregrasp.penetration_table >= 0.012 - tips[:, 2].min() - 1e-6 > depth


def test_an_object_given_above_the_table_falls_onto_it_first():
    held = replace(BODIES["box"], vertices=BODIES["box"].vertices + 0.01 * UP)
    outcome = execute(GRIPS["box"], held, HAND_LEFT, replace(FAST, close_time=0.5))
    assert outcome.pregrasp.settle_shift == pytest.approx(0.01, abs=2e-4)
    assert outcome.pregrasp.settle_turn < 1e-3


def experiment(name="box", settings=SETTINGS, **changes):
    return Experiment(replace(GRIPS[name], **changes), BODIES[name], HAND_LEFT, settings)


def test_a_push_moves_the_object_its_way_and_leaves_nothing_behind():
    run = experiment()
    *_, before = (*run.close(), *run.lift())
    state = run.data.qpos.copy()
    for direction, along in {"+x": (1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}.items():
        *_, after = run.push(direction)
        assert (after.centre - before.centre) @ along > 1e-6
        np.testing.assert_array_equal(run.data.qpos, state)
        assert not run.data.xfrc_applied.any()


def test_the_torques_are_those_of_the_impedance_control():
    run = experiment(targets=GRIPS["box"].targets + 0.01 * UP, closing_seconds=0.0)
    for _ in zip(range(5), run.close(), strict=False):
        pass
    model, data, n = run.world.model, run.data, len(HAND_LEFT.joint_names)
    mujoco.mj_fwdPosition(model, data)
    run.act()
    mujoco.mj_forward(model, data)
    speed = np.array([data.qvel[model.joint(HAND + name).dofadr[0]] for name in HAND_LEFT.joint_names])
    torque = np.array([data.qfrc_actuator[model.joint(HAND + name).dofadr[0]] for name in HAND_LEFT.joint_names])
    pinned, joints = HAND_LEFT.model.createData(), data.qpos[run.world.hand_joints]
    pin.computeJointJacobians(HAND_LEFT.model, pinned, joints)
    pin.updateFramePlacements(HAND_LEFT.model, pinned)
    turn = pin.XYZQUATToSE3(GRIPS["box"].wrist).rotation
    tips, _ = frames(HAND_LEFT, GRIPS["box"].wrist, joints)
    expected = np.zeros(n)
    for i, finger in enumerate(HAND_LEFT.fingers):
        frame = HAND_LEFT.model.getFrameId(finger.frame)
        J = turn @ pin.getFrameJacobian(HAND_LEFT.model, pinned, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
        k = GAINS[i]
        expected += J.T @ (k * (GRIPS["box"].targets[i] + 0.01 * UP - tips[i]) - 2 * np.sqrt(k) * J @ speed)
    assert np.abs(speed).max() > 0.05
    np.testing.assert_allclose(torque, expected, atol=1e-10)


def test_no_joint_gives_more_torque_than_the_hand_can():
    run = experiment(gains=np.full(4, 2000.0), closing_seconds=0.0)
    assert np.abs(run.data.qfrc_actuator[1:17]).max() == pytest.approx(0.7)
    assert run.begin.torques.max() == pytest.approx(1.0)


def test_closing_only_loses_energy():
    run = experiment("sphere", closing_seconds=0.0)

    def energy():
        data, out = run.data, np.zeros(run.world.model.nv)
        mujoco.mj_mulM(run.world.model, data, out, data.qvel)
        stretch = GRIPS["sphere"].targets - data.site_xpos[run.world.tips]
        spring = 0.5 * GRIPS["sphere"].gains @ (stretch**2).sum(axis=1)
        return spring + 0.5 * data.qvel @ out + SETTINGS.mass * GRAVITY * data.xipos[run.world.object_body][2]

    energies = [energy()]
    for _ in run.close():
        mujoco.mj_forward(run.world.model, run.data)
        energies.append(energy())
    assert energies[-1] < energies[0] - 0.05
    assert np.diff(energies).max() < 1e-3 * energies[0]  # what the contacts gave way comes back


def test_the_hand_stands_still_where_its_springs_are_slack():
    tips, _ = frames(HAND_LEFT, GRIPS["box"].wrist, GRIPS["box"].joints)
    run = experiment(targets=tips)
    begin = run.data.qpos[run.world.hand_joints].copy()
    assert len(list(run.close())) == 100 + 20
    np.testing.assert_allclose(run.data.qpos[run.world.hand_joints], begin, atol=1e-6)


def test_the_object_has_the_mass_and_inertia_of_an_even_box():
    model, thing = experiment(settings=replace(SETTINGS, mass=0.3)).world.model, "object"
    x, y, z = np.ptp(BODIES["box"].vertices, axis=0)
    expected = 0.3 / 12 * np.array([y**2 + z**2, x**2 + z**2, x**2 + y**2])
    assert model.body(thing).mass[0] == pytest.approx(0.3)
    np.testing.assert_allclose(np.sort(model.body(thing).inertia), np.sort(expected), rtol=1e-5)


def test_a_command_of_another_hand_is_refused():
    with pytest.raises(InputError, match=r"joints must be \(16,\)"):
        execute(replace(GRIPS["box"], joints=np.zeros(9)), BODIES["box"], HAND_LEFT, FAST)


@pytest.mark.parametrize("name", ["allegro_right", "dlr_hit_right", "tests/golden/three_fingers"])
def test_any_hand_can_be_simulated(name, request):
    hand = load_hand(request.config.rootpath / name if "/" in name else name)
    tips, _ = frames(hand, np.array([0, 0, 0.4, 0, 0, 0, 1.0]), hand.reference)
    command = replace(
        GRIPS["box"],
        wrist=np.array([0, 0, 0.4, 0, 0, 0, 1.0]),
        joints=hand.reference,
        tips=tips,
        targets=tips,
        contacts_eq=None,
        gains=np.full(len(tips), 100.0),
        forces_eq=None,
    )
    outcome = execute(command, body(BODIES["box"].vertices, BODIES["box"].faces), hand, FAST)
    assert outcome.ending == "not lifted"
    np.testing.assert_allclose(outcome.trace.tips[0], tips, atol=1e-9)


def test_mimic_joints_follow_in_the_simulation_too(tmp_path):
    hand = load_hand(coupled(tmp_path))
    wrist = np.array([0, 0, 0.4, 0, 0, 0, 1.0])
    bent = np.clip(hand.reference + 0.2, hand.lower, hand.upper)
    tips, pulled = (frames(hand, wrist, joints)[0] for joints in (hand.reference, bent))
    command = replace(GRIPS["box"], wrist=wrist, joints=hand.reference, tips=tips, targets=pulled)
    run = Experiment(replace(command, gains=np.full(3, 200.0), forces_eq=None), BODIES["box"], hand, FAST)
    np.testing.assert_allclose(run.data.site_xpos[run.world.tips], tips, atol=1e-9)
    *_, _ = run.close()
    angles = run.data.qpos[run.world.hand_joints]
    follow = hand.moving_joints.index("b_curl")
    assert abs(angles[follow] - hand.moving_angles(hand.reference)[follow]) > 0.01
    np.testing.assert_allclose(angles, hand.moving_angles(angles[: len(hand.joint_names)]), atol=1e-3)
