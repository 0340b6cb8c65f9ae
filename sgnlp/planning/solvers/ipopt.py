"""Ipopt (Wächter & Biegler 2006) on the exact derivatives of a program."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import casadi as ca

from sgnlp.base import settings
from sgnlp.planning.solvers.casadi_call import called
from sgnlp.planning.solvers.solver import Answer, Array, NlpInstance, Solver
from sgnlp.program.oracle import Functions

DEFAULTS = settings.Solver()


@dataclass(frozen=True)
class Ipopt(Solver):
    """With the exact Hessian, or with the limited-memory one for comparison."""

    hessian: Literal["exact", "limited-memory"] = "exact"
    linear_solver: str = DEFAULTS.linear_solver
    mu_strategy: str = DEFAULTS.mu_strategy
    mu_init: float = DEFAULTS.mu_init
    barrier_tolerance: float = DEFAULTS.barrier_tolerance

    kind = "interior point"
    derivatives = 2

    @staticmethod
    def of(chosen: settings.Solver) -> "Ipopt":
        """Ipopt as settings ask for it."""
        names = ("tolerance", "linear_solver", "mu_strategy", "mu_init", "barrier_tolerance")
        return Ipopt(**{name: getattr(chosen, name) for name in names})

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """CasADi's Ipopt over the oracle's own derivatives."""
        return called(_nlpsol(self, nlp.functions, nlp.tolerance, nlp.iterations), nlp, x)

    def prepare(self, nlp: NlpInstance) -> None:
        """Build CasADi's Ipopt."""
        _nlpsol(self, nlp.functions, nlp.tolerance, nlp.iterations)

    def options(self, tolerance: float, iterations: int) -> dict[str, Any]:
        """Its options, in CasADi's names."""
        limited = {"ipopt.hessian_approximation": "limited-memory"} if self.hessian == "limited-memory" else {}
        return limited | {
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.tol": tolerance,
            "ipopt.max_iter": iterations,
            "ipopt.mu_strategy": self.mu_strategy,
            "ipopt.mu_init": self.mu_init,
            "ipopt.barrier_tol_factor": self.barrier_tolerance,
            "ipopt.linear_solver": self.linear_solver,
            "ipopt.mumps_scaling": 0,  # variables and rows are scaled; MUMPS's own costs a quarter of an iteration
            "ipopt.mumps_permuting_scaling": 0,
            "print_time": False,
            "no_nlp_grad": True,
            "calc_lam_p": False,
        }


@lru_cache(maxsize=8)
def _nlpsol(ipopt: Ipopt, functions: Functions, tolerance: float, iterations: int) -> ca.Function:
    """The same functions and numbers give the same solver: a process solves many starts with it."""
    x, p = ca.MX.sym("x", functions.objective.size1_in(0)), ca.MX.sym("p", functions.objective.size1_in(1))
    problem = {"x": x, "p": p, "f": functions.objective(x, p), "g": functions.rows(x, p)}
    derivatives = {"grad_f": functions.gradient, "jac_g": functions.jacobian, "hess_lag": functions.hessian}
    return ca.nlpsol("ipopt", "ipopt", problem, ipopt.options(tolerance, iterations) | derivatives)
