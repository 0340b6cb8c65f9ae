"""The training set with known cameras: free space is carved from the space that may be solid.

It has the measured points; exterior points near the visual hull, whose value is the distance to it; exterior points
farther away; points of the table under the cloud, where the object may stand; and points of the hidden side, as the
object's symmetry lets one guess it. It has no interior points: points behind the measured ones, and pairs along their
normals, moved the guessed side outward and gained nothing.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array
from sgnlp.base.surface_settings import FreeSpace
from sgnlp.perception.free_space import Sight
from sgnlp.perception.observation import Observation
from sgnlp.perception.sampling import farthest_points
from sgnlp.surface.hull import Hull, visual_hull
from sgnlp.surface.samples import Samples
from sgnlp.surface.symmetry import hidden_side

CANDIDATES = 4000
"""Number of random cells of a band for farthest-point sampling: more take longer and are no better."""
UNDER = 0.006
"""A table point is under the cloud within this [m], seen from above."""


def carved_samples(observation: Observation, seen_by: Sequence[Sight], settings: FreeSpace, seed: int) -> Samples:
    """Surface and table points, then the near and the far exterior ones, then those of the hidden side."""
    hull = visual_hull(observation, seen_by, reach=settings.far_to + settings.near_from)
    rng = np.random.default_rng(seed)
    points = observation.points
    surface = points[farthest_points(points, min(settings.surface_points, len(points)), seed)]
    parts = [
        Samples.of(surface, 0.0, settings.surface_noise),
        Samples.of(_table(hull, points, settings.table_points, seed), 0.0, settings.surface_noise),
        _band(hull, (settings.near_from, settings.near_to), settings.near_points, 1.0, settings.noise, rng),
        _band(hull, (settings.far_from, settings.far_to), settings.far_points, settings.far_share, settings.noise, rng),
        Samples.of(_hidden(points, seen_by, settings.symmetry_points, seed), 0.0, settings.symmetry_noise),
    ]
    return Samples.joined(parts)


def _band(
    hull: Hull, between: tuple[float, float], count: int, share: float, noise: float, rng: np.random.Generator
) -> Samples:
    """Free points at distances `between` from the hull; their value is a share of the distance."""
    inside = np.flatnonzero((hull.distance > between[0]) & (hull.distance < between[1]))
    drawn = rng.permutation(inside)[:CANDIDATES]
    if count == 0 or len(drawn) == 0:
        return Samples.of(np.empty((0, 3)), 0.0, noise)
    chosen = drawn[farthest_points(hull.centres[drawn], min(count, len(drawn)), int(rng.integers(2**32)))]
    return Samples.of(hull.centres[chosen], share * hull.distance[chosen], noise)


def _table(hull: Hull, points: Array, count: int, seed: int) -> Array:
    """Points (k, 3) of the table under the cloud (n, 3) and under the hull."""
    base = hull.base
    if count and len(base):
        base = base[cKDTree(points[:, :2]).query(base[:, :2])[0] < UNDER]
    return _spread(base, count, seed)


def _hidden(points: Array, seen_by: Sequence[Sight], count: int, seed: int) -> Array:
    """Points (k, 3) of the hidden side."""
    return _spread(hidden_side(points, seen_by, seed) if count else points[:0], count, seed)


def _spread(points: Array, count: int, seed: int) -> Array:
    """At most `count` of the points, far from each other."""
    return points[farthest_points(points, count, seed)] if count and len(points) else np.empty((0, 3))
