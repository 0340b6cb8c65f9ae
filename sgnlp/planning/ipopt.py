"""One start of the nonlinear program solved by Ipopt with exact first and second derivatives."""

import time
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.base.settings import Solver
from sgnlp.planning.kkt import SOLVED_FACTOR, Kkt, residuals
from sgnlp.planning.problem import Problem
from sgnlp.planning.starts import Start, initial
from sgnlp.planning.violations import Violation, violations
from sgnlp.planning.warm_start import handed_over
from sgnlp.program.compiled import program
from sgnlp.program.nlp import ENERGY_UNIT
from sgnlp.program.oracle import Functions, Oracle, join

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Course:
    """The points that Ipopt went through from a start, T of them: the first of each formulation and every iterate."""

    formulation: NDArray[np.str_]  # (T,)
    energy: Array  # (T,) smoothed, of the terms that the formulation has
    primal: Array  # (T,) largest violation of a scaled row
    dual: Array  # (T,) largest entry of the Lagrangian's gradient, as Ipopt scales it
    barrier: Array  # (T,) μ


@dataclass(frozen=True, eq=False)
class Iterate:
    """What a solver returns for one start, in the scaled variables of its last formulation.

    x (nx), parameters p, and the residuals of the optimality conditions that we recomputed there; `status` is the
    solver's word, never believed, and so is the `course`.
    """

    start: int
    formulation: str
    x: Array
    p: Array
    objective: float
    kkt: Kkt
    status: str
    iterations: int
    seconds: float
    course: Course
    violations: tuple[Violation, ...] = ()


def options(solver: Solver, iterations: int) -> dict[str, Any]:
    """Ipopt's options, in CasADi's names."""
    return {
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": solver.tolerance,
        "ipopt.max_iter": iterations,
        "ipopt.mu_strategy": solver.mu_strategy,
        "ipopt.mu_init": solver.mu_init,
        "ipopt.barrier_tol_factor": solver.barrier_tolerance,
        "ipopt.linear_solver": solver.linear_solver,
        "ipopt.mumps_scaling": 0,  # the variables and rows are scaled; MUMPS's own costs a quarter of an iteration
        "ipopt.mumps_permuting_scaling": 0,
        "print_time": False,
        "no_nlp_grad": True,
        "calc_lam_p": False,
    }


def schedule(solver: Solver) -> list[tuple[str, int]]:
    """The formulations to solve in order, each with its iterations at most."""
    second = {"two_phase": "constrained", "elastic": "elastic"}.get(solver.formulation)
    if second:
        return [("penalty", solver.penalty_iterations), (second, solver.max_iterations)]
    return [(solver.formulation, solver.max_iterations)]


def nlp_solver(oracle: Functions, solver: Solver, iterations: int, **more: Any) -> ca.Function:
    """CasADi's Ipopt over the oracle's own derivatives; more options take precedence."""
    x, p = ca.MX.sym("x", oracle.objective.size1_in(0)), ca.MX.sym("p", oracle.objective.size1_in(1))
    problem = {"x": x, "p": p, "f": oracle.objective(x, p), "g": oracle.rows(x, p)}
    derivatives = {"grad_f": oracle.gradient, "jac_g": oracle.jacobian, "hess_lag": oracle.hessian}
    return ca.nlpsol("ipopt", "ipopt", problem, options(solver, iterations) | derivatives | more)


@dataclass(frozen=True)
class Phase:
    """One formulation of the problem with its solver."""

    oracle: Oracle
    solver: ca.Function


class Planner:
    """Ipopt over one problem, in the formulation of its settings; `phases` are run in order."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self.phases = [
            self._phase(formulation, iterations) for formulation, iterations in schedule(problem.settings.solver)
        ]

    def _phase(self, formulation: str, iterations: int) -> Phase:
        problem, solver = self.problem, self.problem.settings.solver
        nlp = program(problem.hand, problem.structure(formulation), solver.compiled)
        oracle = join(nlp, problem.gpis, solver.compiled)
        return Phase(oracle, nlp_solver(oracle, solver, iterations))

    def solve(self, start: Start) -> Iterate:
        """Run the phases from a start, each from where the one before it ended."""
        begin, iterations, legs = time.perf_counter(), 0, []
        x = initial(self.phases[0].oracle.nlp, start)
        for phase in self.phases:
            nlp = phase.oracle.nlp
            p = self.problem.parameters(nlp, start.wrist, start.joints)
            x_bounds = self.problem.variable_bounds(nlp, start.joints)
            g_bounds = self.problem.row_bounds(nlp)
            rows = partial(phase.oracle.values, p=p)
            x = handed_over(phase.oracle, x, p, g_bounds)
            bounds = dict(zip(("lbx", "ubx", "lbg", "ubg"), (*x_bounds, *g_bounds), strict=True))
            result = phase.solver(x0=np.clip(x, *x_bounds), p=p, **bounds)
            x = np.array(result["x"]).ravel()
            stats = phase.solver.stats()
            iterations += int(stats["iter_count"])
            legs.append(_leg(nlp.structure.formulation, stats["iterations"]))
        multipliers = np.array(result["lam_x"]).ravel(), np.array(result["lam_g"]).ravel()
        return Iterate(
            start=start.index,
            formulation=nlp.structure.formulation,
            x=x,
            p=p,
            objective=float(result["f"]),
            kkt=residuals(phase.oracle, x, p, multipliers, x_bounds, g_bounds, (*nlp.variable_names, *nlp.row_names)),
            status=str(stats["return_status"]),
            iterations=iterations,
            seconds=time.perf_counter() - begin,
            course=Course(*(np.concatenate(column) for column in zip(*legs, strict=True))),
            violations=violations(nlp, rows, x, g_bounds, SOLVED_FACTOR * self.problem.settings.solver.tolerance),
        )


def _leg(formulation: str, told: dict[str, list[float]]) -> tuple[NDArray[Any], ...]:
    """The columns of `Course` for one formulation, from what CasADi's interface kept of the iterates."""
    energy, primal, dual, barrier = (np.array(told[name]) for name in ("obj", "inf_pr", "inf_du", "mu"))
    return np.full(len(energy), formulation), ENERGY_UNIT * energy, primal, dual, barrier
