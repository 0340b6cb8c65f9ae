"""The whole motion in the simulator: an arm that follows it, a wrist that floats along it, and what they hit."""

import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

pytest.importorskip("mujoco")

import mujoco
from grips import box, faces, grip
from motions import motion

from sgnlp.base.errors import InputError
from sgnlp.hand.arm_kinematics import gravity_torques, wrist_pose
from sgnlp.hand.hand import load_hand
from sgnlp.perception.shape import Shape
from sgnlp.simulation import SimulationSettings, execute
from sgnlp.simulation.displacement import erred
from sgnlp.simulation.obstacles import OBSTACLE, add_obstacles
from sgnlp.simulation.prepared import prepared
from sgnlp.simulation.protocol import Experiment
from sgnlp.simulation.route import route
from sgnlp.simulation.scene import OBJECT, add_object, compiled, empty_scene

FLOATING = load_hand("allegro_left")
CARRIED = load_hand("allegro_left", arm="panda")
TOLD = grip(FLOATING, *faces(0.06, 0.045))
SETTINGS = SimulationSettings(push_weights=0.0, hold_time=0.2)
COMING = motion(FLOATING, TOLD.wrist)
LIFT = 0.06
"""Height of the motions [m]."""


@pytest.fixture(scope="module")
def carried():
    return motion(CARRIED, TOLD.wrist)


@pytest.fixture(scope="module")
def lifted(carried):
    return execute(TOLD, box(), CARRIED, SETTINGS, (), carried)


def experiment(made, hand, obstacles=(), settings=SETTINGS):
    told = prepared(TOLD, hand, settings, made)
    return Experiment(told.command, box(), told.hand, settings, obstacles, told.route)


# An arm --------------------------------------------------------------------------------------------------------------


def test_an_arm_comes_closes_and_lifts_and_the_object_rises_with_it(lifted):
    assert lifted.ending == "held"
    assert lifted.score_strict == 1.0
    assert lifted.lift.rise == pytest.approx(LIFT, abs=4e-3)
    assert lifted.knocks == ()
    assert list(dict.fromkeys(lifted.trace.phase)) == ["approach", "close", "lift", "hold"]
    assert lifted.trace.time[0] == pytest.approx(-1.0)
    assert (lifted.carriage.approach_seconds, lifted.carriage.lift_seconds) == pytest.approx((1.0, 1.0))


def test_an_arm_is_off_its_path_by_less_than_a_millimetre_with_the_object_in_the_hand(lifted):
    way = lifted.carriage
    assert 1e-6 < way.approach_off < 5e-4
    assert max(way.closing_off, way.lift_off) < 1e-3
    assert 0.1 < way.torque_share < 1.0


def test_the_wrist_goes_from_the_stand_off_to_the_pregrasp_and_up(carried, lifted):
    trace = lifted.trace
    turn = [pin.XYZQUATToSE3(pose).rotation for pose in (trace.wrist[0], carried.wrist[0])]
    np.testing.assert_allclose(turn[0], turn[1], atol=1e-6)
    np.testing.assert_allclose(trace.wrist[0, :3], carried.wrist[0, :3], atol=1e-6)
    np.testing.assert_allclose(trace.wrist[trace.phase == "approach"][-1][:3], TOLD.wrist[:3], atol=5e-4)
    np.testing.assert_allclose(trace.wrist[-1][:3], np.add(TOLD.wrist[:3], [0, 0, LIFT]), atol=1e-3)


def test_the_drives_of_an_arm_at_rest_bear_the_weight_of_arm_and_hand(carried):
    run = experiment(carried, CARRIED)
    q, model = carried.arm[0], run.world.model
    links = [i for i in range(model.nbody) if model.body(i).name.startswith("hand/")]
    mass = model.body_mass[links]
    centre = mass @ run.data.xipos[links] / mass.sum()
    local = pin.XYZQUATToSE3(wrist_pose(CARRIED.arm, q)).actInv(centre)
    expected = gravity_torques(CARRIED.arm, q, mass.sum(), local)
    assert np.abs(expected).max() > 5
    np.testing.assert_allclose(run.data.qfrc_actuator[run.world.carrier_speeds], expected, atol=0.05)


def test_a_servo_gives_way_by_its_effort_at_the_give_of_the_settings_and_is_damped_critically(carried):
    run = experiment(carried, CARRIED)
    model, mass = run.world.model, np.zeros((run.world.model.nv,) * 2)
    run.data.qpos[run.world.carrier] = route(carried, TOLD, CARRIED).approach.end
    mujoco.mj_forward(model, run.data)
    mujoco.mj_fullM(model, run.data, mass)
    stiffness = model.actuator_gainprm[-7:, 0]
    np.testing.assert_allclose(stiffness * SETTINGS.arm_give, CARRIED.arm.effort)
    inertia = mass.diagonal()[run.world.carrier_speeds]
    np.testing.assert_allclose(model.actuator_biasprm[-7:, 2] ** 2, 4 * stiffness * inertia, rtol=1e-6)
    np.testing.assert_allclose(model.jnt_actfrcrange[:7, 1], CARRIED.arm.effort)


