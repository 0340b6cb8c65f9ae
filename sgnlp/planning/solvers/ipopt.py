"""Ipopt (Wächter & Biegler 2006) on the exact derivatives of a program."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import casadi as ca

from sgnlp.base import settings
from sgnlp.base.checked import require_fields
from sgnlp.base.errors import InputError
from sgnlp.planning.solvers import kkt_factors
from sgnlp.planning.solvers.casadi_call import CasadiSolver
from sgnlp.planning.solvers.solver import Entry, NlpInstance

HESSIANS = Literal["exact", "limited-memory"]
CONDENSED = "condensed"
"""Ours of the linear solvers, the default; where it cannot be compiled, MUMPS takes its place."""
UNSCALED = {"ipopt.mumps_scaling": 0, "ipopt.mumps_permuting_scaling": 0}
"""Variables and rows are scaled already; MUMPS's own scaling costs a quarter of an iteration."""
OF_SETTINGS = ("tolerance", "linear_solver", "mu_strategy", "mu_init", "barrier_tolerance", "expect_infeasible")
"""Options that are also settings."""
WARM_MU = 1e-4
"""Barrier parameter of a warm start (a cold start goes from 0.1 to 1e-7). Slacks are pushed from their bounds no
farther than this barrier moves them."""
WARM = {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": WARM_MU,
    "ipopt.warm_start_bound_push": WARM_MU,
    "ipopt.warm_start_bound_frac": WARM_MU,
    "ipopt.warm_start_slack_bound_push": WARM_MU,
    "ipopt.warm_start_slack_bound_frac": WARM_MU,
    "ipopt.warm_start_mult_bound_push": WARM_MU,
}


@dataclass(frozen=True)
class Ipopt(CasadiSolver):
    """Ipopt (Wächter & Biegler 2006) with the exact Hessian, or a limited-memory one for comparison.

    Options that are None come from the settings.
    """

    hessian: HESSIANS = "exact"
    linear_solver: str | None = None
    mu_strategy: str | None = None
    mu_init: float | None = None
    barrier_tolerance: float | None = None
    expect_infeasible: bool | None = None
    warm_start: bool = field(default=False, repr=False)
    """begin with the given multipliers and a small barrier parameter"""

    def __post_init__(self) -> None:
        """Raise `InputError` naming the first option whose value is not valid."""
        require_fields(self, "Ipopt", ("warm_start",))
        if not isinstance(self.hessian, str) or self.hessian not in get_args(HESSIANS):
            raise InputError(f"the Hessian of Ipopt is one of {', '.join(get_args(HESSIANS))}, not {self.hessian!r}")
        given = {name: getattr(self, name) for name in OF_SETTINGS if getattr(self, name) is not None}
        replace(settings.Solver(), **given)

    @property
    def name(self) -> str:
        """Its name, with Hessian and linear solver if they are not the default ones."""
        limited = "-limited" if self.hessian == "limited-memory" else ""
        return "ipopt" + limited + ("" if self.linear_solver in (None, CONDENSED) else f"-{self.linear_solver}")

    def backends(self) -> dict[str, str]:
        """Of condensed linear systems, whether they are solved in compiled C, or by MUMPS and why."""
        if self.linear_solver not in (None, CONDENSED):
            return {}
        return {"linear_systems": f"MUMPS ({fault})" if (fault := kkt_factors.LIBRARY.fault()) else "compiled C"}

    def settled(self, chosen: settings.Solver) -> "Ipopt":
        """Ipopt with the options that it leaves open taken from the settings."""
        missing = {name: getattr(chosen, name) for name in OF_SETTINGS if getattr(self, name) is None}
        return replace(self, **missing)

    @property
    def warm(self) -> "Ipopt":
        """Ipopt with its options for a warm start."""
        return replace(self, warm_start=True)

    def build(self, nlp: NlpInstance) -> ca.Function:
        """CasADi's Ipopt over the oracle's own derivatives."""
        functions = nlp.functions
        x, p = ca.MX.sym("x", functions.objective.size1_in(0)), ca.MX.sym("p", functions.objective.size1_in(1))
        problem = {"x": x, "p": p, "f": functions.objective(x, p), "g": functions.rows(x, p)}
        derivatives = {"grad_f": functions.gradient, "jac_g": functions.jacobian, "hess_lag": functions.hessian}
        return ca.nlpsol("ipopt", "ipopt", problem, self.options(nlp) | derivatives)

    def options(self, nlp: NlpInstance) -> dict[str, Any]:
        """Its options, in CasADi's names."""
        full = self.settled(settings.Solver())
        limited = {"ipopt.hessian_approximation": "limited-memory"} if self.hessian == "limited-memory" else {}
        warm = WARM if self.warm_start else {}
        return (
            limited
            | {
                "ipopt.print_level": 0,
                "ipopt.sb": "yes",
                "ipopt.tol": nlp.tolerance,
                "ipopt.max_iter": nlp.iterations,
                "ipopt.mu_strategy": full.mu_strategy,
                "ipopt.mu_init": full.mu_init,
                "ipopt.barrier_tol_factor": full.barrier_tolerance,
                "ipopt.expect_infeasible_problem": "yes" if full.expect_infeasible else "no",
                "print_time": False,
                "no_nlp_grad": True,
                "calc_lam_p": False,
            }
            | _linear(full.linear_solver or CONDENSED)
            | warm
        )


def _linear(name: str) -> dict[str, Any]:
    """The options of a linear solver."""
    ours = kkt_factors.options() if name == CONDENSED else {}
    return ours or {"ipopt.linear_solver": "mumps" if name == CONDENSED else name} | UNSCALED


SLOWER = "takes the same steps, but for rounding, in more time"

ENTRIES = (
    Entry(Ipopt(), "interior point", 2, "Ipopt, exact Hessian, condensed systems; the default"),
    Entry(Ipopt(hessian="limited-memory"), "interior point", 1, "Ipopt, limited-memory Hessian, condensed systems"),
    Entry(Ipopt(linear_solver="mumps"), "interior point", 2, "Ipopt, exact Hessian, MUMPS", SLOWER),
    Entry(Ipopt(linear_solver="spral"), "interior point", 2, "Ipopt, exact Hessian, SPRAL", SLOWER),
    Entry(
        Ipopt(hessian="limited-memory", linear_solver="spral"),
        "interior point",
        1,
        "Ipopt, limited-memory Hessian, SPRAL",
        SLOWER,
    ),
)
