"""The posterior in CasADi, written with the kernel's radial functions; the training data are constants."""

import casadi as ca

from sgnlp.surface.gpis import PAIRS, TRIPLES, Gpis
from sgnlp.surface.kernel import MIN_RADIUS


class Posterior:
    """The posterior at points Z (Q, 3) as CasADi matrices, with the shapes of the numbers of `Gpis`."""

    def __init__(self, gpis: Gpis, Z: ca.MX):
        Q, (N, _) = Z.shape[0], gpis.X.shape
        self._gpis, self._alpha = gpis, ca.MX(ca.DM(gpis.alpha))
        self._d = [ca.repmat(Z[:, a], 1, N) - ca.repmat(ca.MX(ca.DM(gpis.X[:, a])).T, Q, 1) for a in range(3)]
        r = ca.sqrt(ca.fmax(self._d[0] ** 2 + self._d[1] ** 2 + self._d[2] ** 2, MIN_RADIUS**2))
        self._k = gpis.kernel.radial(r)

    def mean(self) -> ca.MX:
        """μ (Q,)."""
        return self._gpis.prior + self._k[0] @ self._alpha

    def gradient(self) -> ca.MX:
        """∇μ (Q, 3)."""
        return ca.horzcat(*[(self._k[1] * d) @ self._alpha for d in self._d])

    def mean_jet(self) -> ca.MX:
        """μ and its derivatives of order 1, 2 and 3 (Q, 20), as `Gpis.mean_jet`."""
        d, (_, k1, k2, k3) = self._d, self._k
        slope, first = k1 @ self._alpha, [(k2 * d[a]) @ self._alpha for a in range(3)]
        second = [(k2 * d[a] * d[b]) @ self._alpha + (a == b) * slope for a, b in PAIRS]
        third = [
            (k3 * d[a] * d[b] * d[c]) @ self._alpha + (a == b) * first[c] + (a == c) * first[b] + (b == c) * first[a]
            for a, b, c in TRIPLES
        ]
        return ca.horzcat(self.mean(), self.gradient(), *second, *third)

    def variance(self) -> ca.MX:
        """σ² (Q,), not cut off at 0."""
        return self._gpis.prior_variance - ca.sum2(self._whiten(self._k[0]) ** 2)

    def variance_jet(self) -> ca.MX:
        """σ² and its derivatives of order 1 and 2 (Q, 10), as `Gpis.variance_jet`."""
        d, (k, k1, k2, _) = self._d, self._k
        w, wd = self._whiten(k), [self._whiten(k1 * d[a]) for a in range(3)]
        beta = w @ ca.MX(ca.DM(self._gpis.chol_inverse))
        slope = ca.sum2(beta * k1)
        first = [-2 * ca.sum2(w * wd[a]) for a in range(3)]
        second = [-2 * (ca.sum2(wd[a] * wd[b]) + ca.sum2(beta * k2 * d[a] * d[b]) + (a == b) * slope) for a, b in PAIRS]
        return ca.horzcat(self.variance(), *first, *second)

    def _whiten(self, K: ca.MX) -> ca.MX:
        return K @ ca.MX(ca.DM(self._gpis.chol_inverse)).T
