"""Uno (Vanaret & Leyffer 2024): one frame for several methods, here its presets."""

from collections.abc import Callable

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin


def options(preset: str) -> Callable[[Task], Options]:
    """The options for a task with one of Uno's presets."""

    def of(task: Task) -> Options:
        stop = {"tolerance": str(task.tolerance), "max_iterations": str(task.iterations)}
        return {"uno": stop | {"preset": preset, "logger": "SILENT"}}

    return of


METHODS = tuple(
    Method(
        name=f"uno-{preset}",
        kind=kind,
        derivatives=2,
        summary=f"Uno as {preset}: {kind}, exact Hessian",
        prepare=plugin("uno", options(preset)),
        known="gets to 1e-3 in 3 s on one in 42 of a plan's problems" if preset == "filterslp" else "",
    )
    for preset, kind in (("ipopt", "interior point"), ("filtersqp", "SQP"), ("filterslp", "SLP"))
)
