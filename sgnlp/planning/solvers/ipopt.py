"""Ipopt (Wächter & Biegler 2006) with exact and limited-memory Hessians, on MUMPS and on SPRAL."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from sgnlp.base.settings import Solver
from sgnlp.planning.ipopt import nlp_solver
from sgnlp.planning.solvers.anatomy import Method, Solve, Task
from sgnlp.planning.solvers.plugins import called

LIMITED = {"ipopt.hessian_approximation": "limited-memory"}
"""Ipopt's option that leaves the Hessian alone."""


def _prepare(linear_solver: Any, more: dict[str, Any]) -> Callable[[Task], Solve]:
    settings = replace(Solver(), linear_solver=linear_solver)

    def prepare(task: Task) -> Solve:
        solver = replace(settings, tolerance=task.tolerance)
        return called(nlp_solver(task.functions, solver, task.iterations, **more), task)

    return prepare


METHODS = tuple(
    Method(
        name="ipopt" + ("" if order == 2 else "-limited") + ("" if linear == "mumps" else f"-{linear}"),
        kind="interior point",
        derivatives=order,
        summary=f"Ipopt, {hessian} Hessian, {linear.upper()}, as sgnlp solve has it",
        prepare=_prepare(linear, more),
        known="" if linear == "mumps" else "the steps of the same on MUMPS, twice as slow",
    )
    for linear in ("mumps", "spral")
    for order, hessian, more in ((2, "exact", {}), (1, "limited-memory", LIMITED))
)
