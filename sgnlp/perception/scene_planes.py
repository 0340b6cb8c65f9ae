"""The wide planes of a whole scene: tables, walls, floors, and the sides of large boxes.

Each is found by sample consensus among the points that are on no earlier plane.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import label
from scipy.spatial import ConvexHull, QhullError, cKDTree

from sgnlp.base.arrays import Array, BoolArray

SAMPLE, SEED = 5000, 0
"""Number of points among which planes are searched; a fit to all points of the plane follows."""
CANDIDATES, NEIGHBOURS = 300, 25
"""Number of points whose planes are tried, and of the neighbours that give such a plane. A plane with a fiftieth of the
points is tried six times."""
PLANES, PLANE_SHARE = 8, 0.02
"""Largest number of planes, and the smallest share of the points on one."""
PLANE_ERROR, PLANE_ERROR_SHARE = 0.006, 0.01
"""In the search, points are on a plane within this [m], or within this share of the distance from the camera."""
FIT_DEVIATIONS, FITS = 3.0, 4
"""The plane is refitted this many times to the points within this many deviations of it."""
DEVIATION = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""
CELL = 0.02
"""[m] Side of the cells by which a plane's points are connected."""
WIDE, WIDE_AREA = 0.5, 0.08
"""A connected plane longer [m] and larger [m²] than this is a wall, a floor or a table, not the side of an object."""
ABOVE = (0.004, 0.025)
"""[m] Lower and upper bound of the height, `ABOVE_DEVIATIONS` deviations, from which a point is above a plane."""
MAX_NOISE = 0.05
"""[m] Points deeper below a plane are not noise of the plane."""
PATCH, PATCH_POINTS = 0.1, 20
"""[m] Side of a plane's squares, and fewest points of a square with a deviation of its own: noise grows with the
distance squared."""
ABOVE_DEVIATIONS = 4.0
"""A point is off a plane if it is farther than this many deviations of the plane's points."""
SAME, SAME_DEG = 0.015, 5.0
"""Two planes are the same if their middles are no farther apart than this [m], beyond their noise, and if they are
parallel within this angle [deg]."""


