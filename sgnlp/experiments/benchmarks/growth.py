"""How the work grows with the training points, the starts and the objects."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from threadpoolctl import threadpool_limits

from sgnlp.experiments.benchmarks.bench import Bench
from sgnlp.experiments.benchmarks.measure import Row, clocked, cold_times, timing, warm_times
from sgnlp.experiments.benchmarks.oracle import call, scene
from sgnlp.experiments.benchmarks.solving import planned
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import build_problem
from sgnlp.planning.starts import starts

SURFACE_POINTS = (100, 200, 500, 1000)
"""Settings of `gpis.surface_points`."""
STARTS = (1, 7, 28)
"""Numbers of starts."""


def points(bench: Bench) -> Iterator[Row]:
    """Fit, Hessian and a start of the first object with ever more training points."""
    for count in SURFACE_POINTS:
        settings = replace(bench.settings, gpis=replace(bench.settings.gpis, surface_points=count))
        fit = partial(build_problem, bench.observations[0], bench.hand, settings, bench.seed)
        problem = fit()
        size = f"N = {len(problem.gpis.X)}"
        with threadpool_limits(1):
            yield timing(f"{size}: fit the surface", "ms", cold_times(fit, bench.repeats))
            joined, x, p = scene(problem, bench.seed)
            yield timing(f"{size}: H at a new x", "ms", warm_times(call(joined.hessian, x, p, True), bench.repeats))
            planner, (start,) = Planner(problem), starts(problem, 1, bench.seed)
            ended = [clocked(partial(planner.solve, start)) for _ in range(bench.repeats)]
        iterations = ended[0][0].iterations
        yield timing(f"{size}: a start", "s", [time for _, time in ended], f"the first; {iterations} iterations")


def count_starts(bench: Bench) -> Iterator[Row]:
    """`sgnlp.solve` of the first object with ever more starts."""
    for count in STARTS:
        task = partial(planned, bench, bench.observations[0], count)
        times = cold_times(task, bench.repeats)
        yield timing(f"{count} starts", "s", times, f"sgnlp.solve, {bench.jobs} jobs")


def objects(bench: Bench) -> Iterator[Row]:
    """`sgnlp.solve` of one object after another in this process, ever more of them."""
    count = 1
    while count <= len(bench.observations):
        each = [partial(planned, bench, seen, bench.starts) for seen in bench.observations[:count]]
        times = cold_times(lambda each=each: [task() for task in each], bench.repeats)  # type: ignore[misc]
        yield timing(f"{count} objects", "s", times, f"{bench.starts} starts each, {bench.jobs} jobs")
        count *= 2
