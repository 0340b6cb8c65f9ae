"""Solvers that CasADi loads as plugins: a row for each, with its options."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import casadi as ca

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.bridge import differentiable
from sgnlp.planning.solvers.casadi_call import CasadiSolver
from sgnlp.planning.solvers.process import silence
from sgnlp.planning.solvers.solver import Answer, Entry, NlpInstance, Refusal

Options = dict[str, Any]
COMMON: Options = {"print_time": False, "calc_lam_p": False, "error_on_fail": False}
SILENT: Options = {"print_header": False, "print_iteration": False, "print_status": False}
QP: dict[str, Options] = {
    "qrqp": {"print_iter": False, "print_header": False},
    "proxqp": {},
    "osqp": {"osqp.verbose": False},
    "piqp": {},
    "daqp": {},
    "qpoases": {"printLevel": "none"},
}
"""The QP solvers of the wheel, with the options that silence each."""
LEAST_OF_SLEQP = 1e-6
"""SLEQP's default tolerance; with a smaller one it may never end."""


def defaults(nlp: NlpInstance) -> Options:
    """The plugin's defaults."""
    return {}


@dataclass(frozen=True)
class Plugin(CasadiSolver):
    """A plugin by CasADi's name, with its options for a program."""

    name: str = ""
    plugin: str = field(default="", repr=False)
    options: Callable[[NlpInstance], Options] = field(default=defaults, repr=False)

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Solve with exact derivatives, without the output of the library."""
        with silence():
            return super().solve(nlp, x)

    def prepare(self, nlp: NlpInstance) -> None:
        """Build it anew: OSQP and qpOASES keep a state of one start that would change the steps of the next."""
        with silence():
            self._nlpsol(nlp, anew=True)

    def build(self, nlp: NlpInstance) -> ca.Function:
        """CasADi's solver, over functions with our derivatives."""
        if not ca.has_nlpsol(self.plugin):
            raise Refusal(f"casadi {ca.__version__} has no plugin '{self.plugin}' here")
        return ca.nlpsol("solver", self.plugin, differentiable(nlp.functions), COMMON | self.options(nlp))


def fatrop(nlp: NlpInstance) -> Options:
    """Fatrop solves optimal control problems: this is one with a single stage."""
    stage = {"structure_detection": "manual", "N": 0, "nx": [len(nlp.rates)], "nu": [0], "ng": [len(nlp.g_bounds[0])]}
    return stage | {"fatrop": {"tol": nlp.tolerance, "max_iter": nlp.iterations, "print_level": 0}}


def uno(nlp: NlpInstance, preset: str) -> Options:
    """Uno is one framework for several methods, which are its presets."""
    stop = {"tolerance": str(nlp.tolerance), "max_iterations": str(nlp.iterations)}
    return {"uno": stop | {"preset": preset, "logger": "SILENT"}}


def sleqp(nlp: NlpInstance) -> Options:
    """SLEQP finds the active set by linear programs and the step by equality-constrained quadratic ones."""
    tolerances = {f"{name}_tol": max(nlp.tolerance, LEAST_OF_SLEQP) for name in ("feas", "slack", "stat")}
    return {"max_iter": nlp.iterations, "sleqp": tolerances}


def alpaqa(nlp: NlpInstance) -> Options:
    """The tolerances of the outer steps, the iterations of the inner ones."""
    outer = {"alm.tolerance": nlp.tolerance, "alm.dual_tolerance": nlp.tolerance, "alm.print_interval": 0}
    return {"alpaqa": outer | {"panoc.max_iter": nlp.iterations}}


def qpsol(qp: str) -> Options:
    """Options of the QP solver of an SQP method: it is silent, and the method handles its failures."""
    return {"qpsol": qp, "qpsol_options": QP[qp] | {"error_on_fail": False}}


def stop(nlp: NlpInstance) -> Options:
    """Stopping options of CasADi's SQP methods."""
    return {"tol_du": nlp.tolerance, "tol_pr": nlp.tolerance, "max_iter": nlp.iterations}


