"""Obstacles that a camera saw around the object, as convex shapes: upright boxes around each cluster of points.

A cluster gets the upright box of least area around its points, turned about z, and extended to the table if the cluster
stands on it. The box is split in two, across the axis that leaves the least volume, while the halves together are much
smaller, or while it holds points of the object. So the inner corner of an L-shaped obstacle stays free. A standing box
is split only in the view from above: a camera sees the skin of an obstacle, and the space below it is not free.
"""

from itertools import chain

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from sgnlp.base.arrays import Array
from sgnlp.perception.observation import Observation
from sgnlp.perception.shape import Shape

STANDING = 0.03
"""[m] A cluster that begins no higher above the table stands on it: below its points it is solid or hidden."""
INFLATION = 0.005
"""[m] Boxes are rounded outwards by this, for the noise of a point and the error of a camera's pose."""
THIN = 0.002
"""[m] Least edge of a box."""
GAIN, PARTS = 0.75, 4
"""A box is split if its halves have at most this share of its volume, and at most this many times in a row."""
FEWEST = 4
"""Fewest points of a box that is split; fewer scattered points get a box, too."""


def seen_shapes(observation: Observation) -> tuple[Shape, ...]:
    """The shapes of the obstacles that an observation has around its object."""
    points, number = observation.obstacle_points, observation.obstacle
    if points is None or number is None or not len(points):
        return ()
    found = []
    for i in np.unique(number):
        name = f"obstacle {i}" if i else "what is around"
        found.append(boxes(points[number == i], observation.table_height, observation.points, name))
    return tuple(chain.from_iterable(found))


def boxes(points: Array, table: float, keep_out: Array, name: str) -> list[Shape]:
    """Boxes that cover points (n, 3) [m] on a table at a height [m], holding few of the points `keep_out` (k, 3).

    If the points stand on the table, so does every box: the space below a seen point is solid or unseen.
    """
    low = table if points[:, 2].min() < table + STANDING else None
    return _parted(points, low, keep_out, name, PARTS)


def _parted(points: Array, low: float | None, keep_out: Array, name: str, parts: int) -> list[Shape]:
    whole = _box(points, low, name)
    axes = range(3 if low is None else 2)  # standing clusters are split in the view from above
    parted = [halves for axis in axes if (halves := _halved(points, whole, axis))]
    if parts == 0 or not parted:
        return [whole]
    candidates = [(halves, [_box(part, low, name) for part in halves]) for halves in parted]
    halves, smaller = min(candidates, key=lambda candidate: sum(map(_volume, candidate[1])))
    blocking = len(keep_out) and (whole.distance(keep_out) < 0).any()
    if not blocking and sum(map(_volume, smaller)) > GAIN * _volume(whole):
        return [whole]
    return [box for half in halves for box in _parted(half, low, keep_out, name, parts - 1)]


def _halved(points: Array, box: Shape, axis: int) -> tuple[Array, Array] | None:
    """The points on either side of the middle of a box's axis; None if one side has hardly any."""
    place = box.local(points)[:, axis]
    halves = points[place < 0], points[place >= 0]
    return halves if min(map(len, halves)) >= FEWEST else None


def upright_box(points: Array, table: float, name: str) -> Shape:
    """The box of least area seen from above around points (n, 3) [m], down to the table where they stand on it."""
    return _box(points, table if points[:, 2].min() < table + STANDING else None, name)


def _box(points: Array, low: float | None, name: str) -> Shape:
    """The box of least area seen from above around points (n, 3) [m], down to a height, rounded by `INFLATION`."""
    outline = _outline(points[:, :2])
    R = _turn(min(_edges(outline), key=lambda angle: _area(outline, angle)))
    flat, heights = outline @ R[:2, :2], points[:, 2]
    begin, end = np.append(flat.min(axis=0), heights.min()), np.append(flat.max(axis=0), heights.max())
    if low is not None:
        begin[2] = min(low, end[2] - THIN)
    return Shape.box(R @ ((begin + end) / 2), np.maximum(end - begin, THIN), R, name).inflated(INFLATION)


def _turn(yaw: float) -> Array:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _outline(flat: Array) -> Array:
    """The corners of the convex hull of points (n, 2), in order: a box holds them if it holds all."""
    try:
        return np.asarray(flat[ConvexHull(flat).vertices])
    except (QhullError, ValueError):  # on a line, or fewer than three
        spread = flat - flat.mean(axis=0)
        along = spread @ np.linalg.svd(spread, full_matrices=True)[2][0]
        return flat[[along.argmin(), along.argmax()]]


def _edges(corners: Array) -> Array:
    """The directions [rad] of the edges between corners (n, 2); the box of least area has one of them."""
    steps = np.roll(corners, -1, axis=0) - corners
    return np.asarray(np.arctan2(steps[:, 1], steps[:, 0]))


def _area(outline: Array, yaw: float) -> float:
    return float(np.prod(np.maximum(np.ptp(outline @ _turn(yaw)[:2, :2], axis=0), THIN)))


def _volume(box: Shape) -> float:
    return float(np.prod(2 * box.half))
