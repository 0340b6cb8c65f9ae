"""Where a known surface has gone: the planar motion that brings it onto a new cloud."""

import numpy as np
import pytest
from finite_differences import assert_jacobian
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import observation, surface

from sgnlp.surface import registration
from sgnlp.surface.registration import NEAR, PlanarMotion, registered, spread

CENTRE = np.array([0.02, -0.01, 0.05])


@settings(deadline=None)
@given(st.floats(-0.5, 0.5), st.floats(-0.03, 0.03), st.floats(-0.03, 0.03), st.floats(-0.01, 0.02))
def test_the_motion_of_an_ellipsoid_is_found_from_other_points_of_it(yaw, x, y, rise):
    points = observation().points
    known, motion = points[::2], PlanarMotion(points.mean(axis=0), yaw, np.array([x, y, rise]))
    found = registered(surface(), known, motion(points[1::2]), rise)
    assert found.fits
    off = np.linalg.norm(found.motion(points) - motion(points), axis=1)
    assert off.max() < NEAR


def test_a_motion_and_its_inverse_are_none():
    motion, Z = PlanarMotion(CENTRE, 0.7, np.array([0.1, 0.2, 0.3])), np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(motion.inverse(motion(Z)), Z, atol=1e-14)
    np.testing.assert_allclose(
        np.linalg.norm(np.diff(motion(Z), axis=0), axis=1), np.linalg.norm(np.diff(Z, axis=0), axis=1)
    )
    np.testing.assert_allclose(motion(Z)[:, 2] - Z[:, 2], 0.3)


def test_the_moved_surface_is_the_surface_at_points_moved_back():
    gpis, motion = surface(), PlanarMotion(CENTRE, 0.4, np.array([0.3, -0.2, 0.01]))
    moved, Z = motion.moved(gpis), observation().points[:20] + 0.01
    np.testing.assert_allclose(moved.distance(motion(Z)), gpis.distance(Z), atol=1e-11)
    np.testing.assert_allclose(moved.deviation(motion(Z)), gpis.deviation(Z), atol=1e-11)
    np.testing.assert_allclose(moved.normal(motion(Z)), gpis.normal(Z) @ motion.rotation.T, atol=1e-9)


def test_the_offsets_are_differentiated_exactly():
    gpis, Z = surface(), spread(observation().points)[::10]
    motion, Y = PlanarMotion(CENTRE, 0.2, np.array([0.004, -0.003, 0.0])), observation().points[: len(Z)]
    N = gpis.normal(Y)

    def off(m):
        return registration.offsets(PlanarMotion(CENTRE, m[0], np.array([m[1], m[2], 0.0])), Z, Y, N)[0]

    at = np.array([motion.yaw, *motion.shift[:2]])
    assert_jacobian(off, registration.offsets(motion, Z, Y, N)[1], at)
    i = 3
    assert off(at)[i] == pytest.approx(N[i] @ (motion.inverse(Z[i]) - Y[i]))


def test_points_that_did_not_move_have_not_moved():
    points = observation().points
    found = registered(surface(), points, points)
    assert found.motion.yaw == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(found.motion.shift, 0.0, atol=1e-12)


def test_another_body_in_the_same_place_does_not_fit():
    points = observation().points
    squeezed = points * [1.0, 0.6, 1.0]
    assert not registered(surface(), points, squeezed).fits


def test_a_body_of_which_half_is_gone_does_not_fit():
    points = observation().points
    assert not registered(surface(), points, points[points[:, 0] > np.median(points[:, 0])]).fits


@pytest.mark.parametrize("count", [10, 10_000])
def test_spread_points_come_from_the_whole_cloud(count):
    points = np.arange(3.0 * count).reshape(-1, 3)
    found = spread(points)
    assert len(found) == min(count, registration.POINTS)
    np.testing.assert_array_equal(found[[0, -1]], points[[0, -1]])
