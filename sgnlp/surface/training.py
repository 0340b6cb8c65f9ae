"""The training set of the implicit surface, and its prior."""

from dataclasses import dataclass, replace

from scipy.spatial.distance import pdist

from sgnlp.base.arrays import Array
from sgnlp.base.surface_settings import FreeSpace, GpisSettings
from sgnlp.perception.free_space import Sight, doubt
from sgnlp.perception.observation import Observation
from sgnlp.surface.carving import carved_samples
from sgnlp.surface.cube import cube, cube_samples
from sgnlp.surface.hull import cameras_of
from sgnlp.surface.kernel import FIELDS, Kernel, demanding
from sgnlp.surface.kernels import named
from sgnlp.surface.samples import Samples

UNUSED = FreeSpace()


@dataclass(frozen=True)
class TrainingSet:
    """Points X (N, 3) [m], values y (N,) [m], noise deviations (N,) [m]; surface points come first.

    The prior is a process of mean `prior` [m] and covariance `kernel`; `centre` (3,) [m] is the middle of the object's
    box. The posterior's deviation is multiplied by `deviation_scale`.
    """

    X: Array
    y: Array
    noise: Array
    prior: float
    kernel: Kernel
    centre: Array
    deviation_scale: float = 1.0
    free_space: bool = False  # whether it has points of free space


def training_set(
    observation: Observation,
    settings: GpisSettings,
    seed: int,
    kernel: type[Kernel] | None = None,
    free_space: FreeSpace = UNUSED,
) -> TrainingSet:
    """The training set of an observation; the same seed gives the same set.

    It uses free space if that is wanted and known, else it is the paper's set.

    Raises:
        InputError: no `kernel` is given, and the settings name an unknown one.
    """
    kind = kernel or named(settings.kernel)
    centre, half = cube(observation, settings)
    seen_by = _trusted(observation) if free_space.used else ()
    if seen_by:
        samples = carved_samples(observation, seen_by, free_space, seed)
        prior, amplitude, scale = free_space.prior_mean, free_space.prior_mean, free_space.support_scale
        carved = _set(samples, kind, prior, amplitude, scale, centre)
        return replace(carved, deviation_scale=free_space.deviation_scale, free_space=True)
    prior = settings.prior_mean if kind.prior_mean_from_settings else half
    return _set(cube_samples(observation, settings, seed), kind, prior, half, settings.support_scale, centre)


def carves(observation: Observation, free_space: FreeSpace) -> bool:
    """Whether a training set has free space: it is wanted, and the cameras' positions are known and plausible."""
    return free_space.used and bool(_trusted(observation))


def _trusted(observation: Observation) -> tuple[Sight, ...]:
    """What the cameras saw; empty if their positions are implausible."""
    seen_by = cameras_of(observation)
    return () if doubt(seen_by) else seen_by


def _set(
    samples: Samples, kind: type[Kernel], prior: float, amplitude: float, scale: float, centre: Array
) -> TrainingSet:
    """Samples and a kernel whose R is `scale` times the largest distance between them."""
    with demanding(kind, FIELDS):
        kernel = kind(support_radius=scale * max_distance(samples.X), amplitude=amplitude)
    return TrainingSet(samples.X, samples.y, samples.noise, prior, kernel, centre)


def max_distance(X: Array) -> float:
    """Largest distance between two of the points X (N, 3) [m], from differences, so exact far from the origin."""
    return float(pdist(X).max())
