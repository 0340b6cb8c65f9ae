"""The inside of an implicit surface, sampled on a grid: its centroid estimates the object's centre of mass."""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.surface.gpis import Gpis

CELLS = 3000
"""Approximate number of grid cells: if a body fills a tenth of them, its centroid is exact to a tenth of a cell."""


def centroid(gpis: Gpis, low: Array, high: Array, cells: int = CELLS) -> Array | None:
    """The centroid (3,) [m] of μ < 0 in the box from `low` (3,) to `high` (3,) [m]; None if μ is nowhere negative."""
    sides = np.asarray(high) - low
    shape = np.maximum(np.round(sides * np.cbrt(cells / np.prod(sides))), 1).astype(int)
    centres = low + sides * (np.indices(tuple(shape)).reshape(3, -1).T + 0.5) / shape
    inside = gpis.mean(centres) < 0
    return np.asarray(centres[inside].mean(axis=0)) if inside.any() else None
