"""Inverse kinematics by damped Gauss-Newton steps (Levenberg-Marquardt) that keep the joints within their limits.

A joint that would exceed its limit stops there, and the others compensate.
"""

from collections.abc import Callable

import numpy as np

from sgnlp.base.arrays import Array

MAX_STEPS = 60
MAX_TURN = 0.8
"""Largest change of a joint in one step [rad or m]: beyond it the pose is not linear in the joints any more."""
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-12, 1.0
EASIER, HARDER = 0.1, 10.0
"""Factors of the damping after a step that reduces the error, and after one that does not."""
DONE = 1e-9
"""Length of e [m and rad] that counts as zero."""
STALLED = 1e-3
"""A step that reduces |e| by less than this share hardly helps."""
PATIENCE = 3
"""This many such steps in a row end the search."""

Place = Callable[[Array], tuple[Array, Array]]
"""The error e (k,) at joints q (n,), and J (k, n), by which it falls: e(q + s) ≈ e - J s."""


def nearest(place: Place, begin: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """The joints (n,) within their limits with the smallest |e|, found from `begin` (n,), and e (k,) there."""
    q, damping, slow = np.clip(begin, lower, upper), FIRST_DAMPING, 0
    e, J = place(q)
    for _ in range(MAX_STEPS):
        length = np.linalg.norm(e)
        if length < DONE or slow == PATIENCE or damping > MOST_DAMPING:
            break
        there = np.minimum(np.maximum(q + _step(e, J, lower - q, upper - q, damping), lower), upper)
        error, jacobian = place(there)
        gain = 1.0 - np.linalg.norm(error) / length
        if gain > 0:
            q, e, J, damping = there, error, jacobian, max(EASIER * damping, LEAST_DAMPING)
            slow = slow + 1 if gain < STALLED else 0
        else:
            damping *= HARDER
    return q, e


def _step(e: Array, J: Array, low: Array, high: Array, damping: float) -> Array:
    """A step (n,) of at most `MAX_TURN` between `low` and `high` (n,).

    min |J s - e|² + λ |s|². Joints that would exceed their limits are fixed there, and the others are solved for again.
    """
    step, free = np.zeros(len(low)), np.ones(len(low), bool)
    while free.any():
        own = J[:, free]
        step[free] = np.linalg.solve(
            own.T @ own + damping * np.eye(own.shape[1]), own.T @ (e - J[:, ~free] @ step[~free])
        )
        beyond = free & ((step < low) | (step > high))
        if not beyond.any():
            break
        step[beyond] = np.minimum(np.maximum(step, low), high)[beyond]
        free &= ~beyond
    return step * (MAX_TURN / max(float(np.abs(step).max()), MAX_TURN))
