"""SciPy's trust-constr (Byrd, Hribar & Nocedal 1999): a trust-region interior point method with exact Hessians."""

from dataclasses import dataclass
from importlib import import_module

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.scipy_call import ScipySolver, minimise
from sgnlp.planning.solvers.solver import Answer, Entry, NlpInstance


@dataclass(frozen=True)
class TrustConstr(ScipySolver):
    """The rows are one vector constraint; f and its Hessian are separate from them, as SciPy requires."""

    name = "trust-constr"

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Solve with the exact Hessian of the Lagrangian."""
        zero = np.zeros(len(nlp.g_bounds[0]))

        def bent(x: Array, lam: Array) -> Array:
            return nlp.hessian(x, 0.0, lam)

        constraint = import_module("scipy.optimize").NonlinearConstraint
        rows = constraint(nlp.rows, *nlp.g_bounds, jac=nlp.jacobian, hess=bent)
        stop = {"gtol": nlp.tolerance, "xtol": nlp.tolerance**2, "barrier_tol": nlp.tolerance}
        result = minimise(
            nlp,
            "trust-constr",
            nlp.objective,
            x,
            nlp.gradient,
            hess=lambda x: nlp.hessian(x, 1.0, zero),
            constraints=[rows] if len(zero) else [],
            options=stop | {"maxiter": nlp.iterations},
        )
        multipliers = np.asarray(result.v[-1]), np.asarray(result.v[0]) if len(zero) else zero
        return Answer(np.asarray(result.x), str(result.message), int(result.nit), multipliers)


ENTRIES = (Entry(TrustConstr(), "interior point", 2, "SciPy's trust-constr, exact Hessian"),)
