"""The volume of a link, from points on its meshes, which are often open, hollow, or made of many parts."""

import numpy as np
from scipy import ndimage

from sgnlp.base.arrays import Array, BoolArray

CELL = 0.0015
"""Edge of a link's cells [m]: half of what spheres may leave uncovered."""
CELLS = 120
"""Most cells along a link's longest side; a larger link has larger cells."""
HOLLOW = 0.015
"""A hollow counts as one if a ball of this radius fits into it [m]: grasped objects are larger."""
WALLS = 5
"""A cell is inside if it has skin in at least this many of the six axis directions: a shell may be open on one side."""


class Solid:
    """The cells of a grid that a body fills, and the depth of any point in it."""

    def __init__(self, skin: Array) -> None:
        """Fill what `skin` (K, 3) [m] encloses."""
        self.cell = max(CELL, float(np.ptp(skin, axis=0).max()) / CELLS)
        edge = int(np.ceil(HOLLOW / self.cell)) + 2
        self.low = skin.min(axis=0) - edge * self.cell
        index = self._index(skin)
        shell = np.zeros(index.max(axis=0) + edge + 1, bool)
        shell[tuple(index.T)] = True
        self.filled: BoolArray = _closed(shell | _walled(shell), HOLLOW / self.cell)
        inside, outside = (ndimage.distance_transform_edt(part) for part in (self.filled, ~self.filled))
        self._depth = self.cell * (inside - outside - np.where(self.filled, 0.5, -0.5))

    def depth(self, points: Array) -> Array:
        """Depth (K,) [m] of points (K, 3), exact to half a cell; negative outside."""
        return np.asarray(self._depth[tuple(np.clip(self._index(points), 0, np.array(self._depth.shape) - 1).T)])

    @property
    def thickness(self) -> float:
        """Twice the largest depth [m]."""
        return 2 * float(self._depth.max())

    def middles(self, count: int) -> Array:
        """About `count` middles (K, 3) [m] of filled cells, evenly spaced."""
        step = max(1, round((self.filled.sum() / count) ** (1 / 3)))
        cells = np.argwhere(self.filled)
        return self.low + (cells[(cells % step == 0).all(axis=1)] + 0.5) * self.cell

    def _index(self, points: Array) -> np.ndarray:
        return np.floor((points - self.low) / self.cell).astype(int)


def _walled(shell: BoolArray) -> BoolArray:
    """The cells that have skin in `WALLS` directions at least."""
    wall = ndimage.binary_dilation(shell, iterations=1)  # closes the gaps between points of the skin
    count = np.zeros(shell.shape, int)
    for axis in range(3):
        count += np.maximum.accumulate(wall, axis=axis)
        count += np.flip(np.maximum.accumulate(np.flip(wall, axis), axis=axis), axis)
    return count >= WALLS


def _closed(cells: BoolArray, radius: float) -> BoolArray:
    """The cells with those that a ball of a radius [cells] cannot reach from outside."""
    near = ndimage.binary_fill_holes(ndimage.distance_transform_edt(~cells) <= radius)
    return np.asarray((ndimage.distance_transform_edt(near) > radius) | cells)
