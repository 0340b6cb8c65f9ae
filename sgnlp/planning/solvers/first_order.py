"""RMSProp and AdamW: what the paper and its release run, on the same energy and within the same bounds.

The paper names RMSProp without rates, the release runs 200 steps of AdamW with those of
`sgnlp.planning.firstorder.RATES`; both have these rates here. They know no multipliers and no rows: the answer is the
lowest point on the way that meets the rows, or the lowest of all if none does, and a task whose rows are more than
bounds on a point is refused.
"""

from collections.abc import Callable

import numpy as np

from sgnlp.planning.firstorder import OPTIMISERS, descent
from sgnlp.planning.solvers.anatomy import Answer, Array, Method, Refusal, Solve, Task

STEPS = (200, 1000)
"""The release's steps, and five times as many."""


def prepare(optimiser: str, steps: int) -> Callable[[Task], Solve]:
    """The `prepare` of an optimiser."""

    def prepared(task: Task) -> Solve:
        low, high = task.g_bounds
        if (low == high).any():
            raise Refusal("knows no equality rows")
        if not np.isfinite(task.rates).all():
            raise Refusal("has no rates for some of the variables")

        def solve(x0: Array) -> Answer:
            count = min(steps, task.iterations)
            step, bounds = OPTIMISERS[optimiser](task.rates), (task.x_bounds, task.g_bounds)
            found = descent(task.functions, step, count, x0, task.p, *bounds)
            inside = bool(np.isfinite(found.admissible))
            x, status = (found.x_admissible, "rows met") if inside else (found.x, "rows never met")
            return Answer(x, status, count, lowest=found.best)

        return solve

    return prepared


METHODS = tuple(
    Method(
        name=f"{optimiser}-{steps}",
        kind="first order",
        derivatives=1,
        summary=f"{name}, {steps} steps at the release's rates",
        prepare=prepare(optimiser, steps),
    )
    for optimiser, name in (("rmsprop", "RMSProp"), ("adamw", "AdamW"))
    for steps in STEPS
)
