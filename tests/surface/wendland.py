"""A kernel from outside the package, written in both ways: Wendland's C⁴ function (Wendland 2005, table 9.1, d = 3)."""

from typing import Any

import casadi as ca

import sgnlp


class Wendland(sgnlp.Kernel):
    """k = σ0² (1 - u)⁶ (35u² + 18u + 3)/3 for u = r/R ≤ 1, else 0, given alone."""

    def value(self, r: Any) -> Any:
        u = ca.fmin(r / self.support_radius, 1)
        return self.amplitude**2 * (1 - u) ** 6 * (35 * u**2 + 18 * u + 3) / 3


class WendlandInFull(sgnlp.Kernel):
    """The same with its radial derivatives by hand."""

    name = "wendland in full"

    def radial(self, r: Any) -> Any:
        R, s = self.support_radius, self.amplitude**2
        u, v = r / R, (r < R) * (1 - r / R)
        return (
            s * v**6 * (35 * u**2 + 18 * u + 3) / 3,
            -56 * s / (3 * R**2) * v**5 * (1 + 5 * u),
            560 * s / R**4 * v**4,
            -2240 * s / R**6 * v**3 / u,
        )
