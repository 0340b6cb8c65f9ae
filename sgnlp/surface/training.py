"""The training set of the implicit surface: surface, exterior and interior points with their noise.

The paper's appendix (Fitting GPIS) with the numbers of its release: measured points have the value 0; the corners
and face centres of a cube around the object a positive value; softmax-weighted mixtures of measured points a
negative one. A copy of the cloud on the table closes the surface below, where no camera looks.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist

from sgnlp.base.arrays import Array
from sgnlp.base.settings import GpisSettings
from sgnlp.perception.observation import Observation
from sgnlp.perception.sampling import farthest_points
from sgnlp.surface.kernel import Kernel
from sgnlp.surface.kernels import named


@dataclass(frozen=True)
class TrainingSet:
    """Points X (N, 3) [m], values y (N,) [m], noise deviations (N,) [m]; surface points come first.

    The prior is a process of mean `prior` [m] and covariance `kernel`; `centre` (3,) [m] is that of the exterior cube.
    """

    X: Array
    y: Array
    noise: Array
    prior: float
    kernel: Kernel
    centre: Array


def training_set(
    observation: Observation, settings: GpisSettings, seed: int, kernel: type[Kernel] | None = None
) -> TrainingSet:
    """The training set of an observation; the same seed gives the same set.

    Raises:
        InputError: no `kernel` is given, and the settings name one that is not known.
    """
    kind = kernel or named(settings.kernel)
    points = observation.points
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = min(low[2], observation.table_height)
    centre = (low + high) / 2
    half = max(settings.cube_scale * float((high - low).max()) / 2, settings.cube_half_min)
    cloud = points
    if settings.floor:
        floor = points.copy()
        floor[:, 2] = observation.table_height
        cloud = np.concatenate([points, floor])
    surface = cloud[farthest_points(cloud, min(settings.surface_points, len(cloud)), seed)]
    exterior = centre + half * cube_directions()
    interior = interior_mixtures(surface, settings, seed)
    counts = (len(surface), len(exterior), len(interior))
    X = np.concatenate([surface, exterior, interior])
    return TrainingSet(
        X=X,
        y=np.repeat([0.0, half, settings.interior_value * half], counts),
        noise=np.repeat([settings.surface_noise, settings.exterior_noise, settings.interior_noise], counts),
        prior=settings.prior_mean if kind.prior_mean_from_settings else half,
        kernel=kind(support_radius=settings.support_scale * max_distance(X), amplitude=half),
        centre=centre,
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


def max_distance(X: Array) -> float:
    """Largest distance between two of the points X (N, 3) [m], from differences, so exact far from the origin."""
    return float(pdist(X).max())
