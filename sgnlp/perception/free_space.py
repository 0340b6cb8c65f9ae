"""Free space: where a camera saw that there is nothing.

A camera at o with axes R sees a point x along its ray as q = R (x - o). Its image is divided into cells of q_x/q_z and
q_y/q_z, and each cell has the depth q_z up to which its rays met nothing:

* where the object was measured, the nearest measured depth;
* where something behind it was measured, that depth; a cell without a return proves nothing;
* beside the object, if only its own points are known, infinity. The silhouette of its points is closed first, so that
  neither their spacing nor missing returns open holes.

A point is free if at least one camera shows that it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray, IntArray

CELL = 0.002
"""Width of a cell at the object's distance [m]: a depth camera's pixel covers 0.5 to 1.5 mm there."""
MAX_CELLS = 400
"""Most cells on the longer side of an image: for wider objects the cells are larger."""
CLOSED = 0.010
"""Holes of the silhouette narrower than twice this are closed [m]: blocks of pixels without return are 6 mm wide."""
SPACINGS = 3.0
"""Holes are closed up to twice this many spacings of the points, if that is more."""
SPACING_QUANTILE = 0.9
"""Quantile of the distances between neighbouring points that counts as their spacing."""
GROWN = 0.004
"""The silhouette is wider than the points on each side [m]: grazing surfaces return nothing, calibrations err."""
FRONT = 0.006
"""A point is free if it is this far in front of what was measured [m]: noise and calibration, three deviations."""
AROUND = 0.15
"""The background is used within this distance of the object in the image [m]: free space is needed within 5 cm of the
object, which is up to three times as wide in the image where it is nearer to the camera."""
FAR_OFF = 1e6
"""Cell numbers are clipped to this: no image reaches so far."""
FEW = 10
"""Fewest points of a view that give a silhouette."""
HIDDEN, HIDDEN_SHARE = 0.02, 0.05
"""A point hides another one in its cell if that is this far behind it [m]. On the problem set under 1 % of a camera's
points are hidden from it; from the opposite side it would be 18 % in the median."""
CONTRADICTED_SHARE = 0.6
"""Cameras contradict each other if one would have seen through this share of the others' points. Up to 50 % occur at a
tall box, whose side gives no return at a grazing angle. Hidden points alone reveal nine of ten wrong poses."""


@dataclass(frozen=True, eq=False)
class Image:
    """The cells of a camera's image, centred on the object."""

    position: Array  # (3,) [m] position of the camera
    axes: Array  # (3, 3), rows: right, down and ahead in the world
    cells: float  # cells per unit of q_x/q_z
    corner: IntArray  # (2,) numbers of the first cell
    shape: tuple[int, ...]  # (w, h)
    spacing: float  # cells between the object's points
    grown: float  # cells that its silhouette grows by

    @classmethod
    def around(cls, position: Array, points: Array, beyond: float = 0.0) -> "Image":
        """An image that contains points (n, 3), their closed and grown silhouette, and `beyond` [m] around it."""
        axes, distance = _looking(position, points.mean(axis=0))
        width = max(CELL, float(np.linalg.norm(np.ptp(points, axis=0))) / MAX_CELLS)
        cell = _numbers(points, position, axes, distance / width)[0]
        spacing = max(_spacing(cell), CLOSED / SPACINGS / width)
        grown = GROWN / width
        edge = int(np.ceil(max(SPACINGS * spacing + grown, beyond / width))) + 2
        shape = tuple(map(int, np.ptp(cell, axis=0) + 1 + 2 * edge))
        return cls(position, axes, distance / width, cell.min(axis=0) - edge, shape, spacing, grown)

    def place(self, X: Array) -> tuple[IntArray, Array, BoolArray]:
        """The cells (n, 2) of points (n, 3), their depths (n,) [m], and whether they are in the image."""
        cell, ahead = _numbers(X, self.position, self.axes, self.cells)
        cell -= self.corner
        return cell, ahead, ((cell >= 0) & (cell < self.shape)).all(axis=1) & (ahead > 0)

    def nearest(self, points: Array) -> Array:
        """The least depth (w, h) [m] in each cell, infinite where there is no point (n, 3)."""
        cell, ahead, inside = self.place(points)
        depth = np.full(self.shape, np.inf)
        np.minimum.at(depth, (cell[inside, 0], cell[inside, 1]), ahead[inside])
        return depth


