"""Spheres that cover a link: as few as leave no point of its meshes more than 3 mm outside.

Candidates c are inside the link, each with the largest radius r that bulges out by no more than allowed,
r = depth(c) + bulge. Few are chosen so that each point p of the skin has a candidate with |p - c| ≤ r + 3 mm: a set
cover. It is solved for some of the points; uncovered points are added until there are none. Then each radius is reduced
as far as all points allow.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from sgnlp.base.arrays import Array
from sgnlp.hand.draft.pads import Pad
from sgnlp.hand.draft.set_cover import cheapest
from sgnlp.hand.draft.solids import CELL, Solid
from sgnlp.perception.synthetic.meshes import unit_sphere

OUTSIDE = 0.003
"""Largest distance of the skin outside all spheres [m]."""
ROUNDING = 0.0001
"""Part of it that is left for the rounding in the hand's file [m]."""
RESERVE = 0.0003
"""Part of it that is left for points of the skin between the sampled ones [m]."""
POINTS, ADDED, CANDIDATES = 400, 400, 400
"""Numbers of: sampled points of the skin, uncovered points added at a time, and candidate centres."""
BULGE = 0.6
"""Default bulge of the spheres, in half thicknesses of the link: 6 mm on an Allegro's finger."""
THIN = 0.004
"""Least default bulge [m]: without it a thin plate would need a sphere every few millimetres."""
STEP = 0.002
"""Spacing of candidates on the axes of the joint's frame [m]."""
OFF_AXIS = 1.1
"""Cost of a sphere off the axes of the joint's frame, where derivatives are less sparse; on the axes it is 1."""
SHY = 0.001 * np.arange(8, -9, -2)
"""Distance of spheres behind a pad's front [m]: the clearance between links and object at contact in plans, or as much
of it as still covers. Otherwise a sphere beside a broad pad would keep the pad off the object."""
CACHED = 1000
"""Points at a time whose distances from all spheres stay in a processor's cache."""
DIRECTIONS = 200
"""Directions in which the bulge of a sphere is measured."""


@dataclass(frozen=True, eq=False)
class Ball:
    """A sphere in the frame of a joint."""

    centre: Array  # (3,) [m]
    radius: float  # [m]


@dataclass(frozen=True, eq=False)
class Cover:
    """The spheres of a link and how well they fit."""

    balls: tuple[Ball, ...]
    outside: float
    """Largest distance [m] of the skin outside all spheres; negative if they enclose it."""
    excess: float
    """Largest distance [m] of the spheres outside the link."""


def cover(skin: Array, bulge: float | None = None, pad: Pad | None = None, on_axes: bool = True) -> Cover:
    """Spheres that, with its pad, cover the skin (K, 3) [m] of a link, with a bulge of at most `bulge` [m].

    By default the bulge is in proportion to the link's thickness. With `on_axes`, centres on the axes of the frame are
    preferred.
    """
    solid = Solid(skin)
    bulge = max(THIN, BULGE * solid.thickness / 2) if bulge is None else bulge
    given = [Ball(pad.centre, pad.radius)] if pad else []
    open_skin = skin[_gaps(skin, given) > OUTSIDE - ROUNDING]
    points = _spread(skin, POINTS)
    points = points[_gaps(points, given) > OUTSIDE - ROUNDING]
    centres, radii, costs = _candidates(solid, bulge, on_axes)
    radii = _behind(pad, points, centres, radii) if pad else radii
    balls, bare = list[Ball](), points
    while len(bare):
        balls = _chosen(points, centres, radii, costs)
        bare = open_skin[_gaps(open_skin, balls) > OUTSIDE - ROUNDING]
        points = np.vstack([points, _spread(bare, ADDED)]) if len(bare) else points
    balls = _shrunk(open_skin, balls)
    return Cover(tuple(balls), float(_gaps(skin, [*balls, *given]).max()), _excess(solid, balls))


