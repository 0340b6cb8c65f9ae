"""A nonlinear program with its surface written out: functions of x alone that need nothing but CasADi.

The posterior is the same matrix expression as in `Gpis.mean_jet` and `Gpis.variance_jet`, its training data constants.
`nlp` gives f and g, which CasADi can differentiate itself; `gradient`, `jacobian` and `hessian` are the structured ones
of `sgnlp.program.nlp`, exact and some hundred times faster.
"""

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.program.nlp import Nlp
from sgnlp.surface.gpis import MIN_SLOPE, PAIRS, TRIPLES, Gpis
from sgnlp.surface.jets import JET
from sgnlp.surface.kernels import MIN_RADIUS, kernel

Array = NDArray[np.float64]


class _Posterior:
    """The posterior at points Z (Q, 3): jets as rows (number of the jet, Q), written as CasADi matrices."""

    def __init__(self, gpis: Gpis, Z: ca.MX):
        Q, (N, _) = Z.shape[0], gpis.X.shape
        self._gpis, self._alpha = gpis, ca.MX(ca.DM(gpis.alpha))
        self.d = [ca.repmat(Z[:, a], 1, N) - ca.repmat(ca.MX(ca.DM(gpis.X[:, a])).T, Q, 1) for a in range(3)]
        r = ca.sqrt(ca.fmax(self.d[0] ** 2 + self.d[1] ** 2 + self.d[2] ** 2, MIN_RADIUS**2))
        self.k = kernel(gpis.kernel, gpis.reach, gpis.amplitude).radial(r)

    def mean(self) -> list[ca.MX]:
        """μ and ∇μ, each (Q,)."""
        slopes = [(self.k[1] * d) @ self._alpha for d in self.d]
        return [self._gpis.prior + self.k[0] @ self._alpha, *slopes]

    def mean_jet(self) -> list[ca.MX]:
        """As `Gpis.mean_jet`."""
        d, (_, k1, k2, k3) = self.d, self.k
        slope, first = k1 @ self._alpha, [(k2 * d[a]) @ self._alpha for a in range(3)]
        second = [(k2 * d[a] * d[b]) @ self._alpha + (a == b) * slope for a, b in PAIRS]
        third = [
            (k3 * d[a] * d[b] * d[c]) @ self._alpha + (a == b) * first[c] + (a == c) * first[b] + (b == c) * first[a]
            for a, b, c in TRIPLES
        ]
        return [*self.mean(), *second, *third]

    def variance(self) -> list[ca.MX]:
        """σ² (Q,)."""
        return [self._gpis.prior_variance - ca.sum2(self._whiten(self.k[0]) ** 2)]

    def variance_jet(self) -> list[ca.MX]:
        """As `Gpis.variance_jet`."""
        d, (k, k1, k2, _) = self.d, self.k
        w, wd = self._whiten(k), [self._whiten(k1 * d[a]) for a in range(3)]
        beta = w @ ca.MX(ca.DM(self._gpis.whitener))
        slope = ca.sum2(beta * k1)
        first = [-2 * ca.sum2(w * wd[a]) for a in range(3)]
        second = [-2 * (ca.sum2(wd[a] * wd[b]) + ca.sum2(beta * k2 * d[a] * d[b]) + (a == b) * slope) for a, b in PAIRS]
        return [*self.variance(), *first, *second]

    def _whiten(self, K: ca.MX) -> ca.MX:
        return K @ ca.MX(ca.DM(self._gpis.whitener)).T


def functions(nlp: Nlp, gpis: Gpis, p: Array) -> dict[str, ca.Function]:
    """The program at parameters p, under the names that CasADi's solvers expect.

    `nlp` x → (f, g); `gradient` → (f, ∇f) and `jacobian` → (g, J) of (x, p), p empty; `hessian` (x, p, λ_f, λ_g) → the
    upper triangle.
    """
    x, none, parameters = ca.MX.sym("x", len(nlp.units)), ca.MX.sym("p", 0, 0), ca.MX(ca.DM(p))
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", sum(nlp.row_sizes))
    values, jets = ([x, parameters, *_blocks(nlp, gpis, x, parameters, complete)] for complete in (False, True))
    hessian = nlp.hessian(*jets, lam_f, lam_g)
    return {
        "nlp": ca.Function("nlp", [x], [nlp.objective(*values), nlp.rows(*values)], ["x"], ["f", "g"]),
        "gradient": ca.Function("gradient", [x, none], nlp.gradient(*jets), ["x", "p"], ["f", "grad_f_x"]),
        "jacobian": ca.Function("jacobian", [x, none], nlp.jacobian(*jets), ["x", "p"], ["g", "jac_g_x"]),
        "hessian": ca.Function(
            "hessian", [x, none, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
        ),
    }


def _blocks(nlp: Nlp, gpis: Gpis, x: ca.MX, p: ca.MX, complete: bool) -> list[ca.MX]:
    """The blocks of `Layout.symbols()`; without derivatives where CasADi is to find them itself."""
    layout = nlp.layout
    given, depths = nlp.points(x, p)
    m, before = layout.m, layout.before_feet
    slopes = ca.horzcat(*_Posterior(gpis, given[:m, :]).mean()[1:])
    normals = slopes / ca.repmat(ca.sqrt(ca.sum2(slopes**2) + MIN_SLOPE**2), 1, 3)
    feet = given[:m, :] - ca.repmat(depths, 1, 3) * normals
    Z = ca.vertcat(given[:before, :], feet, given[before:, :])
    every, uncertain = _Posterior(gpis, Z), _Posterior(gpis, given[: layout.uncertain, :])
    if complete:
        blocks = nlp.jets(ca.horzcat(*every.mean_jet()).T, ca.horzcat(*uncertain.variance_jet()).T)
        return list(blocks)
    mean, *gradient = every.mean()
    slope = ca.sqrt(sum((g**2 for g in gradient), start=ca.MX(0)) + MIN_SLOPE**2)
    D, V = layout.distances, layout.uncertain
    columns = [(mean / slope)[:D], uncertain.variance()[0] / slope[:V] ** 2, *ca.horzsplit(normals), mean[D:]]
    distance, deviation, *axes, targets = [ca.horzcat(c, ca.MX.zeros(c.numel(), JET - 1)) for c in columns]
    return [distance, deviation, ca.horzcat(*axes), targets]