def test_an_arm_whose_base_is_elsewhere_than_told_brings_the_hand_beside_its_place(carried):
    wrong = replace(SETTINGS, place_error=0.01, turn_error=3.0, seed=2)
    run = experiment(carried, CARRIED, settings=wrong)
    for _ in run.approach():
        pass
    wrist = run.world.wrist(run.data)
    np.testing.assert_allclose(wrist[:3], erred(TOLD, wrong).wrist[:3], atol=5e-4)
    assert np.linalg.norm(wrist[:3] - TOLD.wrist[:3]) > 5e-3


def test_what_stands_in_the_way_of_the_arm_is_found_and_named(carried):
    stool = Shape.box([-0.22, 0.0, 0.055], [0.1, 0.1, 0.11], name="stool")  # below the last links
    outcome = execute(TOLD, box(), CARRIED, SETTINGS, (stool,), carried)
    assert (outcome.ending, outcome.closing) == ("in collision", None)
    assert outcome.pregrasp.penetration_obstacles > SETTINGS.max_penetration
    assert outcome.obstacles_touched == ("stool",)
    assert {knock.part for knock in outcome.knocks} <= {f"panda_link{i}" for i in (5, 6, 7)}
    unseen = replace(SETTINGS, max_penetration=1.0)  # it goes there, and stops where it hits
    outcome = execute(TOLD, box(), CARRIED, unseen, (stool,), carried)
    assert (outcome.ending, outcome.closing) == ("in collision", None)
    assert {knock.phase for knock in outcome.knocks} == {"approach"}
    assert max(knock.force for knock in outcome.knocks) >= SETTINGS.collision_force


# A wrist that floats -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def flown():
    return execute(TOLD, box(), FLOATING, SETTINGS, (), COMING)


def test_a_wrist_that_floats_goes_exactly_as_it_is_told(flown):
    assert (flown.ending, flown.carriage.torque_share) == ("held", 0.0)
    assert flown.lift.rise == pytest.approx(LIFT, abs=4e-3)
    assert max(flown.carriage.approach_off, flown.carriage.closing_off, flown.carriage.lift_off) < 2e-5
    np.testing.assert_allclose(flown.trace.wrist[0], COMING.wrist[0], atol=1e-9)
    np.testing.assert_allclose(flown.trace.wrist[-1], COMING.wrist[-1], atol=2e-5)


def test_fingers_begin_to_close_at_the_pregrasp_and_not_before(flown):
    quick = execute(TOLD, box(), FLOATING, SETTINGS)
    np.testing.assert_allclose(flown.closing.contact_times, quick.closing.contact_times, atol=0.021)
    np.testing.assert_allclose(flown.closing.forces, quick.closing.forces, atol=0.1)


def test_without_obstacles_and_motion_nothing_changes_and_what_is_far_away_changes_nothing():
    alone = execute(TOLD, box(), FLOATING, SETTINGS)
    far = (
        Shape.box([1.0, 0, 0.1], [0.1, 0.2, 0.2], name="crate"),
        Shape.sphere([0, 1.0, 0.1], 0.05),
        Shape.cylinder([-1.0, 0, 0.1], 0.05, 0.2),
        Shape.half_space([0, -1.0, 0], [0, 1, 0], name="wall"),
    )
    assert pickle.dumps(execute(TOLD, box(), FLOATING, SETTINGS, far)) == pickle.dumps(alone)
    assert (alone.knocks, alone.carriage) == ((), None)


def test_an_obstacle_in_the_way_of_the_approach_is_found_and_named_and_ends_the_motion():
    shelf = Shape.box([-0.03, 0.0, 0.2], [0.1, 0.1, 0.02], name="shelf")  # above the hand at the pregrasp
    assert execute(TOLD, box(), FLOATING, replace(SETTINGS, lift_height=0.01), (shelf,)).knocks == ()
    outcome = execute(TOLD, box(), FLOATING, SETTINGS, (shelf,), COMING)
    assert outcome.ending == "in collision"
    assert outcome.score == outcome.score_strict == 0.0
    assert outcome.obstacles_touched == ("shelf",)
    assert {knock.phase for knock in outcome.knocks} == {"approach"}
    assert max(knock.force for knock in outcome.knocks) >= SETTINGS.collision_force
    assert (outcome.closing, outcome.lift) == (None, None)


def test_what_the_lifted_object_hits_is_told_of_and_not_called_a_collision():
    hook = Shape.box([0.0, 0.13, 0.12], [0.02, 0.02, 0.02], name="hook")  # above an end of the object, beside the hand
    outcome = execute(TOLD, box(y=0.28), FLOATING, SETTINGS, (hook,), COMING)
    assert {(knock.phase, knock.part, knock.hit, knock.kind) for knock in outcome.knocks} == {
        (phase, OBJECT, "hook", "obstacle") for phase in dict.fromkeys(k.phase for k in outcome.knocks)
    }
    assert outcome.knocks[0].phase == "lift"
    assert outcome.obstacles_touched == ("hook",)
    assert outcome.ending != "in collision"


