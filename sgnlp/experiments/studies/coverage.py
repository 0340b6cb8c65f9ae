"""Coverage: the share of errors inside their intervals, kept as quantiles so that other intervals can be tried later.

An interval of level q is ± s Φ⁻¹((1 + q)/2) σ; it is calibrated where a share q of the errors lies inside.
"""

from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEVELS = (0.5, 0.9, 0.95)
QUANTILES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
"""Shares of the errors at which |z| is kept, z = error/σ."""
FACTORS = np.geomspace(0.02, 20, 301)
"""Where the factor s is looked for, in steps of 2 %."""


def half_width(level: float) -> float:
    """Φ⁻¹((1 + level)/2), half the interval of a level in deviations."""
    return NormalDist().inv_cdf((1 + level) / 2)


def coverage(errors: Array, deviations: Array, level: float) -> float:
    """Share of errors (Q,) inside their intervals."""
    return float((np.abs(errors) <= half_width(level) * deviations).mean())


def quantiles(errors: Array, deviations: Array) -> str:
    """The `QUANTILES` of |z|, as a text of three digits each."""
    return " ".join(f"{z:.3g}" for z in np.quantile(np.abs(errors) / deviations, QUANTILES))


def kept_coverage(texts: Sequence[str], points: Sequence[int], level: float, factors: float | Array = 1.0) -> Array:
    """Coverage over all points of several `quantiles`, of intervals widened by each factor s; to 1 % or so."""
    widths = half_width(level) * np.atleast_1d(factors)
    kept = [np.interp(widths, np.array(text.split(), float), QUANTILES, left=0.0) for text in texts]
    return np.average(kept, axis=0, weights=points)


def factor(groups: Sequence[tuple[Sequence[str], Sequence[int]]]) -> float:
    """The s that brings the coverage of every group, at all `LEVELS`, nearest to the levels in the mean square.

    A group is the `quantiles` and the numbers of points of several sets of errors.
    """
    misses = [(kept_coverage(*group, level, FACTORS) - level) ** 2 for group in groups for level in LEVELS]
    return float(FACTORS[np.mean(misses, axis=0).argmin()])