@dataclass(frozen=True, eq=False)
class ScenePlane:
    """A plane n·x = d that objects may stand on, with its measures; up is the visible side."""

    normal: Array  # (3,) n, up
    offset: float  # [m] d
    deviation: float  # [m] of its points from it
    count: int  # number of its points
    outline: Array  # (k, 3) [m] the corners of their convex hull
    length: float = 0.0  # [m] of their largest connected piece
    filled: float = 0.0  # [m²] by that piece

    def heights(self, points: Array) -> Array:
        """Heights (...) [m] of points (..., 3) above the plane."""
        return np.asarray(points @ self.normal - self.offset)

    def over(self, points: Array, margin: float = 0.0) -> BoolArray:
        """Whether points (n, 3) are over its outline, or within a margin [m] beside it."""
        if len(self.outline) < 3:
            return np.ones(len(points), bool)
        axes = self.axes
        hull = ConvexHull(self.outline @ axes.T).equations
        flat = points @ axes.T
        over = np.ones(len(points), bool)
        for a, b, c in hull:
            over &= flat[:, 0] * a + flat[:, 1] * b + c <= margin
        return over

    def lowest(self, points: Array, height: Array) -> Array:
        """The least height (n,) [m] at which points (n, 3) with a `height` (n,) count as above the plane.

        It follows from the deviation of the points below the plane nearby: nothing stands there, so they are noise.
        """
        if len(points) == 0:
            return np.zeros(0)
        flat = np.floor(points @ self.axes.T / PATCH).astype(np.int64)
        flat -= flat.min(axis=0)
        patch = flat[:, 0] * (int(flat[:, 1].max()) + 1) + flat[:, 1]
        below = np.flatnonzero((height < 0) & (height > -MAX_NOISE))
        order = below[np.lexsort((height[below], patch[below]))]
        count = np.bincount(patch[order], minlength=int(patch.max()) + 1)
        begin = np.cumsum(count) - count
        deviation = np.full(len(count), self.deviation)
        enough = count >= PATCH_POINTS
        deviation[enough] = -DEVIATION * height[order[(begin + count // 2)[enough]]]
        return np.asarray(np.clip(ABOVE_DEVIATIONS * deviation, *ABOVE)[patch])

    @property
    def axes(self) -> Array:
        """Two directions (2, 3) in the plane."""
        return np.asarray(np.linalg.svd(self.normal[None])[2][1:])

    @property
    def area(self) -> float:
        """[m²] Area of its outline."""
        return hull_area(self.outline @ self.axes.T)

    @property
    def wide(self) -> bool:
        """Whether it is a wall, a floor or a table."""
        return self.length > WIDE and self.filled > WIDE_AREA

    @property
    def tilt_deg(self) -> float:
        """Angle between its normal and z [deg]."""
        return float(np.rad2deg(np.arccos(np.clip(self.normal[2], -1.0, 1.0))))

    def flipped(self) -> "ScenePlane":
        """The same with the other side up."""
        return replace(self, normal=-self.normal, offset=-self.offset)

    def moved(self, pose: Array) -> "ScenePlane":
        """The same in the frame that a pose (4, 4) takes to."""
        outline = self.outline @ pose[:3, :3].T + pose[:3, 3]
        normal = pose[:3, :3] @ self.normal
        return replace(self, normal=normal, offset=float(self.offset + normal @ pose[:3, 3]), outline=outline)


def level_at(height: float) -> ScenePlane:
    """The table at a given height [m]: infinite, and without noise."""
    return ScenePlane(np.array([0.0, 0.0, 1.0]), height, 0.0, 0, np.zeros((0, 3)))


def hull_area(flat: Array) -> float:
    """Area of the convex hull of points (n, 2); 0 if they lie on a line."""
    try:
        return float(ConvexHull(flat).volume)
    except (QhullError, ValueError):
        return 0.0


def planes(points: Array, camera: Array | None) -> list[ScenePlane]:
    """Planes of points (n, 3), that of most points first, each among those that no earlier one has.

    Sample consensus: of the planes through the neighbours of some points, the one that most points are on, then least
    squares. Their normals point to the camera (3,) where it is known, else upwards.
    """
    rng = np.random.default_rng(SEED)
    sample = points[np.sort(rng.permutation(len(points))[:SAMPLE])]
    near = np.asarray(cKDTree(sample).query(sample, k=min(NEIGHBOURS, len(sample)))[1])
    chosen = near[rng.permutation(len(sample))[:CANDIDATES]]
    Q = sample[chosen]
    Q = Q - Q.mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.einsum("nki,nkj->nij", Q, Q))[1][:, :, 0]
    offsets = np.einsum("ni,ni->n", normals, sample[chosen].mean(axis=1))
    allowed = _allowed(sample, camera)
    on = np.abs(sample @ normals.T - offsets) < allowed[:, None]  # (sample, candidates)
    free, left = np.ones(len(sample), bool), np.ones(len(points), bool)
    allowed = _allowed(points, camera)
    found: list[ScenePlane] = []
    for _ in range(PLANES):
        counts = on[free].sum(axis=0)
        best = int(counts.argmax())
        if counts[best] < PLANE_SHARE * len(sample):
            break
        free &= ~on[:, best]
        plane = _fitted(points, left, normals[best], float(offsets[best]), allowed, camera)
        if plane is None:
            continue
        near_it = np.abs(plane.heights(points)) < np.maximum(allowed, FIT_DEVIATIONS * plane.deviation)
        length, filled = _piece(plane, points[left & near_it])
        if not any(same(plane, other) for other in found):
            found.append(replace(plane, length=length, filled=filled))
        left &= ~near_it
        free &= np.abs(plane.heights(sample)) >= PLANE_ERROR
    return found


def same(a: ScenePlane, b: ScenePlane) -> bool:
    """Whether two planes are one: nearly parallel, and the middle of one on the other."""
    parallel = abs(float(a.normal @ b.normal)) > np.cos(np.deg2rad(SAME_DEG))
    apart = abs(float(b.heights(a.outline.mean(axis=0)))) if len(a.outline) else 0.0
    return bool(parallel and apart < SAME + FIT_DEVIATIONS * b.deviation)


def _allowed(points: Array, camera: Array | None) -> Array:
    """Largest distance (n,) [m] of each point from a plane that it is on."""
    if camera is None:
        return np.full(len(points), PLANE_ERROR)
    return np.maximum(PLANE_ERROR, PLANE_ERROR_SHARE * np.linalg.norm(points - camera, axis=1))


def _fitted(
    points: Array, left: BoolArray, normal: Array, offset: float, allowed: Array, camera: Array | None
) -> ScenePlane | None:
    """The least-squares plane of the remaining points near a first plane; None if they are too few."""
    for _ in range(FITS):
        kept = points[left & (np.abs(points @ normal - offset) < allowed)]
        if len(kept) < max(PLANE_SHARE * len(points), NEIGHBOURS):
            return None
        middle = kept.mean(axis=0)
        normal = np.linalg.eigh(np.cov((kept - middle).T))[1][:, 0]
        offset = float(normal @ middle)
        away = np.abs(kept @ normal - offset)
        deviation = DEVIATION * float(np.median(away))
        allowed = np.minimum(allowed, np.maximum(FIT_DEVIATIONS * deviation, PLANE_ERROR / 2))
    up = normal[2] if camera is None else normal @ (camera - middle)
    normal, offset = (normal, offset) if up >= 0 else (-normal, -offset)
    flat = (kept - middle) @ np.linalg.svd(normal[None])[2][1:].T
    try:
        outline = kept[ConvexHull(flat).vertices]
    except QhullError:
        return None
    return ScenePlane(normal, offset, deviation, len(kept), outline)


def _piece(plane: ScenePlane, points: Array) -> tuple[float, float]:
    """Length [m] and area [m²] of the largest connected piece of a plane's points (n, 3)."""
    if len(points) == 0:
        return 0.0, 0.0
    flat = points @ plane.axes.T
    cells = np.floor((flat - flat.min(axis=0)) / CELL).astype(np.int64)
    filled = np.zeros(cells.max(axis=0) + 1, bool)
    filled[cells[:, 0], cells[:, 1]] = True
    numbers = label(filled, np.ones((3, 3)))[0]
    largest = int(np.bincount(numbers[filled]).argmax())
    places = np.argwhere(numbers == largest)
    return CELL * float(np.ptp(places, axis=0).max() + 1), CELL**2 * len(places)
