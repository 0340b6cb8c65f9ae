"""Cautions about a cloud of two objects without a gap: one that touches another, or stands on a plate or tray.

Shapes alone cannot tell two objects from one, so these are cautions; no cloud of the problem set or of a real object of
one piece gives one.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.perception.observation import Observation
from sgnlp.planning.cautions.clouds import PLANE_MARGIN, PLANE_THICKNESS, bodies, plane, plane_of
from sgnlp.planning.cautions.measures import sample
from sgnlp.planning.cautions.planned import Planned

CELL, CLOSED = 0.003, 3
"""[m] Cells of the outline seen from above; gaps between points of up to twice so many cells are closed."""
DENSE = 0.0015
"""[m] Largest spacing of the points, seen from above: the outline of a sparser cloud frays and has other necks."""
NECK, PART_SHARE, PART_RADIUS = 0.7, 0.25, 0.02
"""Two objects touch at a neck at most this share as wide as the narrower of them; each has the second share of the
outline and holds a circle of this radius [m]. Of 412 good clouds the narrowest neck, of a toy car, is 0.78; two cans,
two balls and two boxes that are shifted have 0.44 to 0.73."""
LEVEL = np.cos(np.radians(10))
"""Least vertical part of the normal of a level plane."""
PLATE_SHARE, PLATE_INSIDE, PLATE_RATIO, STANDING_SHARE = 0.5, 0.95, 5.0, 0.05
"""A plate holds at least the first share of the points; the second share of what is above it stands inside its edge; it
is this many times as wide; and above it is at least the last share. Closest are toy cars, with 0.41, 1, 3.7, 0.28, and
toy planes, with 0.59, 0.78, 6.6 and 0.17. Upright planes are left out: the wings of a toy plane are as a wall."""


def touching(cloud: Observation, result: Planned) -> str:
    """Two parts that a narrow neck joins, seen from above."""
    found = neck(cloud.points)
    if found is None or found.width > NECK or bodies(cloud, result):
        return ""
    parts = (
        f"two parts, the smaller of {found.share:.0%}, that a neck {found.width:.0%} as wide as the narrower one joins"
    )
    return f"Seen from above, the cloud has {parts}: if they are two objects that touch, cut one off before planning."


def stand(cloud: Observation, result: Planned) -> str:
    """A level plane above the table with something narrow on it."""
    points, found = sample(cloud.points), plane_of(cloud)
    above = points[:, 2] - found.height
    if abs(found.normal[2]) < LEVEL or found.share < PLATE_SHARE or (above > PLANE_MARGIN).mean() < STANDING_SHARE:
        return ""
    try:
        plate, feet = ConvexHull(points[np.abs(above) < PLANE_THICKNESS, :2]), points[above > PLANE_MARGIN, :2]
        ratio = float(plate.volume / ConvexHull(feet).volume)
    except (QhullError, ValueError):  # on one line, or too few
        return ""
    inside = float((-(feet @ plate.equations[:, :2].T + plate.equations[:, 2]).max(axis=1) > PLANE_MARGIN).mean())
    if inside < PLATE_INSIDE or ratio < PLATE_RATIO or plane(cloud, result):
        return ""
    height = 1e3 * (found.height - cloud.table_height)
    wide = f"is {ratio:.1f} times as wide as what stands on it"
    way = f"`sgnlp cloud --table-height {found.height:.3f}` of the scene"
    return (
        f"A level plane {height:.0f} mm above the table holds {found.share:.0%} of the points, and {wide}: if that "
        f"is an object on a plate, tray or box, take it out alone by {way}."
    )


@dataclass(frozen=True)
class Neck:
    """A narrow place of an outline."""

    width: float  # over that of the narrower of the two parts that it joins
    share: float  # of the smaller part in the outline's area


def neck(points: Array) -> Neck | None:
    """The neck at which the outline of points (n, 3), seen from above, falls into two parts when it is worn away."""
    outline = _outline(points)
    if CELL * np.sqrt(outline.sum() / len(points)) > DENSE:
        return None
    inward = np.asarray(ndimage.distance_transform_edt(outline)) * CELL
    for half in np.arange(CELL, inward.max() - PART_RADIUS * (1 - NECK), CELL):
        label, count = ndimage.label(inward > half)
        if count < 2:
            continue
        nearest = ndimage.distance_transform_edt(label == 0, return_distances=False, return_indices=True)
        areas = np.bincount(label[tuple(nearest)][outline], minlength=count + 1)[1:] / outline.sum()
        first, second = np.argsort(-areas)[:2]
        radius = min(inward[label == first + 1].max(), inward[label == second + 1].max())
        if areas[second] >= PART_SHARE:
            return Neck(float(half / radius), float(areas[second])) if radius >= PART_RADIUS else None
    return None


def _outline(points: Array) -> BoolArray:
    """The cells that points (n, 3) cover, seen from above, without gaps and holes, and a margin around them."""
    cells = ((points[:, :2] - points[:, :2].min(axis=0)) / CELL).astype(np.int64) + CLOSED + 1
    covered = np.zeros(cells.max(axis=0) + CLOSED + 2, bool)
    covered[cells[:, 0], cells[:, 1]] = True
    return np.asarray(ndimage.binary_fill_holes(ndimage.binary_closing(covered, iterations=CLOSED)))