@dataclass(frozen=True, eq=False)
class Sight:
    """What one camera saw of the space around an object."""

    image: Image
    depth: Array  # (w, h) [m] depth up to which rays met nothing: 0 if unknown, infinite if they met nothing at all
    beside: float  # [m] the same outside the image
    hidden: float  # share of its points that lie far behind another in the same cell
    through: float  # share of the other cameras' points that it would have seen through by its own points

    def free(self, X: Array, front: float = FRONT) -> BoolArray:
        """Whether the camera shows points (n, 3) [m] to be free, at least `front` [m] in front of its measurements."""
        cell, ahead, inside = self.image.place(X)
        up_to = np.full(len(X), self.beside)
        up_to[inside] = self.depth[cell[inside, 0], cell[inside, 1]]
        return np.asarray((ahead > 0) & (ahead < up_to - front))


def free(sights: Sequence[Sight], X: Array, front: float = FRONT) -> BoolArray:
    """Whether at least one camera shows points (n, 3) [m] to be free."""
    return np.any([sight.free(X, front) for sight in sights], axis=0) if sights else np.zeros(len(X), bool)


def sight(position: Array, points: Array, others: Array | None = None, background: Array | None = None) -> Sight:
    """What a camera at a position (3,) saw of an object's points (n, 3), and of `background` (m, 3) around it [m].

    Without `background` the camera is assumed to have measured the object wherever it is, except at the points `others`
    (k, 3) of other cameras, where a surface at a grazing angle may have given no return.
    """
    image = Image.around(position, points, 0.0 if background is None else AROUND)
    own = image.nearest(points)
    near = _filled(own)
    hidden = _hidden_share(image, own, points)
    silhouette = _closed(np.isfinite(own), SPACINGS * image.spacing)
    depth = np.where(_grown(silhouette, image.grown), near, np.inf)
    through = _through_share(image, depth, others)
    if background is not None:
        behind = _joined(image.nearest(background))
        proved = np.where(np.isfinite(behind), behind, 0.0)
        depth = np.where(_grown(np.isfinite(own), image.grown), np.minimum(near, behind), proved)
    elif others is not None:
        unseen = np.where(silhouette, np.inf, image.nearest(others))
        if np.isfinite(unseen).any():
            beyond = _grown(_closed(np.isfinite(unseen), SPACINGS * image.spacing), image.grown) & ~silhouette
            depth = np.where(beyond, np.minimum(depth, _filled(unseen)), depth)
    beside = np.inf if background is None else 0.0
    return Sight(image, _lowered(depth, image.spacing), beside, hidden, through)


def background(position: Array, points: Array, others: Array) -> Array:
    """The part of a camera's other points (m, 3) that shows which space around an object's points (n, 3) is free.

    It is the nearest point in each cell of the image, (k, 3) [m].
    """
    image = Image.around(position, points, AROUND)
    cell, ahead, inside = image.place(others)
    cell, ahead, seen = cell[inside], ahead[inside], others[inside]
    order = np.argsort(ahead, kind="stable")
    _, first = np.unique(cell[order] @ [image.shape[1], 1], return_index=True)
    return np.asarray(seen[order[first]])


def sights(
    points: Array,
    view: IntArray,
    positions: Array,
    background: Array | None = None,
    background_view: IntArray | None = None,
) -> tuple[Sight, ...]:
    """The sights of cameras at positions (V, 3), of points (n, 3) and their cameras' numbers (n,).

    A camera that measured fewer than `FEW` points has none.
    """
    found = []
    for number, position in enumerate(positions):
        own = points[view == number]
        if len(own) >= FEW:
            around = None if background is None else background[background_view == number]
            found.append(sight(position, own, points[view != number], around))
    return tuple(found)


def doubt(sights: Sequence[Sight]) -> str:
    """Why cameras cannot have stood at their given positions; "" if they can."""
    for number, seen in enumerate(sights):
        if seen.hidden > HIDDEN_SHARE:
            return f"from where camera {number} is said to be, {seen.hidden:.0%} of its points hide behind others"
        if seen.through > CONTRADICTED_SHARE:
            return f"from where camera {number} is said to be, it saw through {seen.through:.0%} of the others' points"
    return ""


