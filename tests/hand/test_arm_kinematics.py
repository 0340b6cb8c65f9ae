"""The kinematics and statics of arms: numeric Pinocchio, its symbolic twin, and differences."""

import functools
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from arms import rail
from finite_differences import assert_jacobian
from hypothesis import given, settings
from hypothesis import strategies as st

from sgnlp.base.errors import InputError
from sgnlp.hand.arm import Arm, available_arms, load_arm, with_base
from sgnlp.hand.arm_kinematics import (
    DAMPING,
    arm_forward,
    arm_spheres,
    gravity_torques,
    log_manipulability,
    manipulability,
    wrist_jacobian,
    wrist_pose,
)
from sgnlp.hand.placements import BACKENDS, Backend, lack

EXACT = 1e-12
SAMPLES = 20
G = 9.81


@pytest.fixture(scope="module", params=[*available_arms(), "rail"])
def arm(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Arm:
    """Every arm, at a base that is turned about all axes, and one with a slanted prismatic joint and three joints."""
    if request.param == "rail":
        return load_arm(rail(tmp_path_factory.mktemp("arms")))
    return with_base(load_arm(request.param), random_pose(np.random.default_rng(9)))


@pytest.fixture(params=BACKENDS)
def using(request: pytest.FixtureRequest, arm: Arm) -> Backend:
    """Every backend that runs here for the arm; `test_placement_functions` compiles those of the made-up one."""
    if reason := lack(arm.model, request.param):
        pytest.skip(reason)
    return request.param


def random_pose(rng: np.random.Generator) -> np.ndarray:
    quaternion = rng.normal(size=4)
    return np.concatenate([rng.normal(size=3), quaternion / np.linalg.norm(quaternion)])


def posture(arm: Arm, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(arm.lower, arm.upper)


def test_the_wrist_is_base_times_flange_times_mount(arm: Arm):
    for seed in range(SAMPLES):
        q, data = posture(arm, seed), arm.model.createData()
        pin.framesForwardKinematics(arm.model, data, q)
        flange = data.oMf[arm.model.getFrameId(arm.flange, pin.FrameType.BODY)]
        expected = pin.XYZQUATToSE3(arm.base) * flange * pin.XYZQUATToSE3(arm.mount)
        found = pin.XYZQUATToSE3(wrist_pose(arm, q))
        np.testing.assert_allclose(found.homogeneous, expected.homogeneous, atol=EXACT)


def test_wrist_and_spheres_match_numeric_pinocchio(arm: Arm, using: Backend):
    q = ca.SX.sym("q", len(arm.home))
    at = arm_forward(arm, q, using=using)
    f = ca.Function("f", [q], [at.rotation, at.position, at.spheres])
    for seed in range(SAMPLES):
        at = posture(arm, seed)
        rotation, position, spheres = (np.array(value) for value in f(at))
        pose = pin.XYZQUATToSE3(wrist_pose(arm, at))
        np.testing.assert_allclose(rotation, pose.rotation, atol=EXACT)
        np.testing.assert_allclose(position[:, 0], pose.translation, atol=EXACT)
        np.testing.assert_allclose(spheres, arm_spheres(arm, at), atol=EXACT)


def test_an_unknown_backend_is_refused():
    with pytest.raises(InputError, match=r"'magic'.*model walk"):
        arm_forward(load_arm("ur5"), ca.SX.sym("q", 6), using="magic")  # type: ignore[arg-type]


def test_the_jacobian_is_the_twist_of_the_wrist(arm: Arm):
    q = posture(arm, 3)
    at = pin.XYZQUATToSE3(wrist_pose(arm, q)).rotation

    def moved(joints: np.ndarray) -> np.ndarray:
        pose = pin.XYZQUATToSE3(wrist_pose(arm, joints))
        return np.concatenate([pose.translation, pin.log3(pose.rotation @ at.T)])

    assert_jacobian(moved, wrist_jacobian(arm, q), q)


def test_derivatives_of_wrist_and_spheres_match_differences(arm: Arm, using: Backend):
    q, rng = ca.SX.sym("q", len(arm.home)), np.random.default_rng(4)
    at = arm_forward(arm, q, using=using)
    parts = ca.vertcat(*map(ca.vec, (at.rotation, at.position, at.spheres)))
    weights = rng.normal(size=parts.numel())
    hessian, gradient = ca.hessian(ca.dot(ca.DM(weights), parts), q)
    f = ca.Function("f", [q], [parts, ca.jacobian(parts, q), gradient, hessian])
    at = posture(arm, 5)
    assert_jacobian(lambda x: np.array(f(x)[0])[:, 0], f(at)[1], at)
    assert_jacobian(lambda x: np.array(f(x)[2])[:, 0], f(at)[3], at)


def row(arm: Arm, using: Backend | None = None) -> ca.Function:
    """Value, gradient and Hessian of log-manipulability."""
    q = ca.SX.sym("q", len(arm.home))
    value = log_manipulability(arm, q, using)
    hessian, gradient = ca.hessian(value, q)
    return ca.Function("f", [q], [value, gradient, hessian])


def test_the_row_is_the_logarithm_of_manipulability(arm: Arm, using: Backend):
    f = row(arm, using)
    for seed in range(SAMPLES):
        q = posture(arm, seed)
        J = wrist_jacobian(arm, q)
        gram = J @ J.T if J.shape[1] > 6 else J.T @ J
        assert float(f(q)[0]) == pytest.approx(
            np.linalg.slogdet(gram + DAMPING**2 * np.eye(len(gram)))[1] / 2, abs=1e-9
        )
        singular = np.linalg.svd(J, compute_uv=False)
        assert manipulability(arm, q) == pytest.approx(np.prod(singular), rel=1e-6)
        if singular.min() > 100 * DAMPING:
            assert float(f(q)[0]) == pytest.approx(np.log(manipulability(arm, q)), abs=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_the_row_match_differences(arm: Arm, seed: int):
    f = row(arm)
    q = arm.home + 0.1 * np.random.default_rng(seed).normal(size=len(arm.home))
    assert_jacobian(lambda x: float(f(x)[0]), f(q)[1], q, step=2e-3)
    assert_jacobian(lambda x: np.array(f(x)[1])[:, 0], f(q)[2], q, step=2e-3)


def test_at_a_singularity_manipulability_is_zero_and_the_row_is_finite_with_its_derivatives():
    arm = load_arm("ur10")
    stretched = np.zeros(6)
    assert manipulability(arm, stretched) < 1e-8
    for value in row(arm)(stretched):
        assert np.isfinite(np.array(value)).all()


@functools.cache
def _panda() -> Arm:
    return load_arm("panda")


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), first=st.floats(-2.8, 2.8))
def test_manipulability_depends_neither_on_the_base_nor_on_the_first_joint(seed: int, first: float):
    q = posture(_panda(), seed)
    value = manipulability(_panda(), q)
    turned = with_base(_panda(), random_pose(np.random.default_rng(seed)))
    assert manipulability(turned, q) == pytest.approx(value, rel=1e-6, abs=1e-9)
    assert manipulability(_panda(), np.array([first, *q[1:]])) == pytest.approx(value, rel=1e-6, abs=1e-9)


def test_gravity_torques_are_the_slope_of_the_potential_energy(arm: Arm):
    mass, centre, q = 1.7, np.array([0.02, -0.03, 0.08]), posture(arm, 6)

    def energy(joints: np.ndarray) -> float:
        data, base = arm.model.createData(), pin.XYZQUATToSE3(arm.base)
        pin.forwardKinematics(arm.model, data, joints)
        links = [i.mass * base.act(data.oMi[k].act(i.lever))[2] for k, i in enumerate(arm.model.inertias) if k]
        return G * (sum(links) + mass * pin.XYZQUATToSE3(wrist_pose(arm, joints)).act(centre)[2])

    assert_jacobian(energy, gravity_torques(arm, q, mass, centre), q)
    assert np.array_equal(arm.model.gravity.linear, [0, 0, -G])  # the arm's own model is left as it is


def test_the_expressions_stay_small():
    arm = load_arm("panda")
    q = ca.SX.sym("q", 7)
    at = arm_forward(arm, q)
    assert ca.Function("f", [q], [at.rotation, at.position, at.spheres]).n_instructions() < 1000
    assert ca.Function("f", [q], [log_manipulability(arm, q)]).n_instructions() < 1000
    assert not ca.which_depends(log_manipulability(arm, q), q)[0]


def test_arms_of_the_package_are_far_from_singular_at_home():
    assert all(manipulability(load_arm(name), load_arm(name).home) > 0.05 for name in available_arms())


def test_a_golden_pose_of_the_panda():
    """The ready pose: flange 0.3069 m before and 0.5903 m above the base, looking down (Franka's documentation)."""
    arm = load_arm("panda")
    pose = wrist_pose(arm, arm.home)
    np.testing.assert_allclose(pose[:3], [0.3069 - 0.55, 0, 0.5903 - 0.095], atol=1e-4)
    np.testing.assert_allclose(pin.XYZQUATToSE3(pose).rotation, np.diag([1.0, -1.0, -1.0]), atol=1e-5)
    assert Path(arm.urdf).name == "panda.urdf"
