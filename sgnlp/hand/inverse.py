"""Inverse kinematics: the joints near given ones at which the fingertips are where they are to be."""

import numpy as np

from sgnlp.hand.hand import Array, Hand
from sgnlp.hand.kinematics import frames, tip_jacobian, tips

NEARNESS = 1e-4
"""What a radian off the given joints costs, in metres off the points: it settles what the tips leave free."""


def reached(hand: Hand, wrist: Array, joints: Array, points: Array) -> Array:
    """The joints (n,) [rad] within their limits that bring the tips to points (m, 3) [m], the wrist (7,) unmoved.

    min_w Σ |a_i(w) - p_i|² + ε² |w - q|², ε = `NEARNESS`, from the given joints q (n,): bounded least squares, as
    near to the points as the fingers come.
    """
    from scipy.optimize import least_squares  # a tenth of a second, which commands that plan nothing need not wait

    def residuals(w: Array) -> Array:
        return np.concatenate([(tips(hand, wrist, w) - points).ravel(), NEARNESS * (w - joints)])

    def jacobian(w: Array) -> Array:
        return np.vstack([tip_jacobian(hand, wrist, w), NEARNESS * np.eye(len(w))])

    begin, bounds = np.clip(joints, hand.lower, hand.upper), (hand.lower, hand.upper)
    return np.asarray(least_squares(residuals, begin, jacobian, bounds, method="dogbox").x)  # it ends on bounds too


def closing_way(hand: Hand, wrist: Array, joints: Array, joints_contact: Array, samples: int) -> Array:
    """Sphere centres (samples, S, 3) [m] at postures between those joints (n,), both ends left out."""
    shares = np.linspace(0.0, 1.0, samples + 2)[1:-1]
    return np.array([frames(hand, wrist, (1 - s) * joints + s * joints_contact)[1] for s in shares])
