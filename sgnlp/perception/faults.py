"""Reasons why a cluster is not a graspable object: it is cut off, hangs in the air, overhangs the table, or is wide."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import binary_erosion

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.perception.observation import DEFAULTS
from sgnlp.perception.scene_planes import ScenePlane
from sgnlp.perception.scene_views import SceneView

BORDER, BORDER_PIXELS = 2, 10
"""[px] A cluster with this many pixels this near to the edge of an image continues beyond it."""
BEYOND, BEYOND_SHARE = 0.02, 0.1
"""A cluster reaches beyond the table if this share of its points is farther beside it than this [m]."""
HANGING, LOWEST = 0.04, 0.01
"""[m] A standing cluster has this quantile of its heights below this, or it hides the table below it."""
CELL, SEEN_SHARE = 0.01, 0.5
"""The table is visible under a cluster if this share of the cells [m] under it has points of the table."""


def fault(
    points: Array, pixels: Sequence[BoolArray], views: Sequence[SceneView], table: ScenePlane, on_table: Array
) -> str:
    """Why points (n, 3) are no object, as a phrase that follows "it"; "" if they may be one.

    `pixels` (H, W) are those of each view, `on_table` (m, 3) the points of the table.
    """
    width = float(np.ptp(points, axis=0).max())
    seen = [(mask, view) for mask, view in zip(pixels, views, strict=True) if mask.any()]
    if all(view.organised and _cut(mask) for mask, view in seen):
        return "is cut off by the image's edge"
    if table.count and float(np.mean(~table.over(points, BEYOND))) > BEYOND_SHARE:
        return "reaches beyond the table"
    if width > DEFAULTS.max_width:
        return f"is {width:.2f} m wide, more than {DEFAULTS.max_width:g} m"
    lowest = float(np.quantile(table.heights(points), LOWEST))
    if lowest > HANGING and _seen_under(points, on_table) > SEEN_SHARE:
        return f"hangs {100 * lowest:.0f} cm above the table"
    return ""


def _cut(mask: BoolArray) -> bool:
    inner = mask[BORDER:-BORDER, BORDER:-BORDER].sum()
    return int(mask.sum() - inner) >= BORDER_PIXELS


def _seen_under(points: Array, on_table: Array) -> float:
    """Share of the cells under points (n, 3), except at the edge, that have points (m, 3) of the table."""
    low = np.floor(points[:, :2].min(axis=0) / CELL)
    cells, table = ((np.floor(P[:, :2] / CELL) - low).astype(np.int64) for P in (points, on_table))
    shape = cells.max(axis=0) + 1
    table = table[((table >= 0) & (table < shape)).all(axis=1)]
    under, seen = np.zeros(shape, bool), np.zeros(shape, bool)
    under[cells[:, 0], cells[:, 1]] = True
    seen[table[:, 0], table[:, 1]] = True
    inner = binary_erosion(under)
    return float(seen[inner].mean()) if inner.any() else 0.0