# Obstacles -----------------------------------------------------------------------------------------------------------

TURN = pin.exp3(np.array([0.3, -0.5, 0.8]))
SHAPES = {
    "box": Shape.box([0.3, 0.1, 0.2], [0.1, 0.2, 0.3], TURN),
    "inflated box": Shape.box([0.3, 0.1, 0.2], [0.1, 0.2, 0.3], TURN).inflated(0.01),
    "sphere": Shape.sphere([0.3, 0.1, 0.2], 0.07),
    "cylinder": Shape.cylinder([0.3, 0.1, 0.2], 0.05, 0.3, TURN),
    "half-space": Shape.half_space([0.3, 0.1, 0.2], [0.4, -0.3, 1.0]),
}


@pytest.mark.parametrize("name", SHAPES)
def test_an_obstacle_of_the_simulation_is_where_its_shape_is(name):
    shape, spec = SHAPES[name], empty_scene(box(), SETTINGS)
    add_object(spec, box(), SETTINGS)
    add_obstacles(spec, [shape], box(), SETTINGS)
    probe = spec.worldbody.add_body(name="probe")
    probe.add_freejoint()
    probe.add_geom(name="probe", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-3, 0, 0], mass=1.0)
    model = compiled(spec)
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    place = int(model.jnt_qposadr[model.body("probe").jntadr[0]])
    ends = (model.geom("probe").id, model.geom(f"{OBSTACLE}0").id)
    for direction in rng.normal(size=(20, 3)):
        point = shape.centre + (10.0 if name == "half-space" else 0.0) * shape.rotation[:, 2] + 0.3 * direction
        data.qpos[place : place + 3] = point
        mujoco.mj_forward(model, data)
        found, expected = mujoco.mj_geomDistance(model, data, *ends, 10.0, None) + 1e-3, shape.distance(point[None])[0]
        if expected > 0.02:
            slack = 0.42 * shape.radius if "inflated" in name else 0.0  # rounded edges are drawn sharp
            assert expected - 2 * slack - 1e-6 <= found <= expected + 1e-6


def test_what_reaches_into_the_object_does_not_push_it_and_what_is_beside_it_does():
    inside = Shape.box([0.0, 0.06, 0.02], [0.05, 0.05, 0.04], name="guess")  # 10 mm deep in the object
    still = execute(TOLD, box(), FLOATING, SETTINGS, (inside,))
    assert (still.ending, still.pregrasp.settle_shift < 1e-4, still.knocks) == ("held", True, ())
    ramp = Shape.box([0.0, 0.0, -0.0005], [0.2, 0.2, 0.002], name="tray")  # the object stands 0.5 mm deep in it
    raised = execute(TOLD, box(), FLOATING, SETTINGS, (ramp,))
    assert raised.pregrasp.settle_shift == pytest.approx(5e-4, abs=1e-4)
    assert {knock.hit for knock in raised.knocks if knock.part == OBJECT} == {"tray"}


# Motions that do not fit ---------------------------------------------------------------------------------------------


def test_a_motion_of_another_grasp_or_arm_is_refused(carried):
    with pytest.raises(InputError, match="moves 7 joints of an arm, and there are 0"):
        route(carried, TOLD, FLOATING)
    with pytest.raises(InputError, match="moves 0 joints of an arm, and there are 7"):
        route(COMING, TOLD, CARRIED)
    with pytest.raises(InputError, match="does not end at the pregrasp"):
        route(COMING, replace(TOLD, wrist=np.add(TOLD.wrist, [0.01, 0, 0, 0, 0, 0, 0])), FLOATING)


def test_a_wrist_that_floats_does_not_turn():
    turned = motion(FLOATING, TOLD.wrist)
    turned.wrist[-1, 3:] = [0, 0, 0, 1]
    with pytest.raises(InputError, match="turns the wrist"):
        route(turned, TOLD, FLOATING)


def test_a_leg_is_at_rest_before_it_begins_and_after_it_ends_and_goes_through_its_samples():
    leg = route(COMING, TOLD, FLOATING).approach
    for time, place in ((-1.0, leg.coordinates[0]), (0.0, leg.coordinates[0]), (9.0, leg.end)):
        at, speed = leg.at(time)
        np.testing.assert_array_equal(at, place)
        assert not speed.any()
    at, speed = leg.at(leg.times[20])
    np.testing.assert_allclose(at, leg.coordinates[20], atol=1e-12)
    rise = leg.at(leg.times[20] + 1e-4)[0] - leg.at(leg.times[20] - 1e-4)[0]
    np.testing.assert_allclose(speed, rise / 2e-4, rtol=1e-4, atol=1e-7)
