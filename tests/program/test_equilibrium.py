"""The equilibrium in closed form: against an SVD, against statics, and as a minimum."""

from itertools import permutations

import casadi as ca
import numpy as np
import pytest
from finite_differences import assert_jacobian, jacobian
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import random_rotation
from scipy.spatial.transform import Rotation

from sgnlp.program.equilibrium import (
    GRAVITY,
    adjugate,
    gibbs_vector,
    printed_profile,
    profile,
    root_guess,
    rotation,
    stiffness,
    translation,
    turned,
    weighted_mean,
)

M = 4
KINDS = ("random", "coplanar", "reflected", "half_turn", "equal", "two_equal", "small", "reflected_small_gap")


def functions() -> tuple[ca.Function, ca.Function]:
    """B → (R, ρ, root) and (B, root, w) → gradient and Hessian of w·(R, ρ) at a frozen root."""
    B, root, w = ca.SX.sym("B", 3, 3), ca.SX.sym("root"), ca.SX.sym("w", 10)
    R, rho = rotation(B, root)
    H, g = ca.hessian(ca.dot(w, ca.vertcat(ca.vec(R), rho)), ca.vec(B))
    value = ca.Function("value", [B], [*rotation(B, root_guess(B)), root_guess(B)])
    return value, ca.Function("derivatives", [B, root, w], [g, H])


def grasp_function(printed: bool = False) -> ca.Function:
    """(P, O, k, mass, com) → R, t, ρ, B."""
    P, O, k = ca.SX.sym("P", M, 3), ca.SX.sym("O", M, 3), ca.SX.sym("k", M)
    mass, com = ca.SX.sym("mass"), ca.SX.sym("com", 3)
    B = printed_profile(P, O, k) if printed else profile(P, O, k, mass, com)
    R, rho = rotation(B, root_guess(B))
    return ca.Function(
        "grasp", [P, O, k, mass, com], [R, translation(R, weighted_mean(k, P), weighted_mean(k, O), k, mass), rho, B]
    )


def stiffness_function() -> ca.Function:
    """(R, B) → ρ."""
    R, B = ca.SX.sym("R", 3, 3), ca.SX.sym("B", 3, 3)
    S = R @ B.T
    return ca.Function("stiffness", [R, B], [stiffness((S + S.T) / 2)])


VALUE, DERIVATIVES = functions()
STIFFNESS = stiffness_function()
EXACT, PRINTED = grasp_function(), grasp_function(printed=True)


def solve(P, O, k, mass=0.0, com=(0, 0, 0), f=EXACT):
    R, t, rho, B = (np.array(a) for a in f(P, O, k, mass, com))
    return R, t.ravel(), rho.item(), B


def derivatives(B, w):
    g, H = DERIVATIVES(B, VALUE(B)[2], w)
    return np.array(g).ravel(), np.array(H)


