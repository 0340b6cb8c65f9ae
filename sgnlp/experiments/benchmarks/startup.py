"""Before the first solve: import, hand, cloud, surface, functions."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from sgnlp.experiments.benchmarks.bench import Bench
from sgnlp.experiments.benchmarks.measure import Row, Time, clock, cold_times, timing, warm_times
from sgnlp.experiments.benchmarks.processes import cache, fresh, python
from sgnlp.perception.observation import load
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import build_problem
from sgnlp.planning.starts import starts
from sgnlp.program.compiled import compile_program
from sgnlp.program.nlp import build


def rows(bench: Bench) -> Iterator[Row]:
    """Times to import, to load, to fit and to build."""
    for code in ("pass", "import sgnlp", "import sgnlp.cli"):
        yield timing(f"python -c '{code}'", "s", cold_times(partial(python, code), bench.repeats), "fresh process")
    alone = replace(bench)  # a copy without anything loaded
    yield timing("load the hand", "ms", [fresh(hand_time, alone) for _ in range(bench.repeats)], "fresh process")
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
                building.append(fresh(build_time, bench))
                interpreted.append(fresh(ready_time, bench))
                if bench.compiles:
                    compiling.append(fresh(compile_time, bench))
                    ready.append(fresh(ready_time, bench))
    yield timing("build the symbolic functions", "s", building, "fresh process")
    yield timing("ready the solvers, interpreted", "s", interpreted, "fresh process, empty cache; builds the functions")
    if bench.compiles:
        yield timing("compile the functions", "s", compiling, f"fresh process, {bench.jobs} jobs, builds them too")
        yield timing("ready the solvers, compiled", "s", ready, "fresh process, filled cache")


def hand_time(bench: Bench) -> Time:
    """Times of reading the hand."""
    return clock(lambda: bench.hand)


def build_time(bench: Bench) -> Time:
    """Times of building the symbolic functions of every phase."""
    hand = bench.hand
    return clock(lambda: [build(hand, structure) for structure in bench.structures])


def compile_time(bench: Bench) -> Time:
    """Times of building and compiling them."""
    hand = bench.hand
    return clock(lambda: [compile_program(hand, structure, bench.jobs) for structure in bench.structures])


def ready_time(bench: Bench) -> Time:
    """Times of all that stands between a posed problem and its first start."""
    problem = bench.problems[0]
    (start,) = starts(problem, 1, bench.seed)
    return clock(lambda: Planner(problem).prepare(start))
