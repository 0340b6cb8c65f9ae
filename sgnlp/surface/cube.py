"""The paper's training set: measured points, a cube of exterior points around them, mixtures of them inside.

The paper's appendix (Fitting GPIS) with the numbers of its release: measured points have the value 0; the corners
and face centres of a cube around the object a positive value; softmax-weighted mixtures of measured points a
negative one. A copy of the cloud on the table closes the surface from below, where no camera looks.
"""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.surface_settings import GpisSettings
from sgnlp.perception.observation import Observation
from sgnlp.perception.sampling import farthest_points
from sgnlp.surface.samples import Samples


def cube(observation: Observation, settings: GpisSettings) -> tuple[Array, float]:
    """Centre (3,) [m] and half edge h [m] of the exterior cube."""
    low, high = observation.points.min(axis=0), observation.points.max(axis=0)
    low[2] = min(low[2], observation.table_height)
    half = max(settings.cube_scale * float((high - low).max()) / 2, settings.cube_half_min)
    return (low + high) / 2, half


def cube_samples(observation: Observation, settings: GpisSettings, seed: int) -> Samples:
    """Surface, exterior and interior points, in this order."""
    points = observation.points
    centre, half = cube(observation, settings)
    cloud = points
    if settings.floor:
        floor = points.copy()
        floor[:, 2] = observation.table_height
        cloud = np.concatenate([points, floor])
    surface = cloud[farthest_points(cloud, min(settings.surface_points, len(cloud)), seed)]
    return Samples.joined(
        [
            Samples.of(surface, 0.0, settings.surface_noise),
            Samples.of(centre + half * cube_directions(), half, settings.exterior_noise),
            Samples.of(
                interior_mixtures(surface, settings, seed), settings.interior_value * half, settings.interior_noise
            ),
        ]
    )


def cube_directions() -> Array:
    """The 8 corners and 6 face centres of the cube [-1, 1]³ (14, 3)."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    return np.concatenate([corners, np.eye(3), -np.eye(3)])


def interior_mixtures(surface: Array, settings: GpisSettings, seed: int) -> Array:
    """Convex mixtures (n, 3) of the surface points with weights softmax(u/T), u uniform in [0, 1]."""
    u = np.random.default_rng(seed).random((settings.interior_points, len(surface)))
    weights = np.exp((u - u.max(axis=1, keepdims=True)) / settings.interior_temperature)
    return (weights / weights.sum(axis=1, keepdims=True)) @ surface
