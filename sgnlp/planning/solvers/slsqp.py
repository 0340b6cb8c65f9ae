"""SciPy's SLSQP (Kraft 1988): dense BFGS, a least-squares subproblem in each step."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds

from sgnlp.planning.solvers.anatomy import Answer, Method, Solve, Task
from sgnlp.planning.solvers.scipy_oracle import Array, Numpy, minimise


def one_sided(task: Task, problem: Numpy) -> list[dict[str, object]]:
    """The rows as g = 0 and g ≥ 0, as SLSQP has them."""
    low, high = task.g_bounds
    equal = np.flatnonzero(low == high)
    below, above = (np.flatnonzero(np.isfinite(side) & (low < high)) for side in (low, high))

    def part(kind: str, index: NDArray[np.intp], sign: float, side: Array) -> dict[str, object]:
        return {
            "type": kind,
            "fun": lambda x: sign * (problem.rows(x)[index] - side[index]),
            "jac": lambda x: sign * problem.jacobian(x)[index],
        }

    parts = [part("eq", equal, 1.0, low), part("ineq", below, 1.0, low), part("ineq", above, -1.0, high)]
    return [constraint for constraint, index in zip(parts, (equal, below, above), strict=True) if len(index)]


def prepare(task: Task) -> Solve:
    """SLSQP stops by the change of f, so that is what the tolerance is put on, squared: f is flat at a minimum."""
    problem = Numpy(task)
    constraints = one_sided(task, problem)
    options = {"maxiter": task.iterations, "ftol": task.tolerance**2}

    def solve(x0: Array) -> Answer:
        result = minimise(
            problem.objective,
            x0,
            jac=problem.gradient,
            bounds=Bounds(*task.x_bounds),
            constraints=constraints,
            method="SLSQP",
            options=options,
        )
        return Answer(np.asarray(result.x), str(result.message), int(result.nit))

    return solve


METHODS = (Method(name="slsqp", kind="SQP", derivatives=1, summary="SciPy's SLSQP, dense BFGS", prepare=prepare),)
