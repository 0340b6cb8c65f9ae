"""Subsets of a cloud: farthest points, and one point in each cell of a grid."""

import numpy as np
from numpy.typing import ArrayLike

from sgnlp.base.arrays import Array, IntArray, floats
from sgnlp.base.errors import InputError

MAX_POINTS = 50_000
"""Clouds above this are thinned on a grid first: a million points take a second then."""
GRID_CELLS = 2**20  # cells on each side of the centre of the thinning grid: three indices fit one int64


def farthest_points(points: ArrayLike, count: int, seed: int) -> IntArray:
    """Indices of `count` points, each the farthest from those before it; the first is drawn with `seed`.

    Fewer are returned if `points` (N, 3) has fewer distinct ones. It takes O(N count); clouds above `MAX_POINTS` are
    thinned on a grid first.
    """
    cloud = floats(points, "points", (None, 3))
    if count < 1 or len(cloud) == 0:
        raise InputError(f"cannot choose {count} of {len(cloud)} points")
    candidates = grid_sample(cloud, MAX_POINTS)
    cloud = cloud[candidates]
    squared = np.full(len(cloud), np.inf)  # distance of each point to the nearest chosen one
    farthest = np.random.default_rng(seed).integers(len(cloud))
    chosen: list[np.intp] = []
    while len(chosen) < count and squared[farthest] > 0:
        chosen.append(farthest)
        offset = cloud - cloud[farthest]
        np.minimum(squared, np.einsum("ij,ij->i", offset, offset), out=squared)
        farthest = squared.argmax()
    return candidates[chosen]


def grid_sample(points: Array, limit: int) -> IntArray:
    """Sorted indices of one point in each cell of a grid just coarse enough for at most `limit` points."""
    if len(points) <= limit:
        return np.arange(len(points))
    low, centre, high = np.quantile(points, (0.01, 0.5, 0.99), axis=0)
    edge = max((high - low).max(), np.finfo(np.float32).tiny) / np.sqrt(limit)
    while True:
        _, first = np.unique(grid_cells(points - centre, edge), return_index=True)
        if len(first) <= limit:
            return np.sort(first)
        edge *= max(np.sqrt(len(first) / limit), 1.05)  # the cells of a surface number as 1 / edge²


def grid_cells(points: Array, edge: float) -> IntArray:
    """The number (n,) of the grid cell of this edge [m] that each of the points (n, 3) is in."""
    cell = np.clip(np.floor(points / edge), -GRID_CELLS, GRID_CELLS - 1).astype(np.int64) + GRID_CELLS
    return np.asarray((cell[:, 0] * (2 * GRID_CELLS) + cell[:, 1]) * (2 * GRID_CELLS) + cell[:, 2])
