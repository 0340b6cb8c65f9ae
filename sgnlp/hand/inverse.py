"""Inverse kinematics: joints near given ones that bring the fingertips to given points."""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.damped import nearest
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames, tip_jacobian, tips

NEARNESS = 1e-4
"""Cost of a radian off the given joints, in metres off the points: it fixes joint motions that do not move a tip."""


def reached(hand: Hand, wrist: Array, joints: Array, points: Array) -> Array:
    """The joints (n,) [rad] within their limits that bring the tips to points (m, 3) [m], for a fixed wrist (7,).

    min_w Σ |a_i(w) - p_i|² + ε² |w - q|², ε = `NEARNESS`, from the given joints q (n,). If the points are out of reach,
    the tips come as near as possible.
    """

    def place(w: Array) -> tuple[Array, Array]:
        errors = (points - tips(hand, wrist, w)).ravel(), NEARNESS * (joints - w)
        return np.concatenate(errors), np.vstack([tip_jacobian(hand, wrist, w), NEARNESS * np.eye(len(w))])

    return nearest(place, joints, hand.lower, hand.upper)[0]


def closing_way(hand: Hand, wrist: Array, joints: Array, joints_contact: Array, samples: int) -> Array:
    """Sphere centres (samples, S, 3) [m] at postures between the two joint vectors (n,), without both ends."""
    shares = np.linspace(0.0, 1.0, samples + 2)[1:-1]
    return np.array([frames(hand, wrist, (1 - s) * joints + s * joints_contact)[1] for s in shares])
