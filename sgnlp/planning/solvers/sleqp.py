"""SLEQP: sequential linear programs find the active set, equality-constrained quadratic ones the step."""

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin

LEAST = 1e-6
"""The tolerance that it has by itself; with less it may never end."""


def options(task: Task) -> Options:
    """The options for a task."""
    tolerances = {f"{name}_tol": max(task.tolerance, LEAST) for name in ("feas", "slack", "stat")}
    return {"max_iter": task.iterations, "sleqp": tolerances}


METHODS = (
    Method(
        name="sleqp",
        kind="active set",
        derivatives=2,
        summary="SLEQP, products with the exact Hessian",
        prepare=plugin("sleqp", options),
    ),
)
