"""The table of a whole scene: of the planes in it, the one that objects stand on.

The largest plane need not be the table: a wall, or the floor around the table, may be larger. So several planes are
found, and for each the things standing on it are measured. (`level` uses the pixels around a known object from a known
camera; here neither is known.)
"""

from collections.abc import Sequence

import numpy as np

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.perception.scene_planes import (
    ABOVE_DEVIATIONS,
    FIT_DEVIATIONS,
    PLANE_ERROR,
    SAME_DEG,
    ScenePlane,
    hull_area,
)

MIN_WIDTH = 0.15
"""[m] Least width of a table's points."""
FOOT, FOOT_HEIGHT = 0.008, 0.01
"""[m] Feet of things on a plane are points from the first height above it (or above its noise) through the second one.
There must be points over them through another second height, or they count as noise."""
FOOT_CELL = 0.01
"""[m] Feet are counted by occupied squares of this side, so that near and far things count alike."""
MIN_FEET, OVER = 10, 0.1
"""A table stands on a floor: of two wide parallel planes at least this far apart [m], the upper one is the table if it
has at least this many squares of feet."""
SQUARES = 2**20
"""More than the squares in a row, to number them."""
BELOW, DEEP, BELOW_SHARE = 0.03, 0.3, 0.1
"""No camera sees through a table: at most this share of the points seen within its outline may be deeper below it than
the first length [m]. If no camera is known, points vertically below its outline count, down to the second length: from
the side a camera sees the floor under a table."""
TOWARDS_FLOOR = 0.1
"""A wall's normal points down in the image of a camera that looks down: its y is above this. A table's points up."""
UNLIKELY = 0.3
"""Weight of the feet on such a plane: cameras may be mounted upside down."""
ASKED = 40_000
"""Number of points used to measure what stands on a plane."""
AREA_RATIO, TILTED_LENGTH = 1.5, 0.25
"""Without a known camera, a plane that is not level must have this many times the area of what stands on it, and be
longer than this [m]: else it may be the side of a box, with the box on its other side."""
LEVEL_DEG = 10.0
"""A plane tilted by less may be a table's."""


def standing(plane: ScenePlane, points: Array, others: BoolArray, camera: Array | None) -> tuple[int, float]:
    """Number of squares under feet on a plane, and the share below it of the points seen within its outline.

    `others` (n,) marks the points (n, 3) that are on other wide planes.
    """
    height = plane.heights(points)
    low = np.maximum(FOOT, plane.lowest(points, height))
    square = np.floor(points @ plane.axes.T / FOOT_CELL).astype(np.int64)
    square = square[:, 0] * SQUARES + square[:, 1]
    foot = ~others & (height > low) & (height < low + FOOT_HEIGHT)
    over = ~others & (height >= low + FOOT_HEIGHT) & (height < low + 2 * FOOT_HEIGHT)
    foot[foot] = plane.over(points[foot])
    feet = int(np.isin(np.unique(square[foot]), square[over]).sum()) + int(foot.any())
    deep = np.inf
    if camera is None:
        deep = DEEP
    else:  # the points where the rays of the camera meet the plane
        above = float(plane.heights(camera))
        points = camera + (points - camera) * (above / np.maximum(above - height, np.finfo(float).tiny))[:, None]
    seen = plane.over(points)
    below = (height < -max(BELOW, ABOVE_DEVIATIONS * plane.deviation)) & (height > -deep)
    share = float(below[seen].mean()) if seen.any() else 1.0
    return feet, share


def find_table(
    points: Array, found: Sequence[ScenePlane], camera: Array | None, own_frame: bool, world: bool
) -> ScenePlane | None:
    """The plane of points (n, 3) that most things stand on; None if none can be a table.

    `own_frame` says that the points may be in the frame of a camera, whose y points down. `world` says that z is
    certainly up: then level planes are preferred.
    """
    points = points[:: -(-len(points) // ASKED)]
    on = [np.abs(plane.heights(points)) < max(PLANE_ERROR, FIT_DEVIATIONS * plane.deviation) for plane in found]
    ranked: list[tuple[tuple[float, ...], ScenePlane]] = []
    for i, plane in enumerate(found):
        if plane.length < MIN_WIDTH:
            continue
        walls = [mask for j, mask in enumerate(on) if j != i and found[j].wide]
        others = np.logical_or.reduce(walls) if walls else np.zeros(len(points), bool)
        for side, eye in _sides(plane, camera, own_frame):
            feet, below = standing(side, points, others, eye)
            if below > BELOW_SHARE or (eye is None and not _widest(side, points)):
                continue
            likely = UNLIKELY if own_frame and eye is not None and side.normal[1] > TOWARDS_FLOOR else 1.0
            ranked.append(((float(world and side.tilt_deg <= LEVEL_DEG), likely * feet, likely * side.count), side))
    return _uppermost(ranked) if ranked else None


def _uppermost(ranked: list[tuple[tuple[float, ...], ScenePlane]]) -> ScenePlane:
    """The plane with the highest rank, or the table that stands on it."""
    table = max(ranked, key=lambda pair: pair[0])[1]
    for rank, plane in ranked:
        parallel = float(plane.normal @ table.normal) > np.cos(np.deg2rad(SAME_DEG))
        upper = float(table.heights(plane.outline.mean(axis=0))) > OVER
        if plane.wide and parallel and upper and rank[1] >= MIN_FEET:
            table = plane
    return table


def _sides(plane: ScenePlane, camera: Array | None, own_frame: bool) -> list[tuple[ScenePlane, Array | None]]:
    """The sides of a plane that may be up, each with the camera that sees it.

    With a known camera it is the side that the camera sees. Else it is both sides, or the upper side of a level plane.
    """
    if camera is not None:
        return [(plane, camera)]
    level: list[tuple[ScenePlane, Array | None]] = [(plane, None)] if plane.tilt_deg <= LEVEL_DEG else []
    if own_frame:
        origin = np.zeros(3)
        return [*level, (plane if plane.heights(origin) > 0 else plane.flipped(), origin)]
    return level or [(plane, None), (plane.flipped(), None)]


def _widest(plane: ScenePlane, points: Array) -> bool:
    """Whether a plane has more area than the points over it, or is level."""
    if plane.tilt_deg <= LEVEL_DEG:
        return True
    above = points[plane.heights(points) > max(FOOT, ABOVE_DEVIATIONS * plane.deviation)]
    return plane.length > TILTED_LENGTH and plane.area > AREA_RATIO * hull_area(above @ plane.axes.T)
