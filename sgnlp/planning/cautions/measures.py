"""Measures of a cloud: bodies, planes, the sides it was seen from. Each uses a few hundred of its points."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError, cKDTree

from sgnlp.base.arrays import Array
from sgnlp.perception.sampling import grid_sample

SAMPLE = 1000
"""Number of points that are examined, spread evenly by a grid; that takes a few milliseconds."""
PLANE_NEIGHBOURS = 25
"""Number of neighbours that give the plane through a point."""
PLANE_CANDIDATES = 100
"""Number of points whose planes are tried."""
GRID = 12
"""Cells on each side of the grid over a cloud's outline."""
LEVEL = 1e-9
"""Faces of a hull whose normal's z is less than this are upright."""
THICK = 0.5
"""A body's middle is where its hull is thicker than this share of its height; its rim is visible from both sides."""
NEAR_HULL = 0.125
"""A point counts as on the hull within this share of the body's height, or within a cell."""


def sample(points: Array) -> Array:
    """At most `SAMPLE` of the points (N, 3), evenly spread."""
    return points[grid_sample(points, SAMPLE)]


def body_shares(points: Array, gap: float) -> Array:
    """Shares of the points (n, 3) in each group that a `gap` [m] separates from the others, the largest first."""
    pairs = cKDTree(points).query_pairs(gap, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    _, label = connected_components(graph, directed=False)
    return np.sort(np.bincount(label))[::-1] / len(points)


@dataclass(frozen=True)
class Plane:
    """The plane that holds most of a cloud's points, and how the rest stand on it.

    `share` is that of the points on it. `inside` is the share of the other points whose feet are within its outline, by
    a margin, and `ratio` is the area of its outline over that of these feet.
    """

    share: float
    inside: float
    ratio: float
    normal: Array  # (3,)
    height: float  # [m], z of the middle of its points


def largest_plane(points: Array, thickness: float, margin: float) -> Plane:
    """The plane of most points (n, 3) within `thickness` [m]; `margin` [m] is that of `Plane.inside`."""
    near = np.asarray(cKDTree(points).query(points, k=min(PLANE_NEIGHBOURS, len(points)))[1])
    chosen = np.unique(np.linspace(0, len(points) - 1, PLANE_CANDIDATES).astype(int))
    Q = points[near[chosen]]
    middle = Q.mean(axis=1)
    Q = Q - middle[:, None]
    normals = np.linalg.eigh(np.einsum("nki,nkj->nij", Q, Q))[1][:, :, 0]
    normals = np.vstack([normals, np.tile([0.0, 0.0, 1.0], (len(chosen), 1))])
    offsets = (normals * np.vstack([middle, points[chosen]])).sum(axis=1)
    counts = (np.abs(points @ normals.T - offsets) < thickness).sum(axis=0)
    best = int(counts.argmax())
    on = np.abs(points @ normals[best] - offsets[best]) < thickness
    _, axes = np.linalg.eigh(np.cov(points[on].T))
    on = np.abs((points - points[on].mean(axis=0)) @ axes[:, 0]) < thickness
    flat = (points - points[on].mean(axis=0)) @ axes[:, 1:]
    below = flat[on] - 2 * margin * axes[2, 1:]  # a wall continues below the table
    inside, ratio = _standing(flat[on], below, flat[~on], margin)
    return Plane(float(on.mean()), inside, ratio, axes[:, 0], float(points[on, 2].mean()))


def _standing(plane: Array, below: Array, rest: Array, margin: float) -> tuple[float, float]:
    """Share of the feet (k, 2) of the rest inside the outline of a plane's points (l, 2), and the ratio of areas.

    The outline for `inside` includes the points' copies `below` (l, 2).
    """
    if len(rest) < 4:
        return 0.0, 1.0
    try:
        area, feet = ConvexHull(plane).volume, ConvexHull(rest).volume
        outline = ConvexHull(np.vstack([plane, below])).equations
    except QhullError:  # all on one line
        return 0.0, 1.0
    depth = -(rest @ outline[:, :2].T + outline[:, 2]).max(axis=1)
    return float((depth > margin).mean()), float(area / max(feet, np.finfo(float).tiny))


def bulge(points: Array) -> float:
    """Correlation of the distances of points (n, 3) from the origin with the angle from their mean direction.

    Near 1 the cloud bulges towards the origin, as towards the camera that saw it.
    """
    distance = np.linalg.norm(points, axis=1)
    middle = points.mean(axis=0)
    angle = np.arccos(np.clip(points @ middle / np.linalg.norm(middle) / distance, -1, 1))
    return float(np.corrcoef(distance, angle)[0, 1])


def seen_sides(points: Array) -> tuple[float, float]:
    """Shares of a body's middle, seen along z, in which points (n, 3) lie on its upper and on its lower hull."""
    try:
        hull = ConvexHull(points).equations
    except QhullError:  # flat
        return 1.0, 0.0
    low, high = points.min(axis=0), points.max(axis=0)
    inner = (np.arange(GRID) + 0.5) / GRID
    xy = low[:2] + (high - low)[:2] * np.stack(np.meshgrid(inner, inner, indexing="ij"), -1).reshape(-1, 2)
    up, down = hull[hull[:, 2] > LEVEL], hull[hull[:, 2] < -LEVEL]
    top, bottom = (-(xy @ faces[:, :2].T + faces[:, 3]) / faces[:, 2] for faces in (up, down))
    upper, lower = top.min(axis=1), bottom.max(axis=1)
    middle = upper - lower > THICK * (high - low)[2]
    if not middle.any():
        return 1.0, 0.0
    reach = max(float((high - low)[:2].max()) / GRID, NEAR_HULL * float((high - low)[2]))
    tree, shares = cKDTree(points), []
    for z in (upper, lower):
        distance = np.asarray(tree.query(np.column_stack([xy[middle], z[middle]]))[0])
        shares.append(float((distance < reach).mean()))
    return shares[0], shares[1]


def outside(points: Array, queries: Array) -> Array:
    """Distance (Q,) [m] of queries (Q, d) from the convex hull of points (N, d), negative inside.

    It is the largest distance to the planes of the hull's faces, less than the true one beyond edges and corners.
    """
    hull = ConvexHull(points).equations
    return np.asarray((queries @ hull[:, :-1].T + hull[:, -1]).max(axis=1))
