"""The controller of a hand obeys physics: virtual work, potentials, power, and what moves with the wrist."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from commands import aimed, carried, inside, pose
from finite_differences import jacobian
from hands import coupled, weighed
from hypothesis import given
from hypothesis import strategies as st

from sgnlp.base.errors import InputError
from sgnlp.control import WEIGHTLESS, Controller, Law
from sgnlp.control.law import critical
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.hand.kinematics import tip_jacobian, tips

LEFT = load_hand("allegro_left")
FLOATING = Law(gravity=WEIGHTLESS)
STRONG = 1e6
SEEDS = range(4)


@pytest.fixture(scope="module", params=["allegro_left", "dlr_hit_right", "coupled"])
def hand(request, tmp_path_factory) -> Hand:
    """Two hands of the library and the made-up one, of which one joint mimics another; none at its effort."""
    made = request.param == "coupled"
    found = load_hand(weighed(coupled(tmp_path_factory.mktemp("hand"))) if made else request.param)
    return replace(found, effort=np.full(len(found.effort), STRONG))


def energy(hand: Hand, told, joints: np.ndarray) -> float:
    """Σ k/2 |o - a|² of springs at their targets [J], in the world."""
    stretch = told.targets - tips(hand, told.wrist, joints)
    return float(0.5 * told.gains @ (stretch**2).sum(axis=1))


def potential(hand: Hand, wrist: np.ndarray, joints: np.ndarray) -> float:
    """U = Σ m 9.81 z [J] of all links but the root's: each by itself, mimic joints at their angles."""
    model = pin.buildModelFromXML(hand.description)
    places = dict(zip(hand.moving_joints, hand.moving_angles(joints), strict=True))
    data = model.createData()
    pin.forwardKinematics(model, data, np.array([places[name] for name in model.names[1:]]))
    root = pin.XYZQUATToSE3(wrist)
    bodies = zip(data.oMi, model.inertias, strict=True)
    return sum(9.81 * body.mass * root.act(place.act(body.lever))[2] for place, body in list(bodies)[1:])


