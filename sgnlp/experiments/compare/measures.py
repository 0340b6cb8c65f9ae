"""Measures of solvers on wide frames: an instance a line, a solver a column; a failure is infinite, NaN was not run."""

import math
from collections.abc import Sequence

import numpy as np

from sgnlp.experiments.frames import Frame

SHIFT = 0.1
"""Shift of the geometric mean [s]: differences below it hardly count; Ipopt takes about as long here."""


def shifted_geometric_mean(times: Sequence[float], shift: float = SHIFT) -> float:
    """exp(mean log(t + s)) - s, infinite if one is; NaN of none."""
    return float(np.exp(np.log(np.add(times, shift)).mean()) - shift) if len(times) else math.nan


def performance_profile(values: Frame, factors: Sequence[float]) -> Frame:
    """ρ(τ): the share of the common instances that each solver solves within τ times the best (Dolan & Moré 2002)."""
    common = values.dropna()
    ratios = common.div(common.min(axis=1).replace(math.inf, math.nan), axis=0).fillna(math.inf)
    return _shares(ratios, factors)


def data_profile(values: Frame, budgets: Sequence[float]) -> Frame:
    """d(κ): the share of the common instances that each solver solves within κ units of work (Moré & Wild 2009)."""
    return _shares(values.dropna(), budgets)


def _shares(values: Frame, limits: Sequence[float]) -> Frame:
    """The share of the lines within each limit, a line a limit."""
    shares = np.stack([(values <= limit).mean() for limit in limits])
    return type(values)(shares, limits, values.columns)
