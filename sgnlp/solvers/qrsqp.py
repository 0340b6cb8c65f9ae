"""CasADi's SQP on its own sparse QR."""

from sgnlp.solvers.anatomy import Method, Task
from sgnlp.solvers.plugins import Options, plugin
from sgnlp.solvers.sqpmethod import QP, STALLS


def options(task: Task) -> Options:
    """The options for a task."""
    stop = {"tol_du": task.tolerance, "tol_pr": task.tolerance, "max_iter": task.iterations}
    quiet = {"print_header": False, "print_iteration": False, "qpsol_options": QP["qrqp"] | {"error_on_fail": False}}
    return stop | quiet | {"regularize": True}


METHODS = (
    Method(
        name="qrsqp",
        kind="SQP",
        derivatives=2,
        summary="CasADi's qrsqp, regularised exact Hessian",
        known=STALLS,
        prepare=plugin("qrsqp", options),
    ),
)
