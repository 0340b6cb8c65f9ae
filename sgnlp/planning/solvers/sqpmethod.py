"""CasADi's SQP with a line search, on each QP solver of the wheel."""

from collections.abc import Callable

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin

SILENT: Options = {"print_header": False, "print_iteration": False, "print_status": False}
QP: dict[str, Options] = {
    "qrqp": {"print_iter": False, "print_header": False},
    "proxqp": {},
    "osqp": {"osqp.verbose": False},
    "piqp": {},
    "daqp": {},
    "qpoases": {"printLevel": "none"},
}
"""The QP solvers with what makes each of them quiet."""


def stop(task: Task) -> Options:
    """When CasADi's SQP methods end."""
    return {"tol_du": task.tolerance, "tol_pr": task.tolerance, "max_iter": task.iterations}


def qpsol(qp: str) -> Options:
    """Their QP solver, which says nothing and whose failure is theirs to handle."""
    return {"qpsol": qp, "qpsol_options": QP[qp] | {"error_on_fail": False}}


def options(qp: str, more: Options) -> Callable[[Task], Options]:
    """The options for a task; without a convex Hessian none of the QP solvers gives a descent."""

    return lambda task: SILENT | qpsol(qp) | stop(task) | more


SHOWN = "daqp"
"""The QP solver that stands for all where nothing is said: the steps of the others are the same."""
STALLS = "does not get to 1e-3 in 3 s on a plan's problems"

CONVEX: Options = {"convexify_strategy": "regularize"}
LIMITED: Options = {"hessian_approximation": "limited-memory"}

METHODS = (
    *(
        Method(
            name=f"sqp-{qp}",
            kind="SQP",
            derivatives=2,
            summary=f"CasADi's sqpmethod, regularised exact Hessian, {qp}",
            prepare=plugin("sqpmethod", options(qp, CONVEX)),
            known="" if qp == SHOWN else STALLS,
        )
        for qp in QP
    ),
    Method(
        name="sqp-limited",
        kind="SQP",
        derivatives=1,
        summary="CasADi's sqpmethod, limited-memory BFGS, qrqp",
        prepare=plugin("sqpmethod", options("qrqp", LIMITED)),
        known=STALLS,
    ),
)
