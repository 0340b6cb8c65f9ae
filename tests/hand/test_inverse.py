"""Inverse kinematics: the tips where they are to be, within the limits, as little moved as may be."""

import numpy as np
import pytest
from finite_differences import assert_jacobian
from scenes import hand
from scipy.optimize import least_squares

from sgnlp.hand.hand import load_hand
from sgnlp.hand.inverse import NEARNESS, closing_way, reached
from sgnlp.hand.kinematics import frames, tip_jacobian

WRIST = np.array([0.1, -0.05, 0.2, 0.1, 0.3, -0.2, 0.927])
WRIST[3:] /= np.linalg.norm(WRIST[3:])


def posture(of, seed: int) -> np.ndarray:
    """Random joints well inside their limits."""
    share = np.random.default_rng(seed).uniform(0.3, 0.7, len(of.joint_names))
    return of.lower + share * (of.upper - of.lower)


@pytest.mark.parametrize("name", ["allegro_left", "dlr_hit_right"])
def test_the_jacobian_of_the_tips_matches_differences(name):
    of = load_hand(name)
    q = posture(of, 0)
    assert_jacobian(lambda w: frames(of, WRIST, w)[0].ravel(), tip_jacobian(of, WRIST, q), q)


@pytest.mark.parametrize("name", ["allegro_left", "dlr_hit_right"])
@pytest.mark.parametrize("seed", range(3))
def test_points_that_the_fingers_reach_are_reached_within_the_limits(name, seed):
    of = load_hand(name)
    q, rng = posture(of, seed), np.random.default_rng(seed)
    wanted = np.clip(q + 0.2 * rng.normal(size=len(q)), of.lower, of.upper)
    points = frames(of, WRIST, wanted)[0]
    w = reached(of, WRIST, q, points)
    np.testing.assert_allclose(frames(of, WRIST, w)[0], points, atol=5e-5)
    assert (w >= of.lower).all()
    assert (w <= of.upper).all()
    assert np.linalg.norm(w - q) <= np.linalg.norm(wanted - q) + 1e-3


@pytest.mark.parametrize("away", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("seed", range(3))
def test_the_joints_are_as_good_as_those_of_scipys_least_squares(away, seed):
    of, rng = hand(), np.random.default_rng(seed)
    q = posture(of, seed)
    points = frames(of, WRIST, np.clip(q + 0.3 * rng.normal(size=len(q)), of.lower, of.upper))[0]
    points = points + away * rng.normal(size=points.shape)

    def cost(w):
        return np.append((frames(of, WRIST, w)[0] - points).ravel(), NEARNESS * (w - q))

    def slope(w):
        return np.vstack([tip_jacobian(of, WRIST, w), NEARNESS * np.eye(len(w))])

    theirs = least_squares(cost, q, slope, (of.lower, of.upper), ftol=1e-12).fun
    # the search ends when a step gains less than a thousandth
    assert np.linalg.norm(cost(reached(of, WRIST, q, points))) <= 1.005 * np.linalg.norm(theirs)


def test_a_point_out_of_reach_leaves_its_finger_short_and_the_others_where_they_are_to_be():
    q = posture(hand(), 0)
    points = frames(hand(), WRIST, q)[0]
    points[0] += [0.0, 0.0, 0.5]
    short = np.linalg.norm(frames(hand(), WRIST, reached(hand(), WRIST, q, points))[0] - points, axis=1)
    assert short[0] > 0.3
    assert short[1:].max() < 1e-4


def test_the_way_between_two_postures_leaves_out_both_and_goes_evenly_through_the_joints():
    q, w = posture(hand(), 0), posture(hand(), 1)
    way = closing_way(hand(), WRIST, q, w, 3)
    assert way.shape == (3, len(hand().spheres), 3)
    for share, spheres in zip((0.25, 0.5, 0.75), way, strict=True):
        np.testing.assert_allclose(spheres, frames(hand(), WRIST, q + share * (w - q))[1], atol=1e-15)
