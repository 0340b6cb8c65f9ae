"""The side that no camera saw, guessed: an object looks the same after half a turn about a vertical axis.

So do boxes, cans, balls and most bottles that stand on a table. The axis is not known. After half a turn about the
right one, hardly a measured point lies where a camera saw that there is nothing. Of all axes of which this is true, one
is taken that leaves the object narrow. Bohg et al. (2011) choose a vertical plane in much the same way, and mirror the
points in it.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array
from sgnlp.perception.free_space import Sight, free
from sgnlp.perception.sampling import farthest_points

SOME = 100
"""Number of measured points that the axis is chosen with."""
FRONT = 0.003
"""A turned point is free if it is this far in front of what was measured [m]: of 1, 3 and 6 mm, 1 and 3 mm gave the
least error on the tuning half."""
NARROW = 0.1
"""Weight of the object's width beside the share of free points: chosen on the tuning half of the problem set, where the
error hardly changes between 0.03 and 0.1, and is larger with 0.3."""
MOST_FREE = 0.04
"""Share of free points above which the object is not symmetric. On the tuning half, seen from one view, the guess is
off by 4 mm in the median up to this share and by 8 mm above it, where it gains little."""
GROWN = 0.5
"""Axes are sought in the points' box, grown by this share of its longer side."""
AXES, FINER = 17, 9
"""Number of axes on a side of the grid, and on a side of a finer one around the best of them."""
APART = 0.008
"""A turned point nearer than this to a measured one [m] tells nothing new."""


def hidden_side(points: Array, seen_by: Sequence[Sight], seed: int) -> Array:
    """Points (k, 3) [m] of the hidden side: the measured ones (n, 3) after half a turn about the best axis.

    There are none if too many would be free: then the object is not symmetric. Those that a camera saw to be free, and
    those near a measured one are left out.
    """
    turned = half_turn(points, axis(points, seen_by, seed))
    if free(seen_by, turned, FRONT).mean() > MOST_FREE:
        return np.empty((0, 3))
    turned = turned[~free(seen_by, turned)]
    if not len(turned):
        return turned
    return np.asarray(turned[cKDTree(points).query(turned, distance_upper_bound=APART)[0] > APART])


def half_turn(points: Array, about: Array) -> Array:
    """Points (..., 3) [m] after half a turn about vertical axes `about` (..., 2) [m]."""
    flat = 2 * about - points[..., :2]
    return np.concatenate([flat, np.broadcast_to(points[..., 2:], (*flat.shape[:-1], 1))], axis=-1)


def axis(points: Array, seen_by: Sequence[Sight], seed: int) -> Array:
    """The vertical axis a (2,) [m] with the least `cost`, on a grid and then on a finer one."""
    some = points[farthest_points(points, SOME, seed)]
    low, high = some[:, :2].min(axis=0), some[:, :2].max(axis=0)
    half = (high - low) / 2 + GROWN * (high - low).max()
    middle = (low + high) / 2
    for count, share in ((AXES, 1.0), (FINER, 2 / (AXES - 1))):
        steps = share * np.linspace(-1, 1, count)
        grid = middle + half * np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        middle = grid[cost(grid, some, seen_by).argmin()]
    return middle


def cost(axes: Array, points: Array, seen_by: Sequence[Sight]) -> Array:
    """f(a) + w (1 + dᵀ C⁻¹ d)^¼ (A,) of axes a (A, 2) [m].

    f is the share of the points (n, 3) that are free after half a turn. Seen from above, the points have the mean m and
    the covariance C. With d = a - m, points and turned points together have the covariance C + d dᵀ. The fourth root of
    its determinant over that of C says how many times wider the whole is than the measured part.
    """
    turned = half_turn(points, axes[:, None])
    share = free(seen_by, turned.reshape(-1, 3), FRONT).reshape(len(axes), -1).mean(axis=1)
    off = axes - points[:, :2].mean(axis=0)
    C = np.cov(points[:, :2].T) + FRONT**2 * np.eye(2)
    return np.asarray(share + NARROW * (1 + np.einsum("ai,ij,aj->a", off, np.linalg.inv(C), off)) ** 0.25)
