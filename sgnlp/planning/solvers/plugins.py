"""Solvers that CasADi loads as plugins, all called alike."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from sgnlp.planning.solvers.anatomy import Answer, Array, Refusal, Solve, Task
from sgnlp.planning.solvers.bridge import differentiable
from sgnlp.planning.solvers.meter import CALLS

Options = dict[str, Any]
COMMON: Options = {"print_time": False, "calc_lam_p": False, "error_on_fail": False}
ASKED = {
    "nlp_f": ("f",),
    "nlp_g": ("g",),
    "nlp_fg": ("f", "g"),
    "nlp_grad_f": ("grad",),
    "nlp_grad_l": ("grad", "jac"),
    "nlp_jac_g": ("jac",),
    "nlp_jac_fg": ("grad", "jac"),
    "nlp_hess_l": ("hess",),
    "fwd1_nlp_grad_l": ("hess",),
}
"""CasADi's names of what a plugin asks for; the last is a product with a Hessian, for which it is worked out."""
SAID = ("unified_return_status", "return_status")
"""Where a plugin's statistics tell how it ended; the last that says something counts."""


def plugin(name: str, options: Callable[[Task], Options]) -> Callable[[Task], Solve]:
    """The `prepare` of a nonlinear solver of CasADi, with its options for a task."""

    def prepare(task: Task) -> Solve:
        if not ca.has_nlpsol(name):
            raise Refusal(f"casadi {ca.__version__} has no plugin '{name}' here")
        return called(ca.nlpsol("solver", name, differentiable(task.functions), COMMON | options(task)), task)

    return prepare


def calls(stats: Options) -> dict[str, int]:
    """How often a solver asked for each function; several of them share what they are made of."""
    counts = dict.fromkeys(CALLS.values(), 0)
    for name, parts in ASKED.items():
        for part in parts:
            counts[part] += int(stats.get(f"n_call_{name}", 0))
    return counts


def called(solver: ca.Function, task: Task) -> Solve:
    """A solve of a task by a solver of CasADi."""
    bounds = dict(zip(("lbx", "ubx", "lbg", "ubg"), (*task.x_bounds, *task.g_bounds), strict=True))

    def solve(x0: Array) -> Answer:
        result, stats = solver(x0=x0, p=task.p, **bounds), solver.stats()
        words = [str(stats[key]) for key in SAID if stats.get(key)]
        return Answer(
            x=np.array(result["x"]).ravel(),
            status=words[-1] if words else str(stats.get("success", "")),
            iterations=int(stats.get("iter_count", -1)),
            calls=calls(stats),
            multipliers=(np.array(result["lam_x"]).ravel(), np.array(result["lam_g"]).ravel()),
        )

    return solve
