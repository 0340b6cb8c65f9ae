"""CasADi's lifted SQP (Albersmeyer & Diehl 2010)."""

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin
from sgnlp.planning.solvers.sqpmethod import STALLS, qpsol, stop


def options(task: Task) -> Options:
    """The options for a task."""
    return stop(task) | qpsol("qrqp") | {"print_header": False}


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
