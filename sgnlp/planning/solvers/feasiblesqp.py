"""CasADi's feasible SQP with a trust region (Kiessling et al. 2022)."""

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin
from sgnlp.planning.solvers.sqpmethod import QP, SILENT


def options(task: Task) -> Options:
    """The options for a task."""
    qpsol = {"qpsol": "qrqp", "qpsol_options": QP["qrqp"] | {"error_on_fail": False}}
    stop = {"optim_tol": task.tolerance, "feas_tol": task.tolerance, "max_iter": task.iterations}
    return SILENT | qpsol | stop | {"convexify_strategy": "regularize"}


METHODS = (
    Method(
        name="feasiblesqp",
        kind="SQP",
        derivatives=2,
        summary="CasADi's feasiblesqpmethod, regularised exact Hessian, qrqp",
        known="asks for a feasible start, which a plan's constraints do not have",
        prepare=plugin("feasiblesqpmethod", options),
    ),
)
