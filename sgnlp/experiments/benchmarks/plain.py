"""The same nonlinear program as one expression that CasADi differentiates as a whole, for comparison only."""

import casadi as ca

from sgnlp.hand.hand import Hand
from sgnlp.program.nlp import Nlp, build
from sgnlp.program.structure import Structure
from sgnlp.surface.gpis import MIN_SLOPE, Gpis, parameters, symbolic
from sgnlp.surface.jets import JET


def plain(hand: Hand, structure: Structure, gpis: Gpis) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX]:
    """x, p, f(x, p) and g(x, p), the kernel sums written into the expressions."""
    nlp = build(hand, structure)  # compiled functions have no derivatives
    x, p = ca.MX.sym("x", len(nlp.units)), ca.MX.sym("p", sum(nlp.parameters.sizes.values()))
    jets = _values(nlp, gpis, *nlp.points(x, p))
    return x, p, nlp.objective(x, p, *jets), nlp.rows(x, p, *jets)


def plain_hessian(hand: Hand, structure: Structure, gpis: Gpis) -> ca.Function:
    """(x, p, λ_f, λ_g) → upper triangle of ∇²(λ_f f + λ_gᵀ g)."""
    x, p, f, g = plain(hand, structure, gpis)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.numel())
    H = ca.hessian(lam_f * f + ca.dot(lam_g, g), x)[0]
    return ca.Function("plain_hessian", [x, p, lam_f, lam_g], [ca.triu(H)])


def _values(nlp: Nlp, gpis: Gpis, given: ca.MX, depths: ca.MX) -> list[ca.MX]:
    """The blocks of `Layout.symbols()` as expressions; where derivatives stand, CasADi finds them itself: zeros."""
    layout = nlp.layout
    m, V, D, before = layout.m, layout.uncertain, layout.distances, layout.before_feet
    Z = given.T
    _, slope, gradient, _ = _posterior(gpis, Z[:, :m])
    feet = Z[:, :m] - ca.repmat(depths.T, 3, 1) * gradient / ca.repmat(slope, 3, 1)
    mean, slope, gradient, variance = _posterior(gpis, ca.horzcat(Z[:, :before], feet, Z[:, before:]))
    normals = gradient[:, :m] / ca.repmat(slope[:, :m], 3, 1)
    rows = [(mean / slope)[:D], (variance / slope**2)[:V], *(normals[a, :] for a in range(3)), mean[D:]]
    distance, deviation, *axes, targets = [ca.horzcat(row.T, ca.MX.zeros(row.numel(), JET - 1)) for row in rows]
    return [distance, deviation, ca.horzcat(*axes), targets]


def _posterior(gpis: Gpis, Z: ca.MX) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX]:
    """Mean (1, Q), |∇μ| (1, Q), gradient (3, Q) and variance (1, Q) at the columns of Z (3, Q)."""
    one = symbolic(gpis.kernel, len(gpis.X))
    every = one.map("every", "serial", Z.shape[1], list(range(1, one.n_in())), [])
    found = every.call([Z, *map(ca.DM, parameters(gpis))])
    mean, gradient, variance = (found[one.index_out(name)] for name in ("mean", "gradient", "variance"))
    return mean, ca.sqrt(ca.sum1(gradient**2) + MIN_SLOPE**2), gradient, variance
