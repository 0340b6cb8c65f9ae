"""The same nonlinear program as one expression that CasADi differentiates as a whole, for comparison only."""

import casadi as ca

from sgnlp.hand.hand import Hand
from sgnlp.program.nlp import build
from sgnlp.program.standalone import blocks
from sgnlp.program.structure import Structure
from sgnlp.surface.gpis import Gpis


def plain(hand: Hand, structure: Structure, gpis: Gpis) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX]:
    """x, p, f(x, p) and g(x, p), the kernel sums written into the expressions."""
    nlp = build(hand, structure)  # compiled functions have no derivatives
    x, p = ca.MX.sym("x", len(nlp.units)), ca.MX.sym("p", sum(nlp.parameters.sizes.values()))
    jets = blocks(nlp, gpis, x, p, complete=False)
    return x, p, nlp.objective(x, p, *jets), nlp.rows(x, p, *jets)


def plain_hessian(hand: Hand, structure: Structure, gpis: Gpis) -> ca.Function:
    """(x, p, λ_f, λ_g) → upper triangle of ∇²(λ_f f + λ_gᵀ g)."""
    x, p, f, g = plain(hand, structure, gpis)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.numel())
    H = ca.hessian(lam_f * f + ca.dot(lam_g, g), x)[0]
    return ca.Function("plain_hessian", [x, p, lam_f, lam_g], [ca.triu(H)])
