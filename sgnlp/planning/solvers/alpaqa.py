"""alpaqa (Pas et al. 2022): a proximal augmented Lagrangian method on PANOC."""

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin


def options(task: Task) -> Options:
    """The options for a task."""
    outer = {"alm.tolerance": task.tolerance, "alm.dual_tolerance": task.tolerance, "alm.print_interval": 0}
    return {"alpaqa": outer | {"panoc.max_iter": task.iterations}}


METHODS = (
    Method(
        name="alpaqa",
        kind="augmented Lagrangian",
        derivatives=1,
        summary="alpaqa, augmented Lagrangian on PANOC",
        known="asks for derivatives of the Jacobian, which a plan's functions do not have",
        prepare=plugin("alpaqa", options),
    ),
)
