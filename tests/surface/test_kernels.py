"""Kernels: their derivatives, their two readings, and that they are covariances."""

import casadi as ca
import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.surface.kernels import KERNELS, ThinPlate, named

R, AMPLITUDE = 0.35, 0.12  # [m]
NAMES = sorted(KERNELS)


def radii(seed: int = 0, count: int = 40) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.01, 0.99, count) * R


@pytest.mark.parametrize("name", NAMES)
def test_the_numpy_and_the_casadi_reading_agree_in_and_beyond_the_ball(name):
    r = ca.SX.sym("r")
    symbolic = ca.Function("k", [r], list(named(name)(R, AMPLITUDE).radial(r)))
    for value in [*radii(1), R, 1.5 * R]:
        numbers = np.array(named(name)(R, AMPLITUDE).radial(np.array(value)), float)
        np.testing.assert_allclose(np.array(symbolic(value)).ravel(), numbers, rtol=1e-13, atol=1e-300)


def test_the_thin_plate_is_the_published_cubic_inside_its_ball():
    r = radii(2)
    published = 2 * r**3 - 3 * R * r**2 + R**3
    np.testing.assert_allclose(ThinPlate(R, AMPLITUDE).radial(r)[0], published, rtol=1e-12, atol=1e-16)


def test_the_thin_plate_and_its_slope_vanish_at_the_edge_of_its_ball_and_stay_zero_outside():
    model = ThinPlate(R, AMPLITUDE)
    near, beyond = model.radial(R * (1 - 1e-9)), model.radial(np.array([R, 1.01 * R, 3 * R]))
    assert abs(near[0]) < 1e-17
    assert abs(near[1]) < 1e-8
    for order in beyond:
        np.testing.assert_array_equal(order, 0.0)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_the_covariance_of_points_within_the_ball_is_positive_definite(name, seed):
    X = np.random.default_rng(seed).uniform(-1, 1, (60, 3)) * R / np.sqrt(12)
    r = np.linalg.norm(X[:, None] - X[None], axis=2)
    assert r.max() <= R
    K = named(name)(R, AMPLITUDE).radial(np.maximum(r, 1e-9))[0]
    assert np.linalg.eigvalsh(K).min() > 0


@pytest.mark.parametrize("name", sorted({*KERNELS} - {"thin_plate"}))
def test_the_prior_variance_is_the_squared_amplitude(name):
    assert named(name)(R, AMPLITUDE).radial(1e-9)[0] == pytest.approx(AMPLITUDE**2, rel=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_every_kernel_falls_with_distance(name):
    k = named(name)(R, AMPLITUDE).radial(np.sort(radii()))[0]
    assert (np.diff(k) < 0).all()


def test_an_unknown_kernel_is_refused_with_the_names_of_the_known_ones():
    with pytest.raises(InputError, match=r"unknown kernel 'cubic'; valid: matern32, matern52, .*, thin_plate"):
        named("cubic")
