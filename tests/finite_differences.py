"""Central differences with Richardson's extrapolation: the one checker of every derivative in these tests."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 2e-4
"""Largest step; variables are scaled to order 1."""
LEVELS = 3
"""Steps, each half of the one before: the error is O(STEP⁶), rounding about 1e-11 of the value."""


def jacobian(f: Callable[[Array], Any], x: Array, step: float = STEP) -> Array:
    """∂f/∂x (…, nx) at x (nx,) of a function with values of any shape."""
    return np.stack([_directional(f, x, e, step) for e in np.eye(len(x))], axis=-1)


def _directional(f: Callable[[Array], Any], x: Array, e: Array, step: float) -> Array:
    steps = [step / 2**level for level in range(LEVELS)]
    table = [(np.asarray(f(x + h * e), float) - np.asarray(f(x - h * e), float)) / (2 * h) for h in steps]
    for order in range(1, LEVELS):
        table = [fine + (fine - coarse) / (4**order - 1) for coarse, fine in pairwise(table)]
    return table[0]


def assert_jacobian(
    f: Callable[[Array], Any], J: Any, x: Array, tolerance: float = 1e-6, step: float = STEP, floor: float = 0.0
) -> None:
    """J equals ∂f/∂x to `tolerance` times its largest number, or times `floor` where that is larger.

    With a gradient for f it checks a Hessian.
    """
    expected = jacobian(f, x, step)
    found = np.asarray(J, float).reshape(expected.shape)
    assert np.isfinite(found).all(), "the derivative is not finite"
    error = np.abs(found - expected)
    worst = np.unravel_index(error.argmax(), error.shape)
    scale = max(float(np.abs(expected).max()), floor)
    assert error.max() <= tolerance * scale, (
        f"at {tuple(map(int, worst))}: {found[worst]:.12g}, by differences {expected[worst]:.12g}, scale {scale:.3g}"
    )


def assert_products(
    f: Callable[[Array], Any], J: Any, x: Array, tolerance: float = 1e-6, count: int = 4, seed: int = 0
) -> None:
    """The same along `count` directions that move every variable at once: a wrong number of J shows in each of them.

    It takes a tenth of the evaluations where there are many variables.
    """
    directions = np.random.default_rng(seed).choice([-1.0, 1.0], (count, len(x)))
    expected = np.stack([_directional(f, x, v, STEP / np.sqrt(len(x))) for v in directions], axis=-1)
    found = np.asarray(J, float) @ directions.T
    assert np.isfinite(found).all(), "the derivative is not finite"
    error = np.abs(found - expected).max()
    scale = float(np.abs(J).max())
    assert error <= tolerance * scale, f"off by {error:.3g}, scale {scale:.3g}"
