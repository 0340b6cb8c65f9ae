"""A surface that is known as the zero level set of a function, as a mesh."""

from collections.abc import Callable

import numpy as np

from sgnlp.base.arrays import Array, IntArray
from sgnlp.base.errors import InputError

GRID = 40
"""Cells along the longest side of the box."""
CHUNK = 2048
"""Query points at a time, because the posterior needs arrays (Q, N)."""


def level_set(function: Callable[[Array], Array], low: Array, high: Array) -> tuple[Array, IntArray]:
    """Vertices (V, 3) [m] and faces (F, 3) of {x : function(x) = 0} in the box from `low` to `high` (3,) [m].

    `function` takes points (Q, 3) to values (Q,), which are negative inside. Seen from outside, the corners of a face
    turn counter-clockwise. By marching cubes.

    Raises:
        InputError: the function has one sign all over the box, or scikit-image is not installed.
    """
    try:
        from skimage.measure import marching_cubes
    except ImportError:
        raise InputError("the mesh of a surface needs scikit-image: pip install 'sgnlp[view]'") from None
    step = float((high - low).max()) / GRID
    axes = [np.arange(a, b + step, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = chunked(function, grid.reshape(-1, 3)).reshape(grid.shape[:3])
    if not values.min() < 0 < values.max():
        raise InputError("the surface model has no surface near the points")
    vertices, faces, _, _ = marching_cubes(values, 0.0, spacing=(step,) * 3, gradient_direction="descent")
    return vertices + low, np.asarray(faces, int)


def chunked(function: Callable[[Array], Array], points: Array) -> Array:
    """A function of points (Q, 3), evaluated in chunks."""
    parts = [points[i : i + CHUNK] for i in range(0, len(points), CHUNK)]
    return np.concatenate([function(part) for part in parts])
