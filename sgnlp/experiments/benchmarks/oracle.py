"""One call of f, ∇f, g, J and H, as Ipopt makes it: on raw memory, without conversions from NumPy."""

from collections.abc import Callable, Iterator
from itertools import cycle

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.experiments.benchmarks.bench import Bench
from sgnlp.experiments.benchmarks.measure import Row, timing, warm_times
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.starts import starts
from sgnlp.program.oracle import Oracle

Array = NDArray[np.float64]

STEP = 1e-3
"""How far a new x lies from the one before it, in the scaled variables."""


def rows(bench: Bench) -> Iterator[Row]:
    """Times of each function at a new x, where the surface is evaluated first, and at the same x again."""
    problem = bench.problems[0]
    joined, x, p = scene(problem, bench.seed)
    size = f"{joined.nlp.structure.formulation.name}, N = {len(problem.gpis.X)}"
    calls = functions(joined)
    for name, function in calls.items():
        for place in ("new", "same"):
            times = warm_times(call(function, x, p, moving=place == "new"), bench.repeats)
            yield timing(f"{name}, {place} x", "ms", times, size)
    every = [call(function, x, p, moving=True) for function in calls.values()]
    times = warm_times(lambda: [one() for one in every], bench.repeats)
    yield timing("f, ∇f, g, J, H, new x", "ms", times, f"{size}; all five, the surface evaluated once")


def functions(joined: Oracle) -> dict[str, ca.Function]:
    """The functions by their names in the field."""
    return {
        "f": joined.objective,
        "∇f": joined.gradient,
        "g": joined.rows,
        "J": joined.jacobian,
        "H": joined.hessian,
    }


def scene(problem: Problem, seed: int) -> tuple[Oracle, Array, Array]:
    """The oracle of the last phase, the first start's scaled variables x within their bounds, and parameters p."""
    planner, (start,) = Planner(problem), starts(problem, 1, seed)
    instance, x = planner.begin(planner.stages[-1], start)
    return planner.stages[-1].oracle, x, instance.p


def call(function: ca.Function, x: Array, p: Array, moving: bool) -> Callable[[], object]:
    """A call of f(x, p, multipliers of 1…) into buffers; `moving`, each goes to a new x."""
    buffer, evaluate = function.buffer()
    x = x.copy()
    sizes = [function.numel_in(i) for i in range(2, function.n_in())]
    arguments = [x, p.copy(), *map(np.ones, sizes)]
    results = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
    for i, argument in enumerate(arguments):
        buffer.set_arg(i, argument.data)
    for i, result in enumerate(results):
        buffer.set_res(i, result.data)
    steps = cycle([STEP, -STEP]) if moving else cycle([0.0])

    def once(kept: object = (buffer, arguments, results)) -> None:  # the buffer does not keep the memory alive
        x[0] += next(steps)
        evaluate()

    return once
