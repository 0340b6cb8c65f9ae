"""CasADi's lifted SQP (Albersmeyer & Diehl 2010)."""

from sgnlp.solvers.anatomy import Method, Task
from sgnlp.solvers.plugins import Options, plugin
from sgnlp.solvers.sqpmethod import QP, STALLS


def options(task: Task) -> Options:
    """The options for a task."""
    stop = {"tol_du": task.tolerance, "tol_pr": task.tolerance, "max_iter": task.iterations}
    qpsol = {"qpsol": "qrqp", "qpsol_options": QP["qrqp"] | {"error_on_fail": False}}
    return stop | qpsol | {"print_header": False}


METHODS = (
    Method(
        name="scpgen",
        kind="SQP",
        derivatives=2,
        summary="CasADi's scpgen, exact Hessian, qrqp",
        known=STALLS,
        prepare=plugin("scpgen", options),
    ),
)
