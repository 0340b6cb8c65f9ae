"""CasADi's SQP on its own sparse QR."""

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin
from sgnlp.planning.solvers.sqpmethod import QP, STALLS, stop


def options(task: Task) -> Options:
    """The options for a task."""
    quiet = {"print_header": False, "print_iteration": False, "qpsol_options": QP["qrqp"] | {"error_on_fail": False}}
    return stop(task) | quiet | {"regularize": True}


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
