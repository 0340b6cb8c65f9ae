"""Tests whether a solver runs on this machine, by a small problem with known solution in its own process."""

import casadi as ca
import numpy as np

from sgnlp.planning.solvers.process import Send, apart, spend
from sgnlp.planning.solvers.solver import NlpInstance, Solver
from sgnlp.program.oracle import Functions

SOLUTION = np.array([0.0, 1.0, 2.0, -1.0])
"""Solution of problem 43 of Hock & Schittkowski (1981), where f = -44."""
START = np.zeros(4)
"""Initial point, which is feasible."""
PATIENCE = 5.0
"""Processor time for the small problem [s]: a solver that runs takes a hundredth of it."""
RATE = 0.01
"""Step of the first-order methods."""


def problem() -> Functions:
    """Problem 43 of Hock & Schittkowski (Rosen & Suzuki), its three rows as g ≥ 0; the parameter scales f."""
    x, p = ca.MX.sym("x", 4), ca.MX.sym("p")
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 3)
    a, b, c, d = ca.vertsplit(x)
    f = p * (a**2 + b**2 + 2 * c**2 + d**2 - 5 * a - 5 * b - 21 * c + 7 * d)
    g = ca.vertcat(
        8 - a**2 - b**2 - c**2 - d**2 - a + b - c + d,
        10 - a**2 - 2 * b**2 - c**2 - 2 * d**2 + a + d,
        5 - 2 * a**2 - b**2 - c**2 - 2 * a + b + d,
    )
    H = ca.triu(ca.hessian(lam_f * f + ca.dot(lam_g, g), x)[0])
    names = ["x", "p"]
    return Functions(
        objective=ca.Function("objective", [x, p], [f], names, ["f"]),
        gradient=ca.Function("gradient", [x, p], [f, ca.gradient(f, x)], names, ["f", "grad_f_x"]),
        rows=ca.Function("rows", [x, p], [g], names, ["g"]),
        jacobian=ca.Function("jacobian", [x, p], [g, ca.jacobian(g, x)], names, ["g", "jac_g_x"]),
        hessian=ca.Function("hessian", [x, p, lam_f, lam_g], [H], [*names, "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]),
    )


def instance(tolerance: float = 1e-8) -> NlpInstance:
    """The problem with bounds on x that are not active."""
    return NlpInstance(
        functions=problem(),
        p=np.ones(1),
        x_bounds=(np.full(4, -10.0), np.full(4, 10.0)),
        g_bounds=(np.zeros(3), np.full(3, np.inf)),
        tolerance=tolerance,
        iterations=1000,
        rates=np.full(4, RATE),
    )


def missing(solver: Solver) -> str:
    """Why a solver does not run on this machine; "" if it does."""

    def work(send: Send) -> None:
        spend(PATIENCE)
        send(bool(np.isfinite(solver.solve(instance(), START).x).all()))

    sent, reason = apart(work, PATIENCE)
    return reason or ("" if sent == [True] else "its answer is not finite")
