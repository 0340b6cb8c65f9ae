"""Symbolic forward kinematics against numeric Pinocchio, Pinocchio on CasADi scalars, and differences."""

import functools
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from finite_differences import assert_jacobian
from hands import coupled, installed
from hypothesis import given, settings
from hypothesis import strategies as st

from sgnlp.base.errors import InputError
from sgnlp.hand.hand import Hand, available_hands, load_hand
from sgnlp.hand.kinematics import SERIES_TERMS, _exp6, forward, frames, integrate, joint_torques
from sgnlp.hand.placements import BACKENDS, Backend, lack

GOLDEN = Path(__file__).parents[1] / "golden"
EXACT = 1e-12
SAMPLES = 50
TURNS = (0.0, 1e-9, 1e-3, 2.0, np.pi)
"""Of the tangents at which derivatives are looked at [rad]."""


ONES = [name for name in available_hands() if name.replace("left", "right") == name]
"""Of two hands that are mirror images of each other, one; `test_placement_functions` looks at the joints of both."""


@pytest.fixture(scope="module", params=[*ONES, "coupled", "skew"])
def hand(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Hand:
    """Hands of every kind, one with a joint that mimics another finger's, one with a slide and a skew axis."""
    folder = {"coupled": lambda: coupled(tmp_path_factory.mktemp("hands")), "skew": lambda: GOLDEN / "three_fingers"}
    return load_hand(folder[request.param]()) if request.param in folder else installed(request.param)


@pytest.fixture(params=BACKENDS)
def using(request: pytest.FixtureRequest, hand: Hand) -> Backend:
    """Every backend that runs here for the hand; `test_placement_functions` compiles those of the made-up hands."""
    if reason := lack(hand.model, request.param):
        pytest.skip(reason)
    return request.param


def function(hand: Hand, using: Backend | None = None) -> ca.Function:
    """(wrist, joints, v) -> tips, spheres, position, rotation."""
    n = len(hand.joint_names)
    wrist, joints, v = ca.SX.sym("wrist", 7), ca.SX.sym("joints", n), ca.SX.sym("v", 6 + n)
    f = forward(hand, wrist, joints, v, using=using)
    return ca.Function("f", [wrist, joints, v], [f.tips, f.spheres, f.position, f.rotation])


def sample(hand: Hand, rng: np.random.Generator, turn: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A random wrist, joint angles within the limits, and a tangent whose rotation is by `turn` [rad]."""
    quaternion, axis = rng.normal(size=4), rng.normal(size=3)
    wrist = np.concatenate([rng.normal(size=3), quaternion / np.linalg.norm(quaternion)])
    twist = np.concatenate([0.2 * rng.normal(size=3), turn * axis / np.linalg.norm(axis)])
    joints = rng.uniform(hand.lower, hand.upper)
    return wrist, joints, np.concatenate([twist, 0.5 * rng.normal(size=len(joints))])


def test_tips_and_spheres_match_numeric_pinocchio(hand: Hand, using: Backend):
    f, rng = function(hand, using), np.random.default_rng(0)
    for turn in np.linspace(0, 1.2 * np.pi, SAMPLES):
        wrist, joints, v = sample(hand, rng, turn)
        tips, spheres, position, rotation = (np.array(value) for value in f(wrist, joints, v))
        moved = integrate(hand, wrist, joints, v)
        expected_tips, expected_spheres = frames(hand, *moved)
        root = pin.XYZQUATToSE3(moved[0])
        np.testing.assert_allclose(tips, expected_tips, atol=EXACT, rtol=0)
        np.testing.assert_allclose(spheres, expected_spheres, atol=EXACT, rtol=0)
        np.testing.assert_allclose(position[:, 0], root.translation, atol=EXACT, rtol=0)
        np.testing.assert_allclose(rotation, root.rotation, atol=EXACT, rtol=0)


def test_a_zero_tangent_leaves_the_seed_and_has_finite_derivatives(hand: Hand, using: Backend):
    n = len(hand.joint_names)
    v = ca.SX.sym("v", 6 + n)
    wrist, joints, _ = sample(hand, np.random.default_rng(1), 0.0)
    tips = forward(hand, ca.SX(wrist), ca.SX(joints), v, using=using).tips
    derivatives = ca.Function("d", [v], [tips, ca.jacobian(tips, v), ca.hessian(ca.sumsqr(tips), v)[0]])
    value, jacobian, hessian = (np.array(d) for d in derivatives(np.zeros(6 + n)))
    np.testing.assert_allclose(value, frames(hand, wrist, joints)[0], atol=EXACT, rtol=0)
    assert np.isfinite(jacobian).all()
    assert np.isfinite(hessian).all()


def test_the_jacobian_is_pinocchios_frame_jacobian(hand: Hand):
    n, rng = len(hand.joint_names), np.random.default_rng(2)
    wrist, joints, _ = sample(hand, rng, 0.0)
    v = ca.SX.sym("v", 6 + n)
    tips = forward(hand, ca.SX(wrist), ca.SX(joints), v).tips
    jacobian = np.array(ca.Function("j", [v], [ca.jacobian(ca.vec(tips.T), v)])(np.zeros(6 + n)))
    root, data = pin.XYZQUATToSE3(wrist), hand.model.createData()
    pin.computeJointJacobians(hand.model, data, joints)
    pin.updateFramePlacements(hand.model, data)
    for i, finger in enumerate(hand.fingers):
        frame = hand.model.getFrameId(finger.frame, pin.FrameType.BODY)
        inner = pin.getFrameJacobian(hand.model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        inner = inner[:3] - pin.skew(data.oMf[frame].rotation @ finger.offset) @ inner[3:]
        arm = root.actInv(frames(hand, wrist, joints)[0][i])
        expected = root.rotation @ np.hstack([np.eye(3), -pin.skew(arm), inner])
        np.testing.assert_allclose(jacobian[3 * i : 3 * i + 3], expected, atol=EXACT, rtol=0)


def test_jacobian_and_hessian_match_central_differences(hand: Hand, using: Backend):
    n, rng = len(hand.joint_names), np.random.default_rng(3)
    seed, v = [ca.SX.sym("wrist", 7), ca.SX.sym("joints", n)], ca.SX.sym("v", 6 + n)
    out = forward(hand, *seed, v, using)
    points = ca.vec(ca.vertcat(out.tips, out.spheres))
    hessian, gradient = ca.hessian(ca.dot(ca.DM(rng.normal(size=points.numel())), points), v)
    once = ca.Function("once", [*seed, v], [points, gradient])
    twice = ca.Function("twice", [*seed, v], [ca.jacobian(points, v), hessian])
    step = 1e-6 * np.eye(6 + n)
    for turn in TURNS:
        wrist, joints, v0 = sample(hand, rng, turn)
        high, low = (once(wrist, joints, v0[:, None] + sign * step) for sign in (1, -1))
        jacobian, curvature = (np.array(value) for value in twice(wrist, joints, v0))
        moved, sloped = (np.array(more - less) / 2e-6 for more, less in zip(high, low, strict=True))
        np.testing.assert_allclose(jacobian, moved, atol=1e-8, rtol=1e-6, err_msg=f"turn {turn}")
        np.testing.assert_allclose(curvature, sloped, atol=1e-6, rtol=1e-6, err_msg=f"turn {turn}")


@pytest.mark.parametrize("name", ["allegro_left", "allegro_right"])
@pytest.mark.parametrize("using", BACKENDS)
def test_kinematics_match_the_golden_functions_of_pinocchio_on_casadi(name: str, using: Backend):
    if reason := lack(load_hand(name).model, using):
        pytest.skip(reason)
    hand, golden = load_hand(name), ca.Function.load(str(GOLDEN / f"{name}_fk.casadi"))
    n, rng = len(hand.joint_names), np.random.default_rng(4)
    q = ca.SX.sym("wrist", 7), ca.SX.sym("joints", n), ca.SX.sym("v", 6 + n)
    ours, theirs = (
        ca.Function("f", list(q), [tips, ca.jacobian(tips, ca.vertcat(q[1], q[2]))])
        for tips in (forward(hand, *q, using).tips, golden(*q))
    )
    for turn in np.linspace(0.0, 3.0, SAMPLES):
        at = sample(hand, rng, turn)
        for mine, other in zip(ours(*at), theirs(*at), strict=True):
            np.testing.assert_allclose(np.array(mine), np.array(other), atol=EXACT, rtol=0)


@functools.cache
def _left() -> tuple[Hand, ca.Function]:
    hand = load_hand("allegro_left")
    return hand, function(hand)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), turn=st.floats(0, 3))
def test_a_rigid_motion_of_the_seed_moves_every_point_by_it(seed: int, turn: float):
    hand, f = _left()
    rng = np.random.default_rng(seed)
    wrist, joints, v = sample(hand, rng, turn)
    motion = pin.XYZQUATToSE3(sample(hand, rng, 0.0)[0])
    moved = pin.SE3ToXYZQUAT(motion * pin.XYZQUATToSE3(wrist))
    for before, after in zip(f(wrist, joints, v)[:2], f(moved, joints, v)[:2], strict=True):
        expected = np.array(before) @ motion.rotation.T + motion.translation
        np.testing.assert_allclose(np.array(after), expected, atol=EXACT, rtol=0)


def test_integrating_is_pinocchios_integration_of_a_free_flyer_and_the_joints(hand: Hand):
    model = pin.buildModelFromXML(hand.description, pin.JointModelFreeFlyer(), mimic=True)
    rng = np.random.default_rng(5)
    for turn in np.linspace(0, 4, SAMPLES):
        wrist, joints, v = sample(hand, rng, turn)
        expected = pin.integrate(model, np.concatenate([wrist, joints]), v)
        moved = integrate(hand, wrist, joints, v)
        np.testing.assert_allclose(np.concatenate(moved), expected, atol=EXACT, rtol=0)


def test_the_exponential_is_exact_up_to_a_rotation_by_four_radians():
    twist = ca.SX.sym("twist", 6)
    rotation, position = _exp6(twist[:3], twist[3:])
    f = ca.Function("f", [twist], [rotation, position])
    rng = np.random.default_rng(6)
    for turn in np.concatenate([[0.0, 1e-12, 1e-8, 1e-4], np.linspace(0.1, 4.0, SAMPLES)]):
        axis = rng.normal(size=3)
        value = np.concatenate([rng.normal(size=3), turn * axis / np.linalg.norm(axis)])
        expected = pin.exp6(value)
        np.testing.assert_allclose(np.array(f(value)[0]), expected.rotation, atol=1e-14, rtol=0)
        np.testing.assert_allclose(np.array(f(value)[1])[:, 0], expected.translation, atol=1e-14, rtol=0)
    assert SERIES_TERMS < 20


def test_each_point_depends_on_the_wrist_and_on_its_own_chain_alone(hand: Hand, using: Backend):
    n = len(hand.joint_names)
    v = ca.SX.sym("v", 6 + n)
    out = forward(hand, ca.SX.sym("wrist", 7), ca.SX.sym("joints", n), v, using)
    pattern = np.array(ca.DM(ca.jacobian_sparsity(ca.vec(out.tips.T), v), 1))
    for i, finger in enumerate(hand.fingers):
        others = [6 + j for j in range(n) if j not in finger.joints]
        assert not pattern[3 * i : 3 * i + 3, others].any()
    for i, sphere in enumerate(hand.spheres):
        frame = hand.model.frames[hand.model.getFrameId(sphere.link, pin.FrameType.BODY)]
        chain = {hand.model.idx_qs[joint] for joint in hand.model.supports[frame.parentJoint] if joint > 0}
        pattern = np.array(ca.DM(ca.jacobian_sparsity(out.spheres[i, :], v), 1))
        assert not pattern[:, [6 + j for j in range(n) if j not in chain]].any()


def test_a_mimic_joint_stands_where_an_independent_one_would_be_put(hand: Hand):
    free = pin.buildModelFromXML(hand.description)  # every joint with a coordinate of its own
    data, rng = free.createData(), np.random.default_rng(8)
    assert free.nq == len(hand.moving_joints)
    for _ in range(SAMPLES):
        joints = rng.uniform(hand.lower, hand.upper)
        angles = dict(zip(hand.moving_joints, hand.moving_angles(joints), strict=True))
        pin.framesForwardKinematics(free, data, np.array([angles[name] for name in free.names[1:]]))
        for finger, tip in zip(hand.fingers, frames(hand, np.array([0, 0, 0, 0, 0, 0, 1.0]), joints)[0], strict=True):
            place = data.oMf[free.getFrameId(finger.frame, pin.FrameType.BODY)]
            np.testing.assert_allclose(place.act(np.array(finger.offset)), tip, atol=EXACT, rtol=0)


def test_among_the_hands_is_one_with_a_slide_and_a_skew_axis():
    kinds = {joint.shortname() for joint in load_hand(GOLDEN / "three_fingers").model.joints[1:]}
    assert kinds >= {"JointModelPY", "JointModelRevoluteUnaligned"}


def test_the_expressions_stay_small(hand: Hand, using: Backend):
    f = function(hand, using)
    # a joint multiplies two matrices, a sphere off the axis of its link a matrix and a vector, and again into the world
    assert f.n_instructions() < 100 * len(hand.moving_joints) + 36 * len(hand.spheres)
    n = len(hand.joint_names)
    v = ca.SX.sym("v", 6 + n)
    out = forward(hand, ca.SX.sym("wrist", 7), ca.SX.sym("joints", n), v, using)
    points = ca.vec(ca.vertcat(out.tips, out.spheres))
    assert ca.jacobian(points, v).nnz() < 9 * points.numel()


def test_joint_torques_do_the_work_that_the_forces_do_at_the_tips(hand: Hand):
    rng = np.random.default_rng(5)
    wrist, joints, _ = sample(hand, rng, 0.0)
    forces = rng.normal(size=(len(hand.fingers), 3))

    def work(angles: np.ndarray) -> float:
        return float((forces * frames(hand, wrist, angles)[0]).sum())

    torques = joint_torques(hand, wrist, joints, forces)
    assert_jacobian(work, torques, joints)
    finger = hand.fingers[1]
    offset = replace(finger, offset=np.array([0.01, -0.02, 0.03]))
    hand = replace(hand, fingers=(hand.fingers[0], offset, *hand.fingers[2:]))
    assert_jacobian(work, joint_torques(hand, wrist, joints, forces), joints)
    assert np.abs(joint_torques(hand, wrist, joints, forces) - torques)[list(finger.joints)].max() > 1e-3


def test_an_unknown_backend_is_refused_with_the_valid_ones():
    hand, n = load_hand("allegro_left"), 16
    with pytest.raises(InputError, match=r"'magic'.*model walk"):
        forward(hand, ca.SX.sym("wrist", 7), ca.SX.sym("joints", n), ca.SX.sym("v", 6 + n), using="magic")  # type: ignore[arg-type]
