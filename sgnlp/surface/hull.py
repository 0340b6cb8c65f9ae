"""The visual hull: all space above the table that no camera saw to be free. It contains the object."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.perception.free_space import Sight, free, sights
from sgnlp.perception.observation import Observation

CELL = 0.004
"""Least edge of a grid cell [m]: smaller than the error of the silhouettes."""
MAX_CELLS = 100_000
"""Approximate number of grid cells; for wider objects the cells are larger."""


@dataclass(frozen=True, eq=False)
class Hull:
    """A grid around the hull."""

    centres: Array  # (n, 3) [m] of the cells
    free: BoolArray  # (n,)
    distance: Array  # (n,) [m] distance to the nearest cell of the hull, 0 inside
    cell: float  # [m] edge of a cell

    @property
    def base(self) -> Array:
        """Points (k, 3) [m] of the table under the hull's lowest cells, which stand on it."""
        lowest = self.centres[:, 2].min()
        under = self.centres[~self.free & (self.centres[:, 2] == lowest)]
        return under - [0.0, 0.0, self.cell / 2]


def cameras_of(observation: Observation) -> tuple[Sight, ...]:
    """What each camera of an observation saw; empty if the cameras are unknown."""
    o = observation
    if o.camera_positions is None:
        return ()
    return sights(o.points, o.view, o.camera_positions, o.background, o.background_view)


def visual_hull(observation: Observation, seen_by: Sequence[Sight], reach: float) -> Hull:
    """The visual hull of an observation, on a grid that ends `reach` [m] from the points' box."""
    o = observation
    low, high = o.points.min(axis=0) - reach, o.points.max(axis=0) + reach
    low[2] = o.table_height
    cell = max(CELL, float(np.cbrt(np.prod(high - low) / MAX_CELLS)))
    shape = np.ceil((high - low) / cell).astype(int)
    centres = low + cell * (np.indices(shape).reshape(3, -1).T + 0.5)
    seen = free(seen_by, centres)
    grid = seen.reshape(shape)
    distance = cell * ndimage.distance_transform_edt(grid) if not grid.all() else np.full(shape, np.inf)
    return Hull(centres, seen, np.ravel(distance), cell)