def profiles(kind: str, count: int, seed: int = 0) -> np.ndarray:
    """Profiles (count, 3, 3) of a kind, none of them singular: (s2 + s3')/s1 ≥ 0.02."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        U, V = random_rotation(rng), random_rotation(rng)
        s = np.sort(rng.uniform(0.05, 1, 3))[::-1]
        singular = {
            "random": s * [1, 1, rng.choice([-1, 1])],
            "coplanar": s * [1, 1, 0],
            "reflected": s * [1, 1, -1],
            "half_turn": s,
            "equal": np.full(3, s[0]),
            "two_equal": s[[0, 0, 2]] if rng.random() < 0.5 else s[[0, 1, 1]],
            "small": 1e-4 * s,
            "reflected_small_gap": np.array([s[0], s[1], -(s[1] - rng.uniform(0.02, 0.05) * s[0])]),
        }[kind]
        if singular[1] + singular[2] < 0.0199 * singular[0]:
            continue
        if kind == "half_turn":  # R = U Vᵀ turns by 180° - 1e-4
            axis = random_rotation(rng)[:, 0]
            V = (2 * np.outer(axis, axis) - np.eye(3)).T @ U
            V = _turn(axis, 1e-4 * rng.random()) @ V
        found.append(U @ np.diag(singular) @ V.T)
    return np.array(found)


def _turn(axis, angle):
    K = np.cross(np.eye(3), -axis)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def nearest_rotation(B):
    """Rotation and signed singular values by an SVD."""
    U, s, Vt = np.linalg.svd(B)
    sign = np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    return U @ np.diag([1, 1, sign]) @ Vt, s * [1, 1, sign]


def random_grasp(seed: int, scatter: float = 0.01):
    """Contacts, targets and gains of a grasp of a 7 cm object, with a load."""
    rng = np.random.default_rng(seed)
    P = rng.normal(size=(M, 3)) * 0.035
    O = 0.6 * P + scatter * rng.normal(size=(M, 3))
    return P, O, rng.uniform(40, 400, M), rng.uniform(0.05, 0.5), 0.02 * rng.normal(size=3)


def potential(R, t, P, O, k, mass, com):
    return 0.5 * k @ ((P @ R.T + t - O) ** 2).sum(axis=1) + mass * GRAVITY * (R @ com + t)[2]


@pytest.mark.parametrize("kind", KINDS)
def test_the_rotation_and_its_stiffness_equal_those_of_an_svd(kind):
    every = profiles(kind, 1250)  # 10⁴ over all kinds
    R, s = zip(*map(nearest_rotation, every), strict=True)
    s1, s2, s3 = np.transpose(s)
    found, rho, _ = (np.array(a) for a in VALUE(np.hstack(every)))  # for each three columns
    np.testing.assert_allclose(found, np.hstack(R), atol=1e-9)
    expected = (s1 + s2) * (s2 + s3) * (s1 + s3) / (s1 + s2 + s3) ** 2
    np.testing.assert_allclose(rho.ravel(), expected, rtol=1e-9)
    np.testing.assert_allclose(np.array(STIFFNESS(np.hstack(R), np.hstack(every))).ravel(), expected, rtol=1e-9)


def assert_slopes(value, slopes, B, w):
    """Gradient and Hessian of w·(R, ρ) at B, which `slopes` gives, are those of differences; `value` gives (R, ρ)."""
    scale, b = np.linalg.norm(B), B.ravel(order="F")
    step = 3e-3 * np.sum(nearest_rotation(B)[1][1:])
    w = np.append(w[:9], w[9] / scale)

    def energy(b):
        R, rho = value(b.reshape(3, 3).T)
        return w @ np.append(np.array(R).ravel(order="F"), float(rho))

    g, H = slopes(B, w)
    assert_jacobian(energy, g, b, 1e-6, step)
    assert_jacobian(lambda b: slopes(b.reshape(3, 3).T, w)[0], H, b, 1e-6, step)
    np.testing.assert_allclose(H, H.T, atol=1e-9 * np.abs(H).max())


@pytest.mark.parametrize("kind", KINDS)
def test_gradient_and_hessian_of_rotation_and_stiffness_match_differences(kind):
    rng = np.random.default_rng(1)
    for B in profiles(kind, 10, seed=2):
        assert_slopes(lambda B: VALUE(B)[:2], derivatives, B, rng.normal(size=10))


def test_freezing_the_root_changes_neither_value_nor_derivatives():
    B = ca.SX.sym("B", 3, 3)
    R, rho = rotation(B, root_guess(B))  # the iteration differentiated along
    w = np.random.default_rng(3).normal(size=10)
    H, g = ca.hessian(ca.dot(w, ca.vertcat(ca.vec(R), rho)), ca.vec(B))
    through = ca.Function("through", [B], [g, H])
    for kind in ("random", "coplanar", "reflected"):
        for b in profiles(kind, 10, seed=5):
            for frozen, differentiated in zip(derivatives(b, w), through(b), strict=True):
                expected = np.array(differentiated).reshape(frozen.shape)
                np.testing.assert_allclose(frozen, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())


SINGULAR = {
    "zero": np.zeros((3, 3)),
    "rank one": 0.01 * np.outer([1, 2, 3], [3, 1, 2]),
    "rank one along an axis": np.diag([1.0, 0, 0]),
    "reflection": -np.eye(3),
    "reflection with two equal values": np.diag([1.0, 0.5, -0.5]),
    "reflection with three equal values": np.diag([1.0, 1.0, -1.0]),
    "below the guard": 1e-13 * np.diag([3.0, 2.0, 1.0]),
    "huge": 1e9 * np.diag([3.0, 2.0, 1.0]),
}


@pytest.mark.parametrize("name", SINGULAR)
def test_nothing_is_nan_even_where_no_rotation_is_the_best(name):
    B = SINGULAR[name]
    for a in (*VALUE(B), *derivatives(B, np.ones(10))):
        assert np.isfinite(np.array(a)).all()


@pytest.mark.parametrize("name", [n for n in SINGULAR if "below" not in n and n != "huge"])
def test_stiffness_vanishes_where_no_rotation_is_the_best(name):
    assert abs(float(VALUE(SINGULAR[name])[1])) < 1e-5


def test_the_adjugate_times_the_matrix_is_its_determinant():
    B = np.random.default_rng(0).normal(size=(3, 3))
    adj = np.array(ca.DM(adjugate(ca.DM(B))))
    np.testing.assert_allclose(B @ adj, np.linalg.det(B) * np.eye(3), atol=1e-14)


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_net_force_and_torque_vanish_at_the_equilibrium(seed, loaded):
    P, O, k, mass, com = random_grasp(seed)
    mass *= loaded
    R, t, _, _ = solve(P, O, k, mass, com)
    there = P @ R.T + t
    f, weight = k[:, None] * (O - there), np.array([0, 0, -mass * GRAVITY])
    force = f.sum(axis=0) + weight
    torque = np.cross(there, f).sum(axis=0) + np.cross(R @ com + t, weight)
    sizes = np.linalg.norm(f, axis=1)
    assert np.linalg.norm(force) < 1e-10 * sizes.sum()
    assert np.linalg.norm(torque) < 1e-10 * (sizes * np.linalg.norm(there, axis=1)).sum()


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_no_other_pose_of_the_object_has_less_energy(seed, loaded):
    P, O, k, mass, com = random_grasp(seed, scatter=0.03)
    mass *= loaded
    R, t, _, _ = solve(P, O, k, mass, com)
    least, rng = potential(R, t, P, O, k, mass, com), np.random.default_rng(seed)
    load = np.array([0, 0, mass * GRAVITY])
    for _ in range(500):
        Q = random_rotation(rng)
        best = (k @ O - load) / k.sum() - Q @ (k @ P) / k.sum()
        assert potential(Q, best, P, O, k, mass, com) >= least - 1e-12
        nudge = _turn(random_rotation(rng)[:, 0], 1e-3) @ R
        assert potential(nudge, t + 1e-4 * rng.normal(size=3), P, O, k, mass, com) > least


@pytest.mark.parametrize("seed", range(5))
def test_the_curvature_of_the_potential_over_rotations_has_the_documented_eigenvalues(seed):
    P, O, k, mass, com = random_grasp(seed)
    R, _, rho, B = solve(P, O, k, mass, com)
    load = np.array([0, 0, mass * GRAVITY])

    def energy(theta):
        angle = np.linalg.norm(theta)
        Q = (_turn(theta / angle, angle) if angle else np.eye(3)) @ R
        t = (k @ O - load) / k.sum() - Q @ (k @ P) / k.sum()  # the object yields
        return potential(Q, t, P, O, k, mass, com)

    H = jacobian(lambda theta: jacobian(energy, theta, 0.02), np.zeros(3), 0.02)
    s1, s2, s3 = nearest_rotation(B)[1]
    expected = np.sort([s2 + s3, s1 + s3, s1 + s2])
    np.testing.assert_allclose(np.linalg.eigvalsh(H), expected, rtol=1e-5)
    assert rho == pytest.approx(np.prod(expected) / (s1 + s2 + s3) ** 2, rel=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_off_the_equilibrium_the_stiffness_is_that_of_the_curvature_there(seed):
    """The lifted program passes through such points: the potential -tr(Rᵀ B) of the rotation is curved there too."""
    P, O, k, mass, com = random_grasp(seed)
    R, _, rho, B = solve(P, O, k, mass, com)
    rng = np.random.default_rng(seed)
    away = _turn(random_rotation(rng)[:, 0], 0.4) @ R

    def energy(theta):
        return -np.trace(Rotation.from_rotvec(theta).as_matrix() @ away @ B.T)

    H = jacobian(lambda theta: jacobian(energy, theta, 0.02), np.zeros(3), 0.02)
    found = float(STIFFNESS(away, B))
    assert found == pytest.approx(np.linalg.det(H) / (np.trace(H) / 2) ** 2, rel=1e-4)
    assert abs(found - rho) > 1e-3 * rho


def test_the_printed_profile_is_the_true_one_for_equal_gains_and_grows_with_all_gains_alike():
    for seed in range(5):
        P, O, k, _, _ = random_grasp(seed)
        equal = np.full(M, 80.0)
        np.testing.assert_allclose(solve(P, O, equal, f=PRINTED)[3], solve(P, O, equal)[3], rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(solve(P, O, 3 * k, f=PRINTED)[3], 3 * solve(P, O, k, f=PRINTED)[3], rtol=1e-12)
        assert solve(P, O, 3 * k, f=PRINTED)[2] == pytest.approx(3 * solve(P, O, k, f=PRINTED)[2], rel=1e-9)


def test_algorithm_1_as_printed_is_the_equilibrium_for_equal_gains_only():
    for seed in range(10):
        P, O, k, _, _ = random_grasp(seed)
        equal = np.full(M, 80.0)
        np.testing.assert_allclose(solve(P, O, equal, f=PRINTED)[0], solve(P, O, equal)[0], atol=1e-10)
        R, t, *_ = solve(P, O, k, f=PRINTED)
        there = P @ R.T + t
        f = k[:, None] * (O - there)
        assert np.linalg.norm(f.sum(axis=0)) < 1e-10  # its translation is right
        assert np.linalg.norm(np.cross(there, f).sum(axis=0)) > 1e-4  # [N m]
        best = solve(P, O, k)
        assert potential(R, t, P, O, k, 0, np.zeros(3)) > potential(*best[:2], P, O, k, 0, np.zeros(3))


def test_gravity_lowers_the_object_by_its_weight_over_the_summed_gains():
    P, O, k, mass, _ = random_grasp(4)
    com = k @ P / k.sum()  # no torque
    with_load, without = solve(P, O, k, mass, com), solve(P, O, k)
    np.testing.assert_allclose(with_load[0], without[0], atol=1e-10)
    np.testing.assert_allclose(with_load[1] - without[1], [0, 0, -mass * GRAVITY / k.sum()], atol=1e-10)


@settings(max_examples=50)
@given(seed=st.integers(0, 10**6), a=st.integers(0, 10**6), b=st.integers(0, 10**6))
def test_turning_and_shifting_contacts_and_targets_turns_the_equilibrium_along(seed, a, b):
    P, O, k, _, _ = random_grasp(seed)
    A, C = (random_rotation(np.random.default_rng(i)) for i in (a, b))
    shift, offset = np.random.default_rng(a).normal(size=(2, 3))
    R, t, rho, _ = solve(P, O, k)
    moved = P @ A.T + shift, O @ C.T + offset
    R_, t_, rho_, _ = solve(*moved, k)
    np.testing.assert_allclose(R_, C @ R @ A.T, atol=1e-6)
    assert rho_ == pytest.approx(rho, rel=1e-6)
    np.testing.assert_allclose(moved[0] @ R_.T + t_, (P @ R.T + t) @ C.T + offset, atol=1e-6)


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), order=st.sampled_from(list(permutations(range(M)))))
def test_the_order_of_the_fingers_does_not_matter(seed, order):
    P, O, k, mass, com = random_grasp(seed)
    order = list(order)
    for a, b in zip(solve(P, O, k, mass, com), solve(P[order], O[order], k[order], mass, com), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-7)


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), factor=st.floats(0.01, 100))
def test_scaling_all_gains_keeps_the_pose_and_scales_the_stiffness(seed, factor):
    P, O, k, _, _ = random_grasp(seed)
    R, t, rho, _ = solve(P, O, k)
    R_, t_, rho_, _ = solve(P, O, factor * k)
    np.testing.assert_allclose(R_, R, atol=1e-7)
    np.testing.assert_allclose(t_, t, atol=1e-7)
    assert rho_ == pytest.approx(factor * rho, rel=1e-6)


@given(angle=st.floats(1e-9, 3.1), seed=st.integers(0, 10_000))
@settings(max_examples=50)
def test_a_gibbs_vector_is_the_axis_times_the_tangent_of_half_the_angle(angle, seed):
    axis = random_rotation(np.random.default_rng(seed))[:, 0]
    expected, w = Rotation.from_rotvec(angle * axis).as_matrix(), np.tan(angle / 2) * axis
    np.testing.assert_allclose(np.array(turned(ca.DM(w))), expected, atol=1e-12)
    np.testing.assert_allclose(np.array(gibbs_vector(ca.DM(expected))).ravel(), w, rtol=1e-7, atol=1e-12)


def test_the_stiffness_of_a_rotation_that_is_a_saddle_has_another_sign_or_is_less():
    for B in profiles("random", 50, seed=5):
        R, _ = nearest_rotation(B)
        axis = np.linalg.svd(B)[0][:, 0]  # a half turn about it is an equilibrium too, and no minimum
        saddle = float(STIFFNESS(_turn(axis, np.pi) @ R, B))
        assert saddle < float(STIFFNESS(R, B))
