"""Inverse kinematics: joints near given ones that bring the fingertips to given points."""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames, tip_jacobian, tips

NEARNESS = 1e-4
"""Cost of a radian off the given joints, in metres off the points: it fixes joint motions that do not move a tip."""


def reached(hand: Hand, wrist: Array, joints: Array, points: Array) -> Array:
    """The joints (n,) [rad] within their limits that bring the tips to points (m, 3) [m], for a fixed wrist (7,).

    min_w Σ |a_i(w) - p_i|² + ε² |w - q|², ε = `NEARNESS`, from the given joints q (n,), by bounded least squares. If
    the points are out of reach, the tips come as near as possible.
    """
    from scipy.optimize import least_squares  # imported here: it takes a tenth of a second, which not all commands need

    def residuals(w: Array) -> Array:
        return np.concatenate([(tips(hand, wrist, w) - points).ravel(), NEARNESS * (w - joints)])

    def jacobian(w: Array) -> Array:
        return np.vstack([tip_jacobian(hand, wrist, w), NEARNESS * np.eye(len(w))])

    begin, bounds = np.clip(joints, hand.lower, hand.upper), (hand.lower, hand.upper)
    # this method can end on bounds
    return np.asarray(least_squares(residuals, begin, jacobian, bounds, method="dogbox").x)


def closing_way(hand: Hand, wrist: Array, joints: Array, joints_contact: Array, samples: int) -> Array:
    """Sphere centres (samples, S, 3) [m] at postures between the two joint vectors (n,), without both ends."""
    shares = np.linspace(0.0, 1.0, samples + 2)[1:-1]
    return np.array([frames(hand, wrist, (1 - s) * joints + s * joints_contact)[1] for s in shares])
