"""The height of the table beside an object: the median of the points around it, seen from above."""

import numpy as np

from sgnlp.base.arrays import Array

REACH = 0.1
"""The table is looked for this far around the box of the object's points [m]."""
FEWEST = 100
"""Fewest points of a table."""
DIGITS = 4
"""Decimals of the height [m]."""


def heights_around(cloud: Array, rest: Array) -> Array | None:
    """Heights (n,) [m] of the points `rest` (m, 3) that lie around a cloud (k, 3); None if they are few."""
    low, high = cloud[:, :2].min(axis=0) - REACH, cloud[:, :2].max(axis=0) + REACH
    heights = rest[((rest[:, :2] > low) & (rest[:, :2] < high)).all(axis=1), 2]
    return heights if len(heights) >= FEWEST else None


def rounded(height: float) -> float:
    """A height [m] with `DIGITS` decimals."""
    return round(float(height), DIGITS) + 0.0  # never -0


def median_height(heights: Array) -> float:
    """The median of heights (n,) [m], rounded."""
    return rounded(float(np.median(heights)))
