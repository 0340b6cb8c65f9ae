"""Functions that CasADi can differentiate, for CasADi solvers that build their derivatives themselves.

The functions of an oracle end in a callback, which CasADi cannot differentiate. Here (f, g) is one function with a
given Jacobian and reverse derivative, whose own Jacobian, the Hessian, is given too. CasADi has nothing left to derive.
"""

import casadi as ca

from sgnlp.program.oracle import Functions

OWN = {"never_inline": True, "enable_forward": False, "enable_fd": False}
"""CasADi options: use only the given derivatives."""
REVERSE_ONCE = 1.5
"""CasADi's weight (over the rows) that makes it use the reverse derivative for one direction, the Jacobian for two."""


def differentiable(functions: Functions) -> dict[str, ca.MX]:
    """The problem x, p, f, g as `casadi.nlpsol` takes it, with exact first and second derivatives."""
    x = ca.MX.sym("x", functions.objective.size1_in(0))
    p = ca.MX.sym("p", functions.objective.size1_in(1))
    both = ca.vertcat(functions.objective(x, p), functions.rows(x, p))
    rows = both.numel()
    options = {
        "custom_jacobian": _jacobian(functions, x, p, rows),
        "cache": {"adj1_fg": _reverse(functions, x, p, rows)},
    }
    values = ca.Function("fg", [x, p], [both], ["x", "p"], ["fg"], OWN | options | {"jac_penalty": REVERSE_ONCE / rows})
    fg = values(x, p)
    return {"x": x, "p": p, "f": fg[0], "g": fg[1:]}


def _stacked(functions: Functions, x: ca.MX, p: ca.MX) -> ca.MX:
    """∇fᵀ over J."""
    return ca.vertcat(functions.gradient(x, p)[1].T, functions.jacobian(x, p)[1])


def _jacobian(functions: Functions, x: ca.MX, p: ca.MX, rows: int) -> ca.Function:
    outputs = [_stacked(functions, x, p), ca.MX(rows, p.numel())]
    return ca.Function("jac_fg", [x, p, ca.MX.sym("fg", rows)], outputs)


def _reverse(functions: Functions, x: ca.MX, p: ca.MX, rows: int) -> ca.Function:
    """(x, p, fg, λ) → ∇(λᵀ fg), with H(λ) as its derivative by x; no other is needed."""
    n, m = x.numel(), p.numel()
    fg, lam = ca.MX.sym("out_fg", rows), ca.MX.sym("adj_fg", rows)
    ends = [ca.MX.sym("out_adj_x", n), ca.MX.sym("out_adj_p", m)]
    H = ca.triu2symm(functions.hessian(x, p, lam[0], lam[1:]))
    by_x = [H, *(ca.MX(n, size) for size in (m, rows, rows))]
    by_p = [ca.MX(m, size) for size in (n, m, rows, rows)]
    jacobian = ca.Function("jac_adj1_fg", [x, p, fg, lam, *ends], by_x + by_p)
    x_bar = functions.gradient(x, p)[1] * lam[0] + functions.jacobian(x, p)[1].T @ lam[1:]
    by_x_alone = {"is_diff_in": [True, False, False, False], "is_diff_out": [True, False]}
    given = OWN | by_x_alone | {"enable_reverse": False, "custom_jacobian": jacobian, "jac_penalty": 0}
    names = ["x", "p", "out_fg", "adj_fg"], ["adj_x", "adj_p"]
    return ca.Function("adj1_fg", [x, p, fg, lam], [x_bar, ca.MX(m, 1)], *names, given)