def in_front(points: Array, view: IntArray, positions: Array, by: float) -> float:
    """The largest share of one camera's points that lie before the surface that another one measured, by `by` [m].

    Points (n, 3) are of the cameras (n,) at positions (V, 3). Only the cells where the other measured the object count.
    """
    clouds = [points[view == number] for number in range(len(positions))]
    largest = 0.0
    for position, own in zip(positions, clouds, strict=True):
        seen = sight(position, own) if len(own) >= FEW else None
        for others in clouds:
            if seen is not None and others is not own and len(others) >= FEW:
                cell, ahead, inside = seen.image.place(others)
                depth = seen.depth[cell[inside, 0], cell[inside, 1]]
                before = (ahead[inside] < depth - by) & np.isfinite(depth)
                largest = max(largest, float(before.sum() / len(others)))
    return largest


def _hidden_share(image: Image, nearest: Array, points: Array) -> float:
    """Share of a camera's points (n, 3) that lie behind another in the same cell."""
    cell, ahead, _ = image.place(points)
    return float((ahead > nearest[cell[:, 0], cell[:, 1]] + HIDDEN).mean())


def _through_share(image: Image, depth: Array, others: Array | None) -> float:
    """Share of other cameras' points (k, 3) in front of depths (w, h) or beside the image."""
    if others is None or len(others) < FEW:
        return 0.0
    cell, ahead, inside = image.place(others)
    free = ahead > 0
    free[inside] = ahead[inside] < depth[cell[inside, 0], cell[inside, 1]] - FRONT
    return float(free.mean())


def _looking(position: Array, middle: Array) -> tuple[Array, float]:
    """Axes (3, 3) of an image centred on the object, and the distance to it [m]."""
    ahead = middle - position
    distance = max(float(np.linalg.norm(ahead)), CELL)
    ahead = ahead / distance
    right = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(ahead, right), ahead]), distance


def _numbers(X: Array, position: Array, axes: Array, cells: float) -> tuple[IntArray, Array]:
    """The cells (n, 2) of points (n, 3), and their depths (n,) [m]; undefined behind the camera."""
    q = (X - position) @ axes.T
    ahead = np.where(q[:, 2] != 0, q[:, 2], -CELL)
    return np.floor(np.clip(q[:, :2] / ahead[:, None] * cells, -FAR_OFF, FAR_OFF)).astype(np.int64), ahead


def _spacing(cell: IntArray) -> float:
    """Distance in cells between neighbouring points that are in different cells."""
    low = cell - cell.min(axis=0)
    distinct = low[np.unique(low @ [int(low.max()) + 1, 1], return_index=True)[1]]
    if len(distinct) < 2:
        return 0.0
    return float(np.quantile(np.asarray(cKDTree(distinct).query(distinct, k=2)[0])[:, 1], SPACING_QUANTILE))


def _filled(depth: Array) -> Array:
    """An image whose infinite cells have the depth of the nearest finite one."""
    nearest = np.asarray(ndimage.distance_transform_edt(np.isinf(depth), return_indices=True)[1])
    return np.asarray(depth[nearest[0], nearest[1]])


def _joined(depth: Array) -> Array:
    """An image whose infinite cells next to finite ones get the nearest depth, because sparse points leave gaps."""
    near = _grown(np.isfinite(depth), np.sqrt(2))
    return np.where(near, _filled(depth), np.inf)


def _lowered(depth: Array, spacing: float) -> Array:
    """The least depth within half a spacing of each cell and in its neighbours: surfaces slope between points."""
    return np.asarray(ndimage.minimum_filter(depth, 2 * max(1, round(spacing / 2)) + 1))


def _grown(mask: BoolArray, by: float) -> BoolArray:
    """A mask and all cells within `by` cells of it."""
    return np.asarray(ndimage.distance_transform_edt(~mask) <= by)


def _closed(mask: BoolArray, by: float) -> BoolArray:
    """A mask without its holes and bays narrower than 2 `by` cells: grown, then shrunk by as much."""
    return np.asarray(np.asarray(ndimage.distance_transform_edt(_grown(mask, by))) > by) | mask
