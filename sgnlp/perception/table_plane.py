"""The table of a whole scene: of the planes in it, the one that objects stand on.

The largest plane need not be the table: a wall, or the floor around the table, may be larger. So several planes are
found, and each is asked what stands on it. (`level` looks at the pixels around an object that is known, from a camera
that is known; here neither is.)
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
"""[m] A table's points are at least so wide."""
FOOT, FOOT_HEIGHT = 0.008, 0.01
"""[m] The feet of what stands on a plane are points so high above it, or above its noise, and so much higher. What is
this much higher again must be over them, or they are noise too."""
FOOT_CELL = 0.01
"""[m] Feet are counted by the squares of this side that they stand on: what is near the camera counts no more than what
is far."""
MIN_FEET, OVER = 10, 0.1
"""A table stands on a floor: of wide parallel planes so far apart [m], the upper one with so many squares of feet is
meant."""
SQUARES = 2**20
"""More than there are in a row."""
BELOW, DEEP, BELOW_SHARE = 0.03, 0.3, 0.1
"""Nothing is seen through a table: at most this share of the points seen within its outline is deeper below it than the
first [m]. Where no camera is known, those over its outline count, and no deeper than the second: a floor is seen under
a table from the side."""
TOWARDS_FLOOR = 0.1
"""A wall's normal points down in the image of a camera that looks down: its y is above this. A table's points up."""
UNLIKELY = 0.3
"""The feet of such a plane count so much: cameras may be mounted upside down."""
ASKED = 40_000
"""Points that are asked for what stands on a plane."""
AREA_RATIO, TILTED_LENGTH = 1.5, 0.25
"""A plane that is not level, of a cloud whose camera is not known, has at least so many times the area of what stands
on it, and is longer than this [m]: else it may be the side of a box, with the box on its other side."""
LEVEL_DEG = 10.0
"""A plane tilted by less may be a table's."""


def standing(plane: ScenePlane, points: Array, others: BoolArray, camera: Array | None) -> tuple[int, float]:
    """Squares under the feet of what stands on a plane, and the share below it of what is seen within its outline.

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
    else:  # where the rays of the camera meet the plane
        above = float(plane.heights(camera))
        points = camera + (points - camera) * (above / np.maximum(above - height, np.finfo(float).tiny))[:, None]
    seen = plane.over(points)
    below = (height < -max(BELOW, ABOVE_DEVIATIONS * plane.deviation)) & (height > -deep)
    share = float(below[seen].mean()) if seen.any() else 1.0
    return feet, share


def find_table(
    points: Array, found: Sequence[ScenePlane], camera: Array | None, own_frame: bool, world: bool
) -> ScenePlane | None:
    """The plane of points (n, 3) that most stands on, None if none can be a table.

    `own_frame` says that the points may be those of a camera at the origin, whose y points down, `world` that z is up
    for certain: a table that is not level comes after all that are.
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
    """Of ranked planes the one of the highest rank, or the table that stands on it."""
    table = max(ranked, key=lambda pair: pair[0])[1]
    for rank, plane in ranked:
        parallel = float(plane.normal @ table.normal) > np.cos(np.deg2rad(SAME_DEG))
        upper = float(table.heights(plane.outline.mean(axis=0))) > OVER
        if plane.wide and parallel and upper and rank[1] >= MIN_FEET:
            table = plane
    return table


def _sides(plane: ScenePlane, camera: Array | None, own_frame: bool) -> list[tuple[ScenePlane, Array | None]]:
    """The sides of a plane that may be up, each with the camera that sees it.

    That is the side that a camera sees that is known. Else both, and of a level plane the upper one.
    """
    if camera is not None:
        return [(plane, camera)]
    level: list[tuple[ScenePlane, Array | None]] = [(plane, None)] if plane.tilt_deg <= LEVEL_DEG else []
    if own_frame:
        origin = np.zeros(3)
        return [*level, (plane if plane.heights(origin) > 0 else plane.flipped(), origin)]
    return level or [(plane, None), (plane.flipped(), None)]


def _widest(plane: ScenePlane, points: Array) -> bool:
    """Whether a plane has more area than what is over it, or is level."""
    if plane.tilt_deg <= LEVEL_DEG:
        return True
    above = points[plane.heights(points) > max(FOOT, ABOVE_DEVIATIONS * plane.deviation)]
    return plane.length > TILTED_LENGTH and plane.area > AREA_RATIO * hull_area(above @ plane.axes.T)
