"""Before the first solve: import, hand, cloud, surface, functions."""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, clock, cold_times, timing, warm_times
from sgnlp.experiments.benchmarks.processes import cache, fresh, python
from sgnlp.perception.observation import load
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import build_problem
from sgnlp.planning.starts import starts
from sgnlp.program.compiled import compile_program
from sgnlp.program.nlp import build


def rows(bench: Bench) -> Iterator[Row]:
    """Times to import, to load, to fit and to build."""
    for code in ("pass", "import sgnlp.planning.solve", "import sgnlp.cli.solve"):
        yield timing(f"python -c '{code}'", "s", cold_times(partial(python, code), bench.repeats), "fresh process")
    alone = replace(bench)  # a copy without anything loaded
    yield timing("load the hand", "ms", [fresh(timed, alone, "hand") for _ in range(bench.repeats)], "fresh process")
    count = f"{len(bench.files)} objects"
    times = [t for file in bench.files for t in warm_times(partial(load, file), bench.repeats)]
    yield timing("load and clean a cloud", "ms", times, count)
    fits = [partial(build_problem, seen, bench.hand, bench.settings, bench.seed) for seen in bench.observations]
    times = [t for fit in fits for t in warm_times(fit, bench.repeats)]
    yield timing("fit the surface", "ms", times, f"{count}, N = {len(bench.problems[0].gpis.X)}")
    yield from _functions(bench)


def _functions(bench: Bench) -> Iterator[Row]:
    """Symbolic functions, compiling them and readying the solvers, each in a fresh process."""
    bench = replace(bench, files=bench.files[:1])
    building, compiling, interpreted, ready = [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for i in range(bench.repeats):
            with cache(Path(folder) / str(i)):
                building.append(fresh(timed, bench, "build"))
                interpreted.append(fresh(timed, bench, "ready"))
                if bench.compiles:
                    compiling.append(fresh(timed, bench, "compile"))
                    ready.append(fresh(timed, bench, "ready"))
    yield timing("build the symbolic functions", "s", building, "fresh process")
    yield timing("ready the solvers, interpreted", "s", interpreted, "fresh process, empty cache")
    if bench.compiles:
        yield timing("compile the functions", "s", compiling, f"fresh process, {bench.jobs} jobs, builds them too")
        yield timing("ready the solvers, compiled", "s", ready, "fresh process, filled cache")


TASKS: dict[str, Callable[[Bench], object]] = {
    "hand": lambda bench: bench.hand,
    "build": lambda bench: [build(bench.hand, structure) for structure in bench.structures],
    "compile": lambda bench: [compile_program(bench.hand, structure, bench.jobs) for structure in bench.structures],
    "ready": lambda bench: Planner(bench.problems[0]).prepare(*starts(bench.problems[0], 1, bench.seed)),
}
"""Reading the hand, building the symbolic functions, compiling them too, all between a posed problem and a start."""


def timed(bench: Bench, task: str) -> Time:
    """Times of one of the `TASKS`; hand and problem are there before all but the first."""
    if task != "hand":
        bench.problems  # noqa: B018
    return clock(partial(TASKS[task], bench))
