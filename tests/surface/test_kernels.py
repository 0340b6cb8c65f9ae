"""Kernels: their derivatives, their two readings, and that they are covariances."""

import casadi as ca
import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.surface.kernels import KERNELS, ThinPlate, kernel

REACH, AMPLITUDE = 0.35, 0.12  # [m]
NAMES = sorted(KERNELS)


def radii(seed: int = 0, count: int = 40) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.01, 0.99, count) * REACH


@pytest.mark.parametrize("name", NAMES)
def test_dk_d2k_and_d3k_are_the_repeated_radial_derivatives_of_k(name):
    r = ca.SX.sym("r")
    chain = [kernel(name, REACH, AMPLITUDE).radial(r)[0]]
    for _ in range(3):
        chain.append(ca.jacobian(chain[-1], r) / r)  # D = (1/r) d/dr
    expected = ca.Function("expected", [r], [ca.vertcat(*chain)])
    for value in radii():
        found = np.array(kernel(name, REACH, AMPLITUDE).radial(value), float)
        np.testing.assert_allclose(found, np.array(expected(value)).ravel(), rtol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_the_numpy_and_the_casadi_reading_agree_in_and_beyond_the_ball(name):
    r = ca.SX.sym("r")
    symbolic = ca.Function("k", [r], list(kernel(name, REACH, AMPLITUDE).radial(r)))
    for value in [*radii(1), REACH, 1.5 * REACH]:
        numbers = np.array(kernel(name, REACH, AMPLITUDE).radial(np.array(value)), float)
        np.testing.assert_allclose(np.array(symbolic(value)).ravel(), numbers, rtol=1e-13, atol=1e-300)


def test_the_thin_plate_is_the_published_cubic_inside_its_ball():
    r = radii(2)
    published = 2 * r**3 - 3 * REACH * r**2 + REACH**3
    np.testing.assert_allclose(ThinPlate(REACH, AMPLITUDE).radial(r)[0], published, rtol=1e-12, atol=1e-16)


def test_the_thin_plate_and_its_slope_vanish_at_the_edge_of_its_ball_and_stay_zero_outside():
    model = ThinPlate(REACH, AMPLITUDE)
    near, beyond = model.radial(REACH * (1 - 1e-9)), model.radial(np.array([REACH, 1.01 * REACH, 3 * REACH]))
    assert abs(near[0]) < 1e-17
    assert abs(near[1]) < 1e-8
    for order in beyond:
        np.testing.assert_array_equal(order, 0.0)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_the_covariance_of_points_within_the_ball_is_positive_definite(name, seed):
    X = np.random.default_rng(seed).uniform(-1, 1, (60, 3)) * REACH / np.sqrt(12)
    r = np.linalg.norm(X[:, None] - X[None], axis=2)
    assert r.max() <= REACH
    K = kernel(name, REACH, AMPLITUDE).radial(np.maximum(r, 1e-9))[0]
    assert np.linalg.eigvalsh(K).min() > 0


@pytest.mark.parametrize("name", sorted({*KERNELS} - {"thin_plate"}))
def test_the_prior_variance_is_the_squared_amplitude(name):
    assert kernel(name, REACH, AMPLITUDE).radial(1e-9)[0] == pytest.approx(AMPLITUDE**2, rel=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_every_kernel_falls_with_distance(name):
    k = kernel(name, REACH, AMPLITUDE).radial(np.sort(radii()))[0]
    assert (np.diff(k) < 0).all()


def test_an_unknown_kernel_is_refused_with_the_names_of_the_known_ones():
    with pytest.raises(InputError, match=r"unknown kernel 'cubic'; valid: matern32, matern52, .*, thin_plate"):
        kernel("cubic", REACH, AMPLITUDE)
