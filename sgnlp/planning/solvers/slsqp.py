"""SciPy's SLSQP (Kraft 1988): dense BFGS, with a least-squares subproblem in each step."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.scipy_call import ScipySolver, minimise
from sgnlp.planning.solvers.solver import Answer, Entry, NlpInstance


@dataclass(frozen=True)
class Slsqp(ScipySolver):
    """It stops by the change of f, so it gets the square of the tolerance: f is flat at a minimum."""

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Solve with equality and one-sided rows."""
        options = {"maxiter": nlp.iterations, "ftol": nlp.tolerance**2}
        rows = one_sided(nlp)
        result = minimise(nlp, "SLSQP", nlp.objective, x, nlp.gradient, constraints=rows, options=options)
        return Answer(np.asarray(result.x), str(result.message), int(result.nit))


def one_sided(nlp: NlpInstance) -> list[dict[str, object]]:
    """The rows as g = 0 and g ≥ 0, the form of SLSQP."""
    low, high = nlp.g_bounds
    equal = np.flatnonzero(low == high)
    below, above = (np.flatnonzero(np.isfinite(side) & (low < high)) for side in (low, high))

    def part(kind: str, index: NDArray[np.intp], sign: float, side: Array) -> dict[str, object]:
        return {
            "type": kind,
            "fun": lambda x: sign * (nlp.rows(x)[index] - side[index]),
            "jac": lambda x: sign * nlp.jacobian(x)[index],
        }

    parts = [part("eq", equal, 1.0, low), part("ineq", below, 1.0, low), part("ineq", above, -1.0, high)]
    return [constraint for constraint, index in zip(parts, (equal, below, above), strict=True) if len(index)]


ENTRIES = (Entry(Slsqp(), "SQP", 1, "SciPy's SLSQP, dense BFGS"),)
