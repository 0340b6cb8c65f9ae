"""The jets of the surface in C and in NumPy, against the machine's peak.

A trial point of a line search needs values: N² flops for each of the V variances and 25 N for each of the Q means. A
point that is accepted needs the derivatives too: another 4 N² and 70 N. So they are counted, whatever is executed.
"""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from sgnlp.experiments.benchmarks.bench import Bench
from sgnlp.experiments.benchmarks.measure import Row, Time, spread, timing, warm_times
from sgnlp.experiments.benchmarks.oracle import scene
from sgnlp.surface.gpis import MEAN_JET, VARIANCE_JET
from sgnlp.surface.native import NumpyJets, raw_jets

FLOPS = {"values": (1, 25), "derivatives": (4, 70)}
"""Flops of a variance over N², and of a mean over N."""
SQUARE = 1000
"""Rows of the matrices whose product gives the peak."""


def rows(bench: Bench) -> Iterator[Row]:
    """Times and GFLOP/s of all jets that one new x needs, and of a matrix product."""
    problem = bench.problems[0]
    joined, x, p = scene(problem, bench.seed)
    layout, N = joined.nlp.layout, len(problem.gpis.X)
    Q, V = layout.points, layout.uncertain
    given = np.array(joined.nlp.points(x, p)[0])
    Z = np.asfortranarray(np.concatenate([given, given[: Q - len(given)]]))  # the feet lie next to the contacts
    arrays = Z, np.zeros((Q, MEAN_JET)), np.zeros((V, VARIANCE_JET))
    peak = _dgemm(bench.repeats)
    yield peak
    with threadpool_limits(1):
        yield timing("jets in NumPy", "ms", warm_times(partial(NumpyJets(problem.gpis).values, *arrays), bench.repeats))
    jets = raw_jets(problem.gpis, V)
    if isinstance(jets, NumpyJets):
        return
    for step, (variance, mean) in FLOPS.items():
        flops = variance * N**2 * V + mean * N * Q
        size = f"N = {N}, V = {V}, Q = {Q}; {variance} N² V + {mean} N Q = {flops / 1e6:.1f} Mflop"
        times = warm_times(partial(getattr(jets, step), *arrays), bench.repeats)
        yield timing(f"{step} in C", "ms", times, size)
        rate = rates(flops, times)
        share = max(rate) / peak.max
        yield spread(f"{step} in C", "GFLOP/s", rate, f"{share:.0%} of the matrix product, best against best")


def _dgemm(repeats: int) -> Row:
    A = np.random.default_rng(0).normal(size=(SQUARE, SQUARE))
    with threadpool_limits(1):
        times = warm_times(lambda: A @ A, repeats)
    return spread("peak", "GFLOP/s", rates(2 * SQUARE**3, times), f"NumPy, {SQUARE}² matrices, one thread")


def rates(flops: float, times: Sequence[Time]) -> list[float]:
    """Rates [GFLOP/s] of a number of flops done in the times."""
    return [flops / t.wall / 1e9 for t in times]
