"""The training set from free space: points outside the object, values that are distances, a better guess."""

from dataclasses import replace

import numpy as np
import pytest
from views import BOX, EYES, MIDDLE, RADIUS, ball, box_seen, cup_seen

from sgnlp.base.surface_settings import FreeSpace, GpisSettings
from sgnlp.perception.observation import observe
from sgnlp.surface.gpis import fit
from sgnlp.surface.hull import cameras_of, visual_hull
from sgnlp.surface.inside import centroid
from sgnlp.surface.training import training_set

GPIS, FREE = GpisSettings(), FreeSpace(used=True)


def carved(observation, **changes):
    return training_set(observation, GPIS, 0, free_space=replace(FREE, **changes))


def off(X):
    """Signed distances (n,) [m] of points to the ball."""
    return np.linalg.norm(X - MIDDLE, axis=1) - RADIUS


def test_the_hull_holds_the_ball_and_little_more():
    hull = visual_hull(ball(), cameras_of(ball()), reach=0.05)
    inside = off(hull.centres) < 0
    assert not hull.free[inside].any()
    assert 1.0 < (~hull.free).sum() / inside.sum() < 3.5
    assert (hull.distance[hull.free] <= off(hull.centres[hull.free]) + hull.cell).all()
    assert (hull.distance[~hull.free] == 0).all()


def test_exterior_points_are_outside_and_their_values_within_the_true_distance():
    t = carved(ball(), table_points=0, surface_points=50, symmetry_points=0)
    assert (t.y[:50] == 0).all()
    near, far = slice(50, 50 + FREE.near_points), slice(50 + FREE.near_points, None)
    assert len(t.y[far]) == FREE.far_points
    cell = 0.0045
    for band, least, most, share in (
        (near, FREE.near_from, FREE.near_to, 1.0),
        (far, FREE.far_from, FREE.far_to, FREE.far_share),
    ):
        assert (t.y[band] > share * least).all()
        assert (t.y[band] < share * most).all()
        assert (off(t.X[band]) > t.y[band] / share - cell).all()
        assert np.unique(t.noise[band]).tolist() == [FREE.noise]
    assert t.prior == FREE.prior_mean
    assert t.deviation_scale == FREE.deviation_scale


def test_points_of_the_table_are_on_it_and_under_the_cloud():
    t = carved(ball(), surface_points=50, table_points=20)
    table = t.X[50:70]
    np.testing.assert_allclose(table[:, 2], 0.0, atol=1e-12)
    assert (np.linalg.norm(table[:, :2], axis=1) < RADIUS + 0.01).all()
    assert (t.y[50:70] == 0).all()


def test_the_guessed_side_is_nearer_to_the_truth_than_without_free_space():
    views = [box_seen(eye, seed=number) for number, eye in enumerate(EYES)]
    view = np.repeat([0, 1], [len(points) for points in views])
    box = observe(np.concatenate(views), view=view, camera_positions=EYES, table_height=0.0, name="box")
    x, z = np.meshgrid(np.linspace(-0.02, 0.02, 9), np.linspace(0.02, 0.08, 9))
    hidden = np.stack([x.ravel(), np.full(81, -BOX[1] / 2), z.ravel()], axis=1)
    before, after = (
        np.abs(fit(training_set(box, GPIS, 0, free_space=free)).distance(hidden)).mean() for free in (FreeSpace(), FREE)
    )
    assert after < 0.7 * before


def test_a_cup_that_a_camera_looked_into_is_hollow():
    eye = np.array([0.25, 0.0, 0.5])
    points = cup_seen(eye)
    cup = observe(points, view=np.zeros(len(points), int), camera_positions=eye[None], table_height=0.0, name="cup")
    hollow = np.array([[0.0, 0.0, 0.045], [0.0, 0.0, 0.06], [-0.01, 0.0, 0.05], [0.0, 0.01, 0.07]])
    filled = fit(training_set(cup, GPIS, 0)).mean(hollow)
    assert (filled < 0).any()
    assert (fit(carved(cup)).mean(hollow) > 0.005).all()


def test_without_cameras_or_with_wrong_ones_the_papers_set_is_fitted():
    for cameras in (None, EYES * [-1, -1, 1]):
        unknown = replace(ball(), camera_positions=cameras)
        a, b = training_set(unknown, GPIS, 0, free_space=FREE), training_set(unknown, GPIS, 0)
        np.testing.assert_array_equal(a.X, b.X)
        np.testing.assert_array_equal(a.y, b.y)
        assert (a.prior, a.kernel, a.deviation_scale, a.free_space) == (b.prior, b.kernel, 1.0, False)
        assert carved(ball()).free_space


def test_the_scale_of_the_deviation_is_that_of_kernel_and_noise_and_leaves_the_mean():
    t = training_set(ball(), GpisSettings(kernel="matern52", surface_points=60), 0)
    s = 0.4
    scaled = fit(replace(t, deviation_scale=s))
    twin = fit(replace(t, kernel=replace(t.kernel, amplitude=s * t.kernel.amplitude), noise=s * t.noise))
    Z = MIDDLE + 0.06 * np.random.default_rng(1).uniform(-1, 1, (40, 3))
    np.testing.assert_allclose(scaled.mean(Z), twin.mean(Z), atol=1e-10)
    np.testing.assert_allclose(scaled.deviation(Z), twin.deviation(Z), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(scaled.deviation(Z), s * fit(t).deviation(Z), rtol=1e-6, atol=1e-9)
    assert scaled.prior_variance == pytest.approx((s * t.kernel.amplitude) ** 2)


def test_the_same_seed_gives_the_same_set():
    a, b, c = (training_set(ball(), GPIS, seed, free_space=FREE).X for seed in (3, 3, 4))
    np.testing.assert_array_equal(a, b)
    assert a.shape != c.shape or not np.array_equal(a, c)


def test_a_background_that_returned_nothing_beside_the_object_carves_nothing_there():
    seen = ball(EYES[:1])
    silent = replace(seen, background=np.array([[5.0, 5.0, 5.0]]), background_view=np.array([0]))
    carved_away, kept = (visual_hull(cloud, cameras_of(cloud), 0.05).free.mean() for cloud in (seen, silent))
    assert kept < 0.5 * carved_away


def test_the_centroid_is_that_of_the_ball_and_none_of_nothing():
    gpis = fit(carved(ball()))
    low, high = np.array([-0.06, -0.06, 0.0]), np.array([0.06, 0.06, 0.1])
    np.testing.assert_allclose(centroid(gpis, low, high), MIDDLE, atol=4e-3)
    np.testing.assert_allclose(centroid(gpis, low, high, cells=30000), centroid(gpis, low, high), atol=1e-3)
    assert centroid(gpis, low + 0.2, high + 0.2) is None
