"""SciPy's trust-constr (Byrd, Hribar & Nocedal 1999): a trust-region interior point method with exact Hessians."""

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint

from sgnlp.planning.solvers.anatomy import Answer, Method, Solve, Task
from sgnlp.planning.solvers.scipy_oracle import Array, Numpy, minimise


def prepare(task: Task) -> Solve:
    """The rows are one vector constraint; f and its Hessian apart from theirs, as SciPy asks."""
    problem, zero = Numpy(task), np.zeros(len(task.g_bounds[0]))

    def bent(x: Array, lam: Array) -> Array:
        return problem.hessian(x, 0.0, lam)

    constraints = [
        NonlinearConstraint(
            problem.rows,
            *task.g_bounds,
            jac=problem.jacobian,
            hess=bent,  # type: ignore[arg-type]
        )
    ]
    stop = {"gtol": task.tolerance, "xtol": task.tolerance**2, "barrier_tol": task.tolerance}
    options = stop | {"maxiter": task.iterations}

    def solve(x0: Array) -> Answer:
        result = minimise(
            problem.objective,
            x0,
            jac=problem.gradient,
            hess=lambda x: problem.hessian(x, 1.0, zero),
            bounds=Bounds(*task.x_bounds),
            constraints=constraints if len(zero) else [],
            method="trust-constr",
            options=options,
        )
        multipliers = np.asarray(result.v[-1]), np.asarray(result.v[0]) if len(zero) else zero
        return Answer(np.asarray(result.x), str(result.message), int(result.nit), multipliers)

    return solve


METHODS = (
    Method(
        name="trust-constr",
        kind="interior point",
        derivatives=2,
        summary="SciPy's trust-constr, exact Hessian",
        prepare=prepare,
    ),
)
