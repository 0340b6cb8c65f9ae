"""Wendland's kernel of smoothness C⁴ (Wendland 2005, table 9.1): zero beyond R. Use it by `--with`."""

import casadi as ca

import sgnlp


class Wendland(sgnlp.Kernel):
    """k = σ0² (1 - u)⁶ (35u² + 18u + 3)/3 for u = r/R ≤ 1, else 0."""

    def value(self, r):
        """The kernel at a distance r [m]."""
        u = ca.fmin(r / self.support_radius, 1)
        return self.amplitude**2 * (1 - u) ** 6 * (35 * u**2 + 18 * u + 3) / 3


KERNEL = Wendland
