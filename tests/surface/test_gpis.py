"""The implicit surface against independent regression, CasADi's differentiation, and bodies whose surface is known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import SEMI_AXES, observation, random_rotation, sphere_points, surface

from sgnlp.base.errors import InputError
from sgnlp.base.surface_settings import GpisSettings
from sgnlp.surface.cube import cube_directions
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.kernels import KERNELS, ThinPlate
from sgnlp.surface.training import TrainingSet, max_distance, training_set

NAMES = sorted(KERNELS)


def queries(gpis: Gpis, count: int = 30, seed: int = 1) -> np.ndarray:
    """Random points of the ball in which the model holds."""
    return gpis.centre + 0.7 * gpis.radius * sphere_points(count, seed) * (
        0.1 + 0.9 * (np.arange(count) / count)[:, None]
    )


def training(name: str = "thin_plate") -> TrainingSet:
    return training_set(observation(), GpisSettings(kernel=name, surface_points=60, interior_points=15), 0)


def covariance(name: str, A: np.ndarray, B: np.ndarray, R: float, amplitude: float) -> np.ndarray:
    """k(A, B) from the textbook forms, written anew."""
    r = np.linalg.norm(A[:, None] - B[None], axis=2)
    length = {"matern32": R / 2, "matern52": R / 2, "squared_exponential": R / 4}.get(name, 1.0)
    u = r / length
    return {
        "thin_plate": 2 * r**3 - 3 * R * r**2 + R**3,
        "matern32": amplitude**2 * (1 + np.sqrt(3) * u) * np.exp(-np.sqrt(3) * u),
        "matern52": amplitude**2 * (1 + np.sqrt(5) * u + 5 * u**2 / 3) * np.exp(-np.sqrt(5) * u),
        "squared_exponential": amplitude**2 * np.exp(-(u**2) / 2),
    }[name]


def rotated(t: TrainingSet, Q: np.ndarray, shift: np.ndarray) -> TrainingSet:
    return replace(t, X=t.X @ Q.T + shift, centre=Q @ t.centre + shift)


@pytest.mark.parametrize("name", NAMES)
def test_the_posterior_matches_textbook_regression_by_a_numpy_cholesky(name):
    t, gpis = training(name), surface(KERNELS[name])
    Z = queries(gpis)
    R = 1.5 * np.linalg.norm(t.X[:, None] - t.X[None], axis=2).max()
    k = covariance(name, Z, t.X, R, t.kernel.amplitude)
    L = np.linalg.cholesky(covariance(name, t.X, t.X, R, t.kernel.amplitude) + np.diag(t.noise**2))
    mean = t.prior + k @ np.linalg.solve(L.T, np.linalg.solve(L, t.y - t.prior))
    variance = covariance(name, Z, Z, R, t.kernel.amplitude).diagonal() - (np.linalg.solve(L, k.T) ** 2).sum(axis=0)
    np.testing.assert_allclose(gpis.mean(Z), mean, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(gpis.deviation(Z) ** 2, variance, rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_the_variance_is_never_negative_nor_above_the_prior_even_far_outside(name):
    gpis = surface(KERNELS[name])
    rays = sphere_points(200, 2)
    for distance in (0.0, 0.1, 0.3, 0.5, 1.0, 100.0):
        deviation = gpis.deviation(gpis.centre + distance * rays)
        assert np.isfinite(deviation).all()
        assert (deviation >= 0).all()
        assert (deviation <= np.sqrt(gpis.prior_variance) * (1 + 1e-12)).all()
    assert gpis.deviation(gpis.X).min() < 0.5 * np.sqrt(gpis.prior_variance)


def test_far_outside_the_mean_returns_to_the_prior_and_is_never_inside():
    gpis = surface()
    far = gpis.centre + 3 * gpis.kernel.support_radius * sphere_points(50, 3)
    np.testing.assert_allclose(gpis.mean(far), gpis.prior)
    for distance in np.linspace(0.1, 1.0, 10):
        assert gpis.mean(gpis.centre + distance * sphere_points(300, 5)).min() > 0


@pytest.mark.parametrize("name", NAMES)
def test_far_outside_distance_and_normal_are_finite(name):
    gpis = surface(KERNELS[name])
    far = gpis.centre + 5.0 * sphere_points(20, 3)
    assert np.isfinite(gpis.distance(far)).all()
    assert np.isfinite(gpis.distance_deviation(far)).all()
    assert np.isfinite(gpis.normal(far)).all()


def test_within_the_ball_every_training_point_is_nearer_than_the_support_radius():
    gpis = surface()
    edge = gpis.centre + gpis.radius * sphere_points(300, 6)
    assert np.linalg.norm(edge[:, None] - gpis.X[None], axis=2).max() <= gpis.kernel.support_radius * (1 + 1e-9)
    farthest = np.linalg.norm(gpis.X - gpis.centre, axis=1).max()
    assert gpis.radius + farthest == pytest.approx(gpis.kernel.support_radius)


def known_body(points: np.ndarray, inside: np.ndarray, centre: np.ndarray, half: float) -> TrainingSet:
    """A body seen on all sides, with exact values at the points inside it."""
    X = np.concatenate([points, inside])
    y = np.repeat([0.0, -half], [len(points), len(inside)])
    return TrainingSet(X, y, np.full(len(X), 1e-3), 1.0, ThinPlate(max_distance(X), 0.1), centre)


def test_metric_distance_and_normal_are_close_to_the_truth_around_a_sphere_seen_from_all_sides():
    radius, centre = 0.05, np.array([0.1, -0.2, 0.3])
    t = known_body(centre + radius * sphere_points(300, 0), centre[None], centre, radius)
    outside = centre + 0.2 * sphere_points(20, 9)
    t = replace(t, X=np.concatenate([t.X, outside]), y=np.concatenate([t.y, np.full(20, 0.15)]),
                noise=np.concatenate([t.noise, np.full(20, 0.05)]))  # fmt: skip
    gpis = fit(replace(t, kernel=ThinPlate(max_distance(t.X), 0.1)))
    n = sphere_points(100, 7)
    for distance in (-2e-3, 0.0, 2e-3):
        Z = centre + (radius + distance) * n
        np.testing.assert_allclose(gpis.distance(Z), distance, atol=1e-3)
        assert (gpis.normal(Z) * n).sum(axis=1).min() > np.cos(np.radians(10))


def test_metric_distance_and_normal_are_close_to_the_truth_over_a_plane():
    grid = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 15), np.linspace(-0.1, 0.1, 15)), axis=-1).reshape(-1, 2)
    plane = np.column_stack([grid, np.zeros(len(grid))])
    above, below = (np.add(plane[::8], [0, 0, z]) for z in (0.05, -0.05))
    far = 0.2 * cube_directions()  # of no weight: only for an R beyond the plane, whose corners are an R apart
    counts = [len(plane), len(above), len(below), len(far)]
    X = np.concatenate([plane, above, below, far])
    y, noise = np.repeat([0.0, 0.05, -0.05, 0.0], counts), np.repeat([1e-3, 1e-3, 1e-3, 10.0], counts)
    gpis = fit(TrainingSet(X, y, noise, 0.0, ThinPlate(max_distance(X), 0.1), np.zeros(3)))
    inner = np.random.default_rng(0).uniform(-0.06, 0.06, (50, 2))
    for height in (-0.01, 0.0, 0.01):
        Z = np.column_stack([inner, np.full(50, height)])
        np.testing.assert_allclose(gpis.distance(Z), height, atol=5e-4)
        assert gpis.normal(Z)[:, 2].min() > np.cos(np.radians(3))


def test_normals_of_the_observed_ellipsoid_point_out_of_it():
    gpis = surface()
    centre = np.array([0.0, 0.0, SEMI_AXES[2]])
    seen = observation().points[::20]
    outward = (seen - centre) / SEMI_AXES**2
    assert ((gpis.normal(seen) * outward).sum(axis=1) > 0).all()
    assert gpis.mean(centre[None])[0] < 0


@settings(max_examples=15)
@given(seed=st.integers(0, 2**31), shift=st.tuples(*[st.floats(-0.5, 0.5)] * 3), name=st.sampled_from(NAMES))
def test_moving_the_object_moves_the_surface_along(seed, shift, name):
    Q, shift = random_rotation(np.random.default_rng(seed)), np.array(shift)
    here, there = surface(KERNELS[name]), fit(rotated(training(name), Q, shift))
    Z = queries(here, 10)
    moved = Z @ Q.T + shift
    np.testing.assert_allclose(there.mean(moved), here.mean(Z), rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(there.deviation(moved), here.deviation(Z), rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(there.normal(moved), here.normal(Z) @ Q.T, atol=1e-6)
    np.testing.assert_allclose(there.centre, Q @ here.centre + shift, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_interpolation_improves_as_the_noise_goes_to_zero(name):
    t = training(name)
    t = replace(t, kernel=replace(t.kernel, support_radius=max_distance(t.X)), prior=1.0)  # far off every value

    def error(scale: float) -> float:
        return np.abs(fit(replace(t, noise=t.noise * scale)).mean(t.X) - t.y).max()

    errors = [error(scale) for scale in (1.0, 0.1, 0.01, 1e-3, 1e-4)]
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < 0.1 * errors[0]
    assert error(0.0) < 1e-6


def test_an_unknown_kernel_is_refused_with_the_valid_names():
    with pytest.raises(InputError, match=r"unknown kernel 'cubic'; valid: matern32.*thin_plate"):
        training("cubic")


def test_a_covariance_that_is_not_positive_definite_is_refused_in_one_line():
    t = training("squared_exponential")
    doubled = replace(t, X=np.concatenate([t.X, t.X]), y=np.tile(t.y, 2), noise=np.zeros(2 * len(t.X)))
    with pytest.raises(InputError, match="kernel 'squared_exponential': its covariance is not positive definite"):
        fit(doubled)


def test_a_fitted_surface_cannot_be_changed():
    for array in (surface().X, surface().alpha, surface().chol_inverse):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_surface_with_more_observations_is_the_one_fitted_to_all(count):
    whole = training()
    noise = float(whole.noise[-1])
    first = replace(whole, X=whole.X[:-count], y=whole.y[:-count], noise=whole.noise[:-count])
    grown, fitted = fit(first).observed(whole.X[-count:], whole.y[-count:], noise), fit(whole)
    np.testing.assert_allclose(grown.chol_inverse, fitted.chol_inverse, atol=1e-8 * abs(fitted.chol_inverse).max())
    np.testing.assert_allclose(grown.alpha, fitted.alpha, atol=1e-8 * abs(fitted.alpha).max())
    Z = queries(fitted)
    np.testing.assert_allclose(grown.mean(Z), fitted.mean(Z), atol=1e-9)
    np.testing.assert_allclose(grown.deviation(Z), fitted.deviation(Z), atol=1e-9)
    assert grown.radius == pytest.approx(fitted.radius)
