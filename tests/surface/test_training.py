"""The training set: which points, which values, which noise."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import observation

from sgnlp.base.surface_settings import GpisSettings
from sgnlp.surface.cube import cube_directions, interior_mixtures
from sgnlp.surface.training import training_set

SETTINGS = GpisSettings(surface_points=80)


def test_surface_exterior_and_interior_points_come_in_this_order_with_the_papers_values_and_noise():
    t = training_set(observation(), SETTINGS, 0)
    n, half = 80, t.kernel.amplitude
    assert len(t.X) == n + 14 + 50 == len(t.y) == len(t.noise)
    np.testing.assert_array_equal(t.y[:n], 0.0)
    np.testing.assert_allclose(t.y[n : n + 14], half)
    np.testing.assert_allclose(t.y[n + 14 :], -0.3 * half)
    np.testing.assert_array_equal(np.unique(t.noise[:n]), [0.005])
    np.testing.assert_array_equal(np.unique(t.noise[n : n + 14]), [0.2])
    np.testing.assert_array_equal(np.unique(t.noise[n + 14 :]), [0.05])
    assert t.prior == 1.0


def test_surface_points_are_measured_ones_or_their_copies_on_the_table():
    seen = observation()
    t = training_set(seen, SETTINGS, 0)
    shadow = seen.points * [1, 1, 0] + [0, 0, seen.table_height]
    known = {tuple(p) for p in np.concatenate([seen.points, shadow])}
    assert {tuple(p) for p in t.X[:80]} <= known
    assert (t.X[:80, 2] == seen.table_height).any()


def test_without_the_floor_every_surface_point_was_measured():
    t = training_set(observation(), replace(SETTINGS, floor=False), 0)
    assert {tuple(p) for p in t.X[:80]} <= {tuple(p) for p in observation().points}


def test_the_exterior_points_are_the_corners_and_face_centres_of_the_scaled_cube():
    t = training_set(observation(), replace(SETTINGS, cube_half_min=1e-3), 0)
    low, high = observation().points.min(axis=0), observation().points.max(axis=0)
    low[2] = 0.0
    half = t.kernel.amplitude
    assert half == pytest.approx(1.2 * (high - low).max() / 2)
    np.testing.assert_allclose(t.centre, (low + high) / 2)
    offsets = np.abs(t.X[80 : 80 + 14] - t.centre) / half
    np.testing.assert_allclose(np.sort(offsets.sum(axis=1)), [1] * 6 + [3] * 8)
    assert len(np.unique(cube_directions(), axis=0)) == 14


def test_the_support_radius_is_the_scaled_largest_distance_between_training_points():
    t = training_set(observation(), replace(SETTINGS, support_scale=1.3), 0)
    assert t.kernel.support_radius == pytest.approx(1.3 * np.linalg.norm(t.X[:, None] - t.X[None], axis=2).max())


def test_kernels_with_a_deviation_of_their_own_begin_at_the_exterior_value():
    t = training_set(observation(), replace(SETTINGS, kernel="matern52"), 0)
    assert t.prior == t.kernel.amplitude == t.y.max()


def test_the_cube_of_a_small_object_keeps_its_least_size():
    assert training_set(observation(), replace(SETTINGS, cube_half_min=0.15), 0).kernel.amplitude == 0.15


def test_interior_points_are_convex_mixtures_that_a_high_temperature_draws_to_the_mean():
    surface = training_set(observation(), SETTINGS, 0).X[:80]
    cold = interior_mixtures(surface, SETTINGS, 0)
    warm = interior_mixtures(surface, replace(SETTINGS, interior_temperature=1e6), 0)
    assert (cold >= surface.min(axis=0)).all()
    assert (cold <= surface.max(axis=0)).all()
    np.testing.assert_allclose(warm, np.tile(surface.mean(axis=0), (50, 1)), atol=1e-6)
    assert np.linalg.norm(cold - surface.mean(axis=0), axis=1).mean() > 0.01


def test_the_same_seed_gives_the_same_set_and_another_seed_another():
    a, b, c = (training_set(observation(), SETTINGS, seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(a.X, b.X)
    assert not np.array_equal(a.X, c.X)
