"""One call of f, ∇f, g, J and H, as by Ipopt, and its jets of the surface against the machine's peak speed."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import cycle

import casadi as ca
import numpy as np
from threadpoolctl import threadpool_limits

from sgnlp.base.arrays import Array
from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, spread, timing, warm_times
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.starts import starts
from sgnlp.program.oracle import Oracle
from sgnlp.surface.gpis import MEAN_JET, VARIANCE_JET
from sgnlp.surface.native import NumpyJets, raw_jets

FUNCTIONS = {"f": "objective", "∇f": "gradient", "g": "rows", "J": "jacobian", "H": "hessian"}
"""The names of the field for those of an oracle."""
STEP = 1e-3  # how far a new x lies from the one before it, in the scaled variables
FLOPS = {"values": (1, 25), "derivatives": (4, 70)}
"""Flops of a variance over N², and of a mean over N.

A trial point of a line search needs values: N² flops for each of the V variances and 25 N for each of the Q means. An
accepted point needs the derivatives too: another 4 N² and 70 N. These flops are counted, whatever the code executes.
"""
SQUARE = 1000  # rows of the matrices whose product gives the peak


def rows(bench: Bench) -> Iterator[Row]:
    """Times of each function at a new x, including the evaluation of the surface, and at the same x again."""
    problem = bench.problems[0]
    joined, x, p = scene(problem, bench.seed)
    size = f"{joined.nlp.structure.formulation.name}, N = {len(problem.gpis.X)}"
    calls = {name: getattr(joined, function) for name, function in FUNCTIONS.items()}
    for name, function in calls.items():
        for place in ("new", "same"):
            times = warm_times(call(function, x, p, moving=place == "new"), bench.repeats)
            yield timing(f"{name}, {place} x", "ms", times, size)
    every = [call(function, x, p, moving=True) for function in calls.values()]
    times = warm_times(lambda: [one() for one in every], bench.repeats)
    yield timing("f, ∇f, g, J, H, new x", "ms", times, f"{size}; all five, the surface evaluated once")


def scene(problem: Problem, seed: int) -> tuple[Oracle, Array, Array]:
    """The oracle of the last phase, the first start's scaled variables x within their bounds, and parameters p."""
    planner, (start,) = Planner(problem), starts(problem, 1, seed)
    instance, x = planner.begin(planner.stages[-1], start)
    return planner.stages[-1].oracle, x, instance.p


def call(function: ca.Function, x: Array, p: Array, moving: bool) -> Callable[[], object]:
    """A call of f(x, p, multipliers of 1…) into raw memory, as Ipopt's are; `moving`, each goes to a new x."""
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


def surface(bench: Bench) -> Iterator[Row]:
    """Times and GFLOP/s of all jets that one new x needs, in C and in NumPy, and of a matrix product."""
    problem = bench.problems[0]
    joined, x, p = scene(problem, bench.seed)
    layout, N = joined.nlp.layout, len(problem.gpis.X)
    Q, V = layout.points, layout.uncertain
    given = np.array(joined.nlp.points(x, p)[0])
    Z = np.asfortranarray(np.concatenate([given, given[: Q - len(given)]]))  # the feet lie next to the contacts
    arrays = Z, np.zeros((Q, MEAN_JET)), np.zeros((V, VARIANCE_JET))
    A = np.random.default_rng(0).normal(size=(SQUARE, SQUARE))
    with threadpool_limits(1):
        products = rates(2 * SQUARE**3, warm_times(lambda: A @ A, bench.repeats))
        yield spread("peak", "GFLOP/s", products, f"NumPy, {SQUARE}² matrices, one thread")
        yield timing("jets in NumPy", "ms", warm_times(partial(NumpyJets(problem.gpis).values, *arrays), bench.repeats))
    jets = raw_jets(problem.gpis, V)
    for step, (variance, mean) in FLOPS.items() if not isinstance(jets, NumpyJets) else ():
        flops = variance * N**2 * V + mean * N * Q
        size = f"N = {N}, V = {V}, Q = {Q}; {variance} N² V + {mean} N Q = {flops / 1e6:.1f} Mflop"
        times = warm_times(partial(getattr(jets, step), *arrays), bench.repeats)
        yield timing(f"{step} in C", "ms", times, size)
        rate = rates(flops, times)
        share = f"{max(rate) / max(products):.0%} of the matrix product, best against best"
        yield spread(f"{step} in C", "GFLOP/s", rate, share)


def rates(flops: float, times: Sequence[Time]) -> list[float]:
    """Rates [GFLOP/s] of a number of flops done in the times."""
    return [flops / t.wall / 1e9 for t in times]
