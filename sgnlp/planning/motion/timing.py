"""Timing of a motion: quintic time scaling from rest to rest, as slow as the tightest limit requires.

    s(u) = 10 u³ - 15 u⁴ + 6 u⁵,   u = t/T,   max ds/dt = 15/(8 T)

Speed and acceleration are 0 at both ends.
"""

from math import ceil

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.plausible import TURNING, VELOCITY

PEAK = 15 / 8
"""Largest ds/du, at u = 1/2."""
UNSTATED = 1.0
"""Velocity limit [rad/s or m/s] of a joint without one in the URDF: that of a slow servo."""
FASTEST = VELOCITY[TURNING].most
"""Largest velocity limit of a hand's joint that is believed [rad/s or m/s]."""
ROUNDING = 1e-9
"""A duration this close [steps] above a whole number of steps does not get another step."""


def quintic(u: Array) -> Array:
    """s = 10 u³ - 15 u⁴ + 6 u⁵: the share s of the way at shares u of the time, both from 0 to 1."""
    return np.asarray(u * u * u * (10.0 + u * (6.0 * u - 15.0)))


def shares(seconds: float, step: float) -> Array:
    """The samples s (K + 1,) of a phase, from 0 to 1: a `step` [s] apart, over `seconds` or slightly more."""
    count = max(ceil(seconds / step - ROUNDING), 1)
    return quintic(np.arange(count + 1) / count)


def seconds(ways: Array, limits: Array, least: float = 0.0) -> float:
    """Duration of straight ways (K,) at speeds within `limits` (K,): that of the slowest, at least `least` [s]."""
    return float(max(PEAK * np.max(np.abs(ways) / limits, initial=0.0), least))


def stated(limits: Array) -> Array:
    """Velocity limits (n,), with `UNSTATED` in place of missing ones (0 or infinite in the URDF).

    Beyond `FASTEST` they are missing, too: exporters of CAD programs write 100 or 1000 for every joint.
    """
    return np.where((limits > 0) & (limits <= FASTEST), limits, UNSTATED)
