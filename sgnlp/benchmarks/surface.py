"""The jets of the surface in C and in NumPy, against the machine's peak.

Flops are counted as 5 N² for each of the V variance jets and 75 N for each of the Q mean jets, whatever is executed.
"""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from sgnlp import native
from sgnlp.benchmarks.bench import Bench
from sgnlp.benchmarks.measure import Row, Time, spread, timing, warm_times
from sgnlp.benchmarks.oracle import scene

VARIANCE_FLOPS, MEAN_FLOPS = 5, 75
"""Flops of a variance jet over N², and of a mean jet over N."""
SQUARE = 1000
"""Rows of the matrices whose product gives the peak."""


def rows(bench: Bench) -> Iterator[Row]:
    """Times and GFLOP/s of all jets that one new x needs, and of a matrix product."""
    problem = bench.problems[0]
    joined, x, p = scene(problem, bench.seed)
    layout, N = joined.nlp.layout, len(problem.gpis.X)
    Q, V = layout.points, layout.uncertain
    given = np.array(joined.nlp.points(x, p)[0])
    Z = np.concatenate([given, given[: Q - len(given)]])  # the feet lie next to the contacts
    flops = VARIANCE_FLOPS * N**2 * V + MEAN_FLOPS * N * Q
    size = f"N = {N}, V = {V}, Q = {Q}; {VARIANCE_FLOPS} N² V + {MEAN_FLOPS} N Q = {flops / 1e6:.1f} Mflop"
    peak = _dgemm(bench.repeats)
    yield peak
    library = native.library()
    kinds = {"NumPy": problem.gpis.jets} | ({"C": native.NativeJets(library, problem.gpis)} if library else {})
    for kind, jets in kinds.items():
        with threadpool_limits(1):
            times = warm_times(partial(jets, Z, V), bench.repeats)
        yield timing(f"jets in {kind}", "ms", times, size)
        rate = rates(flops, times)
        share = max(rate) / peak.max
        yield spread(f"jets in {kind}", "GFLOP/s", rate, f"{share:.0%} of the matrix product, best against best")


def _dgemm(repeats: int) -> Row:
    A = np.random.default_rng(0).normal(size=(SQUARE, SQUARE))
    with threadpool_limits(1):
        times = warm_times(lambda: A @ A, repeats)
    return spread("peak", "GFLOP/s", rates(2 * SQUARE**3, times), f"NumPy, {SQUARE}² matrices, one thread")


def rates(flops: float, times: Sequence[Time]) -> list[float]:
    """Rates [GFLOP/s] of a number of flops done in the times."""
    return [flops / t.wall / 1e9 for t in times]