def sqpmethod(nlp: NlpInstance, qp: str, more: Options) -> Options:
    """CasADi's sqpmethod with a regularised Hessian: without a convex one no QP solver gives a descent direction."""
    return SILENT | qpsol(qp) | stop(nlp) | more


def qrsqp(nlp: NlpInstance) -> Options:
    """CasADi's qrsqp, on its own sparse QR."""
    quiet = {"print_header": False, "print_iteration": False, "qpsol_options": qpsol("qrqp")["qpsol_options"]}
    return stop(nlp) | quiet | {"regularize": True}


def scpgen(nlp: NlpInstance) -> Options:
    """The lifted SQP (Albersmeyer & Diehl 2010)."""
    return stop(nlp) | qpsol("qrqp") | {"print_header": False}


def feasiblesqp(nlp: NlpInstance) -> Options:
    """The feasible SQP with a trust region (Kiessling et al. 2022)."""
    ends = {"optim_tol": nlp.tolerance, "feas_tol": nlp.tolerance, "max_iter": nlp.iterations}
    return SILENT | qpsol("qrqp") | ends | {"convexify_strategy": "regularize"}


CONVEX: Options = {"convexify_strategy": "regularize"}
LIMITED: Options = {"hessian_approximation": "limited-memory"}
SHOWN = "daqp"
"""The QP solver for methods that name none: the others give the same steps."""
STALLS = "does not get to 1e-3 in 3 s on a plan's problems"
RARE = "gets to 1e-3 in 3 s on one in 42 of a plan's problems"
INFEASIBLE = "needs a feasible start, which a plan does not have"
NO_DERIVATIVE = "needs derivatives of the Jacobian, which a plan's functions do not have"


def _row(name: str, plugin: str, options: Callable[..., Options], *about: Any, **fixed: Any) -> Entry:
    return Entry(Plugin(name=name, plugin=plugin, options=partial(options, **fixed) if fixed else options), *about)


ENTRIES = (
    _row("fatrop", "fatrop", fatrop, "interior point", 2, "Fatrop, exact Hessian, one stage"),
    _row("uno-ipopt", "uno", uno, "interior point", 2, "Uno's preset ipopt, exact Hessian", preset="ipopt"),
    _row("uno-filtersqp", "uno", uno, "SQP", 2, "Uno's preset filtersqp, exact Hessian", preset="filtersqp"),
    _row("uno-filterslp", "uno", uno, "SLP", 2, "Uno's preset filterslp, exact Hessian", RARE, preset="filterslp"),
    _row("sleqp", "sleqp", sleqp, "active set", 2, "SLEQP, products with the exact Hessian"),
    _row("alpaqa", "alpaqa", alpaqa, "augmented Lagrangian", 1, "alpaqa, proximal, on PANOC", NO_DERIVATIVE),
    *(
        _row(
            f"sqp-{qp}",
            "sqpmethod",
            sqpmethod,
            "SQP",
            2,
            f"CasADi's sqpmethod, regularised exact Hessian, {qp}",
            "" if qp == SHOWN else STALLS,
            qp=qp,
            more=CONVEX,
        )
        for qp in QP
    ),
    _row(
        "sqp-limited",
        "sqpmethod",
        sqpmethod,
        "SQP",
        1,
        "CasADi's sqpmethod, limited-memory BFGS, qrqp",
        STALLS,
        qp="qrqp",
        more=LIMITED,
    ),
    _row("qrsqp", "qrsqp", qrsqp, "SQP", 2, "CasADi's qrsqp, regularised exact Hessian", STALLS),
    _row("scpgen", "scpgen", scpgen, "SQP", 2, "CasADi's scpgen, exact Hessian, qrqp", STALLS),
    _row(
        "feasiblesqp",
        "feasiblesqpmethod",
        feasiblesqp,
        "SQP",
        2,
        "CasADi's feasiblesqpmethod, regularised exact Hessian, qrqp",
        INFEASIBLE,
    ),
)
