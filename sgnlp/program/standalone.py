"""A nonlinear program with its surface written out: functions of x alone that need nothing but CasADi.

The posterior is the same matrix expression as in `Gpis.mean_jet` and `Gpis.variance_jet`, its training data constants.
`nlp` gives f and g, which CasADi can differentiate itself; `gradient`, `jacobian` and `hessian` are the structured ones
of `sgnlp.program.nlp`, exact and some hundred times faster.
"""

import casadi as ca

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.program.around import ALONE
from sgnlp.program.nlp import Nlp
from sgnlp.surface.gpis import MIN_SLOPE, Gpis
from sgnlp.surface.jets import JET
from sgnlp.surface.symbolic import Posterior


def functions(nlp: Nlp, gpis: Gpis, p: Array) -> dict[str, ca.Function]:
    """The program at parameters p, under the names that CasADi's solvers expect.

    `nlp` x → (f, g); `gradient` → (f, ∇f) and `jacobian` → (g, J) of (x, p), p empty; `hessian` (x, p, λ_f, λ_g) → the
    upper triangle.
    """
    x, none, parameters = ca.MX.sym("x", len(nlp.units)), ca.MX.sym("p", 0, 0), ca.MX(ca.DM(p))
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", sum(nlp.row_sizes))
    values, jets = ([x, parameters, *blocks(nlp, gpis, x, parameters, complete)] for complete in (False, True))
    hessian = nlp.hessian(*jets, lam_f, lam_g)
    return {
        "nlp": ca.Function("nlp", [x], [nlp.objective(*values), nlp.rows(*values)], ["x"], ["f", "g"]),
        "gradient": ca.Function("gradient", [x, none], nlp.gradient(*jets), ["x", "p"], ["f", "grad_f_x"]),
        "jacobian": ca.Function("jacobian", [x, none], nlp.jacobian(*jets), ["x", "p"], ["g", "jac_g_x"]),
        "hessian": ca.Function(
            "hessian", [x, none, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
        ),
    }


def blocks(nlp: Nlp, gpis: Gpis, x: ca.MX, p: ca.MX, complete: bool) -> list[ca.MX]:
    """The blocks of `Layout.symbols()`; without derivatives if CasADi finds them itself.

    Raises `InputError` for a program with obstacles or regions, whose distances are not CasADi expressions.
    """
    layout = nlp.layout
    if nlp.structure.around != ALONE:
        raise InputError("a program with obstacles or regions cannot be exported: leave them out")
    given, depths, _ = nlp.points(x, p)
    m, before = layout.m, layout.before_feet
    slopes = Posterior(gpis, given[:m, :]).gradient()
    normals = slopes / ca.repmat(ca.sqrt(ca.sum2(slopes**2) + MIN_SLOPE**2), 1, 3)
    feet = given[:m, :] - ca.repmat(depths, 1, 3) * normals
    Z = ca.vertcat(given[:before, :], feet, given[before:, :])
    every, uncertain = Posterior(gpis, Z), Posterior(gpis, given[: layout.uncertain, :])
    if complete:
        return [*nlp.jets(every.mean_jet().T, uncertain.variance_jet().T), ca.MX(0, JET)]
    mean, slope = every.mean(), ca.sqrt(ca.sum2(every.gradient() ** 2) + MIN_SLOPE**2)
    D, V = layout.distances, layout.uncertain
    columns = [(mean / slope)[:D], uncertain.variance() / slope[:V] ** 2, *ca.horzsplit(normals), mean[D:]]
    distance, deviation, *axes, targets = [ca.horzcat(c, ca.MX.zeros(c.numel(), JET - 1)) for c in columns]
    return [distance, deviation, ca.horzcat(*axes), targets, ca.MX(0, JET)]
