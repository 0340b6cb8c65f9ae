"""Solvers that are called through CasADi, and their statistics."""

from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.solver import Answer, NlpInstance, Solver
from sgnlp.program.oracle import Functions

CALLS = {"objective": "f", "gradient": "grad", "rows": "g", "jacobian": "jac", "hessian": "hess"}
"""The functions, and the names under which their calls are counted."""
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
"""CasADi's names of the functions that a solver calls; the last is a Hessian product, computed from the Hessian."""
SAID = ("unified_return_status", "return_status")
"""Keys of a solver's statistics with its status; the last one that is present counts."""
TIMES = "t_wall_nlp_"
"""Prefix of the functions' times in the statistics."""

_built: WeakKeyDictionary[Functions, dict[tuple[Any, ...], ca.Function]] = WeakKeyDictionary()


@dataclass(frozen=True)
class CasadiSolver(Solver):
    """A solver of CasADi. It is built once for the same functions, so that a process solves many starts with it."""

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Solve with exact derivatives."""
        return called(self._nlpsol(nlp), nlp, x)

    def prepare(self, nlp: NlpInstance) -> None:
        """Build CasADi's solver."""
        self._nlpsol(nlp)

    def build(self, nlp: NlpInstance) -> ca.Function:
        """CasADi's solver. It depends only on the program's functions, tolerance and iteration limit."""
        raise NotImplementedError

    def _nlpsol(self, nlp: NlpInstance, anew: bool = False) -> ca.Function:
        known, key = _built.setdefault(nlp.functions, {}), (self, nlp.tolerance, nlp.iterations)
        if anew or key not in known:
            known[key] = self.build(nlp)
        return known[key]


def called(solver: ca.Function, nlp: NlpInstance, x: Array) -> Answer:
    """The answer of a solver of CasADi from x (nx,)."""
    bounds = dict(zip(("lbx", "ubx", "lbg", "ubg"), (*nlp.x_bounds, *nlp.g_bounds), strict=True))
    if nlp.multipliers is not None:
        bounds |= dict(zip(("lam_x0", "lam_g0"), nlp.multipliers, strict=True))
    result, stats = solver(x0=x, p=nlp.p, **bounds), solver.stats()
    words = [str(stats[key]) for key in SAID if stats.get(key)]
    return Answer(
        x=np.array(result["x"]).ravel(),
        status=words[-1] if words else str(stats.get("success", "")),
        iterations=int(stats.get("iter_count", -1)),
        calls=calls(stats),
        seconds=sum(float(value) for name, value in stats.items() if name.startswith(TIMES)),
        multipliers=(np.array(result["lam_x"]).ravel(), np.array(result["lam_g"]).ravel()),
        way=stats.get("iterations", {}),
    )


def calls(stats: dict[str, Any]) -> dict[str, int]:
    """Number of a solver's calls of each function; CasADi's functions may share work."""
    counts = dict.fromkeys(CALLS.values(), 0)
    for name, parts in ASKED.items():
        for part in parts:
            counts[part] += int(stats.get(f"n_call_{name}", 0))
    return counts
