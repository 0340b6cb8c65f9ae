"""When a motion is where: quintic time scaling from rest to rest, as slow as the slowest limit asks.

    s(u) = 10 u³ - 15 u⁴ + 6 u⁵,   u = t/T,   max ds/dt = 15/(8 T)

Speed and acceleration are 0 at both ends.
"""

from math import ceil

import numpy as np

from sgnlp.base.arrays import Array

PEAK = 15 / 8
"""Largest ds/du, in the middle."""
UNSTATED = 1.0
"""Velocity limit [rad/s or m/s] of a joint whose URDF states none: a slow servo's."""
ROUNDING = 1e-9
"""A duration that is a whole number of steps but for so many of them does not get another step."""


def quintic(u: Array) -> Array:
    """The share s of the way at shares u of the time, both from 0 to 1."""
    return np.asarray(u * u * u * (10.0 + u * (6.0 * u - 15.0)))


def shares(seconds: float, step: float) -> Array:
    """Where the samples of a phase are, s (K + 1,) from 0 to 1: a `step` [s] apart, over `seconds` or a little more."""
    count = max(ceil(seconds / step - ROUNDING), 1)
    return quintic(np.arange(count + 1) / count)


def seconds(ways: Array, limits: Array, least: float = 0.0) -> float:
    """How long straight ways (K,) take at speeds within `limits` (K,), the slowest of them; `least` [s] at least."""
    return float(max(PEAK * np.max(np.abs(ways) / limits, initial=0.0), least))


def stated(limits: Array) -> Array:
    """Velocity limits (n,), with `UNSTATED` where a URDF gives none: 0, or a number without end."""
    none = (limits <= 0) | ~(limits < np.finfo(np.float32).max)
    return np.where(none, UNSTATED, limits)
