"""The lifted rotation to the equilibrium: against the closed form differentiated, and differences of it."""

import casadi as ca
import numpy as np
import pytest
from scenes import random_rotation
from test_equilibrium import DERIVATIVES, KINDS, SINGULAR, VALUE, assert_slopes, derivatives, profiles

from sgnlp.program.attitude import attitude, stiffness
from sgnlp.program.lifting import Lifting


def lifted() -> tuple[ca.Function, ca.Function]:
    """B → (R, ρ), and (B, w) → gradient and Hessian of w·(R, ρ)."""
    b, w = ca.SX.sym("B", 9), ca.SX.sym("w", 10)
    chain = Lifting(b)
    R, rho = attitude(chain.lift("profile", ca.reshape(b, 3, 3)), chain)
    energy = ca.dot(w, ca.vertcat(ca.vec(R), rho))
    value = ca.Function("value", [b], chain.values([R, rho]))
    return value, ca.Function("derivatives", [b, w], chain.values([chain.gradient(energy), chain.hessian([energy])]))


PLACE, SLOPES = lifted()


def slopes(B, w):
    g, H = SLOPES(B.ravel(order="F"), w)
    return np.array(g).ravel(), np.array(H)


@pytest.mark.parametrize("kind", KINDS)
def test_value_and_derivatives_are_those_of_the_closed_form(kind):
    w = np.random.default_rng(3).normal(size=10)
    for B in profiles(kind, 20, seed=6):
        for found, expected in zip(PLACE(B.ravel(order="F")), VALUE(B)[:2], strict=True):
            np.testing.assert_allclose(np.array(found), np.array(expected), rtol=1e-12, atol=1e-12)
        for found, expected in zip(slopes(B, w), derivatives(B, w), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("kind", KINDS)
def test_gradient_and_hessian_match_differences(kind):
    rng = np.random.default_rng(1)
    for B in profiles(kind, 5, seed=2):
        assert_slopes(lambda B: PLACE(B.ravel(order="F")), slopes, B, rng.normal(size=10))


@pytest.mark.parametrize("name", SINGULAR)
def test_nothing_is_nan_even_where_no_rotation_is_the_best(name):
    for found in (*PLACE(SINGULAR[name].ravel(order="F")), *slopes(SINGULAR[name], np.ones(10))):
        assert np.isfinite(np.array(found)).all()


def test_off_the_equilibrium_the_stiffness_is_that_of_the_symmetric_part():
    rng = np.random.default_rng(4)
    R, B = random_rotation(rng), rng.normal(size=(3, 3))
    x = ca.SX.sym("x", 9)
    chain = Lifting(x)
    rho = stiffness(ca.SX(R), chain.lift("profile", ca.reshape(x, 3, 3)), chain)
    found = ca.Function("f", [x], chain.values([rho]))(B.ravel(order="F"))
    H = np.trace(R @ B.T) * np.eye(3) - (R @ B.T + B @ R.T) / 2
    assert float(found) == pytest.approx(np.linalg.det(H) / np.trace(R @ B.T) ** 2, rel=1e-10)


def test_the_derivatives_are_short():
    assert 2 * SLOPES.n_instructions() < DERIVATIVES.n_instructions()