def _candidates(solid: Solid, bulge: float, on_axes: bool) -> tuple[Array, Array, Array]:
    """Centres (C, 3), radii (C,) [m] and costs (C,)."""
    reach = float(solid.cell * max(solid.filled.shape) + np.abs(solid.low).max())
    along = np.arange(-reach, reach, STEP)
    lines = np.vstack([along[:, None] * axis for axis in np.eye(3)]) if on_axes else np.zeros((0, 3))
    lines = lines[solid.depth(lines) > 0] if len(lines) else lines
    middles = solid.middles(CANDIDATES)
    centres = np.vstack([lines, middles])
    costs = np.r_[np.ones(len(lines)), np.full(len(middles), OFF_AXIS if on_axes else 1.0)]
    return centres, solid.depth(centres) + bulge, costs


def _behind(pad: Pad, points: Array, centres: Array, radii: Array) -> Array:
    """The radii (C,) [m] with which spheres stay behind the pad's front, as far as they still cover all points."""
    end = pad.normal @ pad.centre + pad.radius
    for shy in SHY:
        less = np.minimum(radii, end - shy - centres @ pad.normal)
        if (cdist(points, centres) <= less + OUTSIDE - RESERVE).any(axis=1).all():
            return less
    return radii


def _chosen(points: Array, centres: Array, radii: Array, costs: Array) -> list[Ball]:
    """The cheapest candidates that cover all points, and a sphere for each part that none covers."""
    distances = cdist(points, centres)
    covered = distances <= radii + OUTSIDE - RESERVE
    bare = ~covered.any(axis=1)
    chosen = cheapest(covered[~bare], costs) if not bare.all() else np.zeros(0, int)
    return [Ball(centres[j], float(radii[j])) for j in chosen] + _lone(points[bare])


def _shrunk(points: Array, balls: Sequence[Ball]) -> list[Ball]:
    """The spheres, reduced to the points that no other one covers, beginning with the one with the most points."""
    distances = cdist(np.array([ball.centre for ball in balls]).reshape(-1, 3), points)  # (B, K)
    inside = distances <= np.array([ball.radius for ball in balls])[:, None] + OUTSIDE - ROUNDING
    count = inside.sum(axis=0)  # spheres around each point
    found = []
    for j in np.argsort(-inside.sum(axis=1), kind="stable"):
        own = inside[j] & (count == 1)
        count -= inside[j]
        if own.any():
            radius = min(balls[j].radius, max(float(distances[j, own].max()) - OUTSIDE + RESERVE, OUTSIDE))
            count += distances[j] <= radius + OUTSIDE - ROUNDING
            found.append(Ball(balls[j].centre, radius))
    return found


def _lone(points: Array) -> list[Ball]:
    """A sphere for each part of the skin that no candidate reaches, such as a thin wire."""
    balls = []
    while len(points):
        balls.append(Ball(points[0], OUTSIDE))
        points = points[np.linalg.norm(points - points[0], axis=1) > 2 * OUTSIDE - RESERVE]
    return balls


def _spread(points: Array, count: int) -> Array:
    """About `count` of the points, one in each cell of a grid that is as fine as that needs."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    for cell in max(size, CELL) / np.geomspace(4, 200, 20):
        index = np.floor((points - points.min(axis=0)) / cell).astype(int)
        _, first = np.unique(np.ravel_multi_index(tuple(index.T), tuple(index.max(axis=0) + 1)), return_index=True)
        if len(first) >= count:
            break
    return points[np.sort(first)]


def _gaps(points: Array, balls: Sequence[Ball]) -> Array:
    """Distance (K,) [m] of points outside all spheres."""
    if not balls:
        return np.full(len(points), np.inf)
    centres, radii = np.array([ball.centre for ball in balls]), np.array([ball.radius for ball in balls])
    parts = (points[i : i + CACHED] for i in range(0, len(points), CACHED))
    return np.concatenate([(cdist(part, centres) - radii).min(axis=1) for part in parts] or [np.zeros(0)])


def _excess(solid: Solid, balls: Sequence[Ball]) -> float:
    """Largest distance [m] of the spheres outside the solid."""
    around = unit_sphere(DIRECTIONS).vertices
    return max((-float(solid.depth(ball.centre + ball.radius * around).min()) for ball in balls), default=0.0)
