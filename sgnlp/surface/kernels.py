"""The kernels that come with `sgnlp`: four radial functions each. The same lines serve NumPy arrays and CasADi.

Tests compare Dk, D²k and D³k with CasADi's own differentiation of k.
"""

from math import sqrt
from typing import Any

import casadi as ca
import numpy as np

from sgnlp.base.errors import unknown
from sgnlp.surface.kernel import Kernel, Radial


def exp(x: Any) -> Any:
    """e^x of a NumPy array or a CasADi expression."""
    return ca.exp(x) if isinstance(x, ca.SX | ca.MX | ca.DM) else np.exp(x)


class ThinPlate(Kernel):
    """k = 2r³ - 3Rr² + R³ for r ≤ R (Williams & Fitzgibbon 2007); k(0) = R³ for every σ0.

    It is a covariance only inside the ball r ≤ R. There k and k' vanish at r = R, so beyond the ball it is
    continued by 0: the mean returns to the prior mean and the variance to R³.
    """

    name = "thin_plate"
    prior_mean_from_settings = True

    def radial(self, r: Any) -> Radial:
        """(2r³ - 3Rr² + R³, 6(r - R), 6/r, -6/r³) inside the ball, 0 outside."""
        R, inside = self.support_radius, r < self.support_radius
        return inside * (R - r) ** 2 * (R + 2 * r), inside * (r - R) * 6, inside * 6 / r, inside * -6 / r**3


class Matern32(Kernel):
    """k = σ0²(1 + ar)e^{-ar}, a = √3/ℓ, ℓ = R/2 (Rasmussen & Williams 2006, eq. 4.17)."""

    def radial(self, r: Any) -> Radial:
        """σ0² e^{-ar} (1 + ar, -a², a³/r, -a³(1 + ar)/r³)."""
        a = 2 * sqrt(3) / self.support_radius
        e = self.amplitude**2 * exp(-a * r)
        return e * (1 + a * r), -(a**2) * e, a**3 * e / r, -(a**3) * e * (1 + a * r) / r**3


class Matern52(Kernel):
    """k = σ0²(1 + ar + a²r²/3)e^{-ar}, a = √5/ℓ, ℓ = R/2 (Rasmussen & Williams 2006, eq. 4.17)."""

    def radial(self, r: Any) -> Radial:
        """σ0² e^{-ar} (1 + ar + a²r²/3, -a²(1 + ar)/3, a⁴/3, -a⁵/(3r))."""
        a = 2 * sqrt(5) / self.support_radius
        e = self.amplitude**2 * exp(-a * r)
        return e * (1 + a * r + (a * r) ** 2 / 3), -(a**2) * e * (1 + a * r) / 3, a**4 * e / 3, -(a**5) * e / (3 * r)


class SquaredExponential(Kernel):
    """k = σ0² e^{-br²/2}, b = 1/ℓ², ℓ = R/4 (Rasmussen & Williams 2006, eq. 4.9)."""

    name = "squared_exponential"

    def radial(self, r: Any) -> Radial:
        """k (1, -b, b², -b³)."""
        b = 16 / self.support_radius**2
        k = self.amplitude**2 * exp(-b * r**2 / 2)
        return k, -b * k, b**2 * k, -(b**3) * k


KERNELS: dict[str, type[Kernel]] = {
    kernel.name: kernel for kernel in (ThinPlate, Matern32, Matern52, SquaredExponential)
}


def named(name: str) -> type[Kernel]:
    """The kernel with this name; raises `InputError` with the valid names."""
    if name not in KERNELS:
        raise unknown("kernel", name, KERNELS)
    return KERNELS[name]