# --- the springs of the tips -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_springs_do_the_work_that_they_lose(hand, seed):
    told = aimed(hand, seed, posture=0.0)
    joints = inside(hand, np.random.default_rng(seed))
    torques = Controller(hand, told, FLOATING).torques(1.0, told.wrist, joints, np.zeros_like(joints))
    expected = -jacobian(lambda q: energy(hand, told, q), joints)
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(torques, expected, atol=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_each_tip_is_damped_critically_for_a_kilogram(hand, seed):
    told = aimed(hand, seed, posture=0.0)
    rng = np.random.default_rng(seed)
    joints, speeds = inside(hand, rng), rng.normal(size=len(hand.joint_names))
    control = Controller(hand, told, FLOATING)
    still, moving = (control.torques(1.0, told.wrist, joints, s * speeds) for s in (0.0, 1.0))
    J = tip_jacobian(hand, told.wrist, joints)
    np.testing.assert_allclose(moving - still, -J.T @ (np.repeat(2 * np.sqrt(told.gains), 3) * (J @ speeds)), atol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_what_damps_takes_power_and_gives_none(seed):
    hand = replace(LEFT, effort=np.full(16, STRONG))
    rng, told = np.random.default_rng(seed), aimed(hand, seed % 5)
    joints, speeds = inside(hand, rng), rng.normal(size=16)
    for law in (FLOATING, replace(FLOATING, control="position")):
        control = Controller(hand, told, law)
        still, moving = (control.torques(0.2, told.wrist, joints, s * speeds) for s in (0.0, 1.0))
        assert (moving - still) @ speeds < 0.0


def test_the_setpoints_go_from_the_tips_of_the_pregrasp_to_the_targets(hand):
    told = aimed(hand)
    control, root = Controller(hand, told), pin.XYZQUATToSE3(told.wrist)
    for time, points in ((0.0, told.tips), (0.25, (told.tips + told.targets) / 2), (0.5, told.targets)):
        found = [root.act(point) for point in control.setpoints(time)]
        np.testing.assert_allclose(found, points, atol=1e-12)
    np.testing.assert_array_equal(control.setpoints(7.0), control.end)
    at_rest = replace(told, posture=0.0)
    begin = Controller(hand, at_rest, FLOATING).torques(0.0, told.wrist, told.joints, np.zeros_like(told.joints))
    np.testing.assert_allclose(begin, 0.0, atol=1e-12)


# --- the posture -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_the_posture_pulls_towards_the_joints_at_contact_and_no_tip_feels_it(seed):
    hand, told = replace(LEFT, effort=np.full(16, STRONG)), aimed(LEFT, seed)
    speeds = np.random.default_rng(seed).normal(size=16)
    with_, without = (
        Controller(hand, replace(told, posture=k), FLOATING).torques(0.3, told.wrist, told.joints, speeds)
        for k in (0.1, 0.0)
    )
    J, posture = tip_jacobian(hand, told.wrist, told.joints), with_ - without
    assert np.abs(posture).max() > 1e-3
    assert np.abs(np.linalg.lstsq(J.T, posture, rcond=None)[0]).max() < 0.02  # [N]
    wanted = 0.1 * (told.joints_contact - told.joints) - critical(0.1, 1e-3) * speeds
    np.testing.assert_allclose(posture, wanted - np.linalg.pinv(J) @ J @ wanted, atol=1e-3)


@pytest.mark.parametrize("changes", [{"posture": 0.0}, {"joints_contact": None}])
def test_without_joints_at_contact_or_stiffness_no_posture_is_held(changes):
    assert Controller(LEFT, aimed(LEFT)).posture is not None
    assert Controller(LEFT, aimed(LEFT, **changes)).posture is None


# --- the weight ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_the_weight_is_borne_however_the_wrist_is_turned(hand, seed):
    told, rng = aimed(hand, seed), np.random.default_rng(seed)
    joints, wrist, still = inside(hand, rng), pose(rng), np.zeros(len(hand.joint_names))
    heavy, light = (Controller(hand, told, law).torques(0.2, wrist, joints, still) for law in (Law(), FLOATING))
    expected = jacobian(lambda q: potential(hand, wrist, q), joints)
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(heavy - light, expected, atol=1e-7)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_targets_go_with_the_wrist_and_of_its_motion_only_a_turn_is_felt_as_weight(hand, seed):
    told, rng = aimed(hand, seed), np.random.default_rng(seed)
    joints, speeds = inside(hand, rng), rng.normal(size=len(hand.joint_names))
    shift = carried(told.wrist, pin.SE3(np.eye(3), np.array([0.1, -0.2, 0.3])))
    turned = carried(told.wrist, pin.SE3(pin.exp3(np.array([0.5, 0.2, -0.1])), np.zeros(3)))
    for law, wrists in ((Law(), [shift]), (FLOATING, [shift, turned])):
        control = Controller(hand, told, law)
        at_home = control.torques(0.2, told.wrist, joints, speeds)
        for wrist in wrists:
            np.testing.assert_allclose(control.torques(0.2, wrist, joints, speeds), at_home, atol=1e-12)
    control = Controller(hand, told)
    away = control.torques(0.2, turned, joints, speeds) - control.torques(0.2, told.wrist, joints, speeds)
    assert np.abs(away).max() > 1e-4


# --- the limits, and that nothing else enters ------------------------------------------------------------------------


def test_no_torque_is_beyond_the_effort_and_those_within_are_as_they_were():
    told, still = aimed(LEFT, gains=np.full(4, 2000.0)), np.zeros(16)
    free = Controller(replace(LEFT, effort=np.full(16, STRONG)), told).torques(1.0, told.wrist, told.joints, still)
    found = Controller(LEFT, told).torques(1.0, told.wrist, told.joints, still)
    assert 0 < (np.abs(free) > LEFT.effort).sum() < 16
    np.testing.assert_array_equal(found, np.clip(free, -LEFT.effort, LEFT.effort))


def test_the_same_arguments_give_the_same_torques_whatever_was_asked_between(hand):
    told, rng = aimed(hand), np.random.default_rng(0)
    control = Controller(hand, told)
    states = [(t, pose(rng), inside(hand, rng), rng.normal(size=len(told.joints))) for t in (0.1, 0.3, 2.0)]
    first = [control.torques(*state) for state in states]
    for state, torques in zip(reversed(states), reversed(first), strict=True):
        np.testing.assert_array_equal(control.torques(*state), torques)


# --- position control ------------------------------------------------------------------------------------------------


def test_under_position_control_each_joint_is_a_spring_to_a_setpoint_on_its_way_to_the_squeezing_joints(hand):
    told, rng = aimed(hand), np.random.default_rng(1)
    control = Controller(hand, told, replace(FLOATING, control="position", joint_inertia=2e-3))
    np.testing.assert_allclose(control.setpoints(0.0), told.joints)
    np.testing.assert_allclose(control.setpoints(0.1), 0.8 * told.joints + 0.2 * told.joints_squeeze)
    np.testing.assert_allclose(control.setpoints(0.5), told.joints_squeeze)
    joints, speeds = inside(hand, rng), rng.normal(size=len(told.joints))
    expected = 2.0 * (control.setpoints(0.1) - joints) - 2 * np.sqrt(2.0 * 2e-3) * speeds
    np.testing.assert_allclose(control.torques(0.1, told.wrist, joints, speeds), expected, atol=1e-12)


def test_arguments_in_another_order_or_of_another_kind_are_refused_by_name(hand):
    told = aimed(hand)
    wrong = (((told, hand), "hand must be of Hand"), ((hand, hand), "command must be"), ((hand, told, 1), "law"))
    for arguments, said in wrong:
        with pytest.raises(InputError, match=said):
            Controller(*arguments)  # type: ignore[arg-type]


def test_position_control_of_a_plan_without_joints_is_refused():
    with pytest.raises(InputError, match=r"position control needs the command's `joints_squeeze`"):
        Controller(LEFT, aimed(LEFT, joints_squeeze=None), Law(control="position"))


@pytest.mark.parametrize(
    "changes", [{"gains": np.ones(3)}, {"wrist": np.full(7, np.nan)}, {"joints_contact": np.ones(9)}]
)
def test_a_grasp_that_is_none_of_the_hand_is_refused(changes):
    (name,) = changes
    with pytest.raises(InputError, match=f"the grasp's {name} must be"):
        Controller(LEFT, aimed(LEFT, **changes))


# --- arguments -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("position", "wrong", "message"),
    [
        (1, np.zeros(6), r"wrist must be \(7,\) numbers, not \(6,\)"),
        (2, np.zeros(1), r"joints must be \(16,\) numbers, not \(1,\)"),
        (2, 0.0, r"joints must be \(16,\) numbers, not \(\)"),
        (3, np.zeros((16, 1)), r"speeds must be \(16,\) numbers, not \(16, 1\)"),
        (3, ["fast"] * 16, r"speeds must be \(16,\) numbers"),
    ],
)
@pytest.mark.parametrize("control", ["impedance", "position"])
def test_a_state_of_another_shape_is_refused_with_the_valid_one(control, position, wrong, message):
    told = aimed(LEFT)
    state = [0.1, told.wrist, told.joints, np.zeros(16)]
    state[position] = wrong
    with pytest.raises(InputError, match=message):
        Controller(LEFT, told, Law(control=control)).torques(*state)


def test_a_state_of_lists_gives_the_torques_of_arrays(hand):
    told, rng = aimed(hand), np.random.default_rng(0)
    control, speeds = Controller(hand, told), rng.normal(size=len(told.joints))
    listed = control.torques(0.1, told.wrist.tolist(), tuple(told.joints), speeds.tolist())
    np.testing.assert_array_equal(listed, control.torques(0.1, told.wrist, told.joints, speeds))


@pytest.mark.parametrize("quaternion", [np.zeros(4), np.array([0.0, 0.0, 0.0, 1.1]), np.full(4, np.nan)])
def test_a_wrist_whose_quaternion_is_not_unit_is_refused_and_one_of_four_digits_is_not(quaternion):
    told, still = aimed(LEFT), np.zeros(16)
    control = Controller(LEFT, told)
    with pytest.raises(InputError, match=r"the wrist must be .* unit quaternion"):
        control.torques(0.1, np.concatenate([told.wrist[:3], quaternion]), told.joints, still)
    rounded = np.concatenate([told.wrist[:3], 1.0002 * told.wrist[3:]])
    exact = control.torques(0.1, told.wrist, told.joints, still)
    np.testing.assert_allclose(control.torques(0.1, rounded, told.joints, still), exact, atol=1e-12)
