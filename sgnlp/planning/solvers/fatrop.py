"""Fatrop (Vanroye et al. 2023): an interior point method for optimal control, here on one stage."""

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin


def options(task: Task) -> Options:
    """The options for a task."""
    nx, ng = len(task.rates), len(task.g_bounds[0])
    stage = {"structure_detection": "manual", "N": 0, "nx": [nx], "nu": [0], "ng": [ng]}
    return stage | {"fatrop": {"tol": task.tolerance, "max_iter": task.iterations, "print_level": 0}}


METHODS = (
    Method(
        name="fatrop",
        kind="interior point",
        derivatives=2,
        summary="Fatrop, exact Hessian, one stage",
        prepare=plugin("fatrop", options),
    ),
)
