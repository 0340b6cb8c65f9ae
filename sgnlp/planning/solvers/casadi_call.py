"""A call of a solver that CasADi has, and what its statistics say."""

from typing import Any

import casadi as ca
import numpy as np

from sgnlp.planning.solvers.meter import CALLS
from sgnlp.planning.solvers.solver import Answer, Array, NlpInstance

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
"""CasADi's names of what a solver asks for; the last is a product with a Hessian, for which it is worked out."""
SAID = ("unified_return_status", "return_status")
"""Where a solver's statistics tell how it ended; the last that says something counts."""


def called(solver: ca.Function, nlp: NlpInstance, x: Array) -> Answer:
    """The answer of a solver of CasADi from x (nx,)."""
    bounds = dict(zip(("lbx", "ubx", "lbg", "ubg"), (*nlp.x_bounds, *nlp.g_bounds), strict=True))
    result, stats = solver(x0=x, p=nlp.p, **bounds), solver.stats()
    words = [str(stats[key]) for key in SAID if stats.get(key)]
    return Answer(
        x=np.array(result["x"]).ravel(),
        status=words[-1] if words else str(stats.get("success", "")),
        iterations=int(stats.get("iter_count", -1)),
        calls=calls(stats),
        multipliers=(np.array(result["lam_x"]).ravel(), np.array(result["lam_g"]).ravel()),
        way=stats.get("iterations", {}),
    )


def calls(stats: dict[str, Any]) -> dict[str, int]:
    """How often a solver asked for each function; several of them share what they are made of."""
    counts = dict.fromkeys(CALLS.values(), 0)
    for name, parts in ASKED.items():
        for part in parts:
            counts[part] += int(stats.get(f"n_call_{name}", 0))
    return counts
