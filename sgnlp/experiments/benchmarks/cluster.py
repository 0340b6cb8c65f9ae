"""How well a Dask cluster fills its workers: the time in which they plan, against that in which they wait for work.

A machine with fewer cores than workers cannot show their throughput. So the times of each task are counted: its CPU
time c, and the gap d between its end and the beginning of the worker's next. With a core for each, n workers have

    n c/(c + d_n)   times the throughput of one without gaps.

The number of workers is limited by the process that gives out work: it saves the results one after the other.
"""

import os
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from statistics import mean, median

from sgnlp.experiments.benchmarks.growth import variations
from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, cpu_seconds, spread, timing
from sgnlp.planning import results
from sgnlp.planning.batch import Planned, Task, plan
from sgnlp.planning.grasps import Grasps, same
from sgnlp.planning.workers import Workers, each

WORKERS = (1, 4)
EACH = 3
"""Objects for each worker of the largest run: two gaps each, since a worker's first task builds its functions."""
GAIN = f"dask, {WORKERS[-1]} workers over {WORKERS[0]}"
LOST = f"dask, {WORKERS[-1]} workers: throughput lost to waiting"


@dataclass(frozen=True)
class Span:
    """When a task ran in which process [s], and the CPU time that it took there."""

    process: int
    begin: float
    end: float
    cpu: float


@dataclass(frozen=True)
class Run:
    """A batch on some workers: a span for each object, its grasps, and the time from beginning to end [s].

    `main` is the CPU time [s] of this process for each object that it saved, except for the first one.
    """

    spans: Sequence[Span]
    grasps: dict[Path, Grasps]
    seconds: float
    main: float

    @property
    def gaps(self) -> list[float]:
        """The times [s] between a task's end and the beginning of the next one in the same process."""
        of = defaultdict(list)
        for span in sorted(self.spans, key=lambda span: span.begin):
            of[span.process].append(span)
        return [after.begin - before.end for own in of.values() for before, after in pairwise(own)]

    @property
    def busy(self) -> float:
        """Share of a worker's time in which it plans, had it a core for itself: c/(c + d)."""
        cpu = median(span.cpu for span in self.spans)
        return cpu / (cpu + mean(self.gaps or [0.0]))


def rows(bench: Bench) -> Iterator[Row]:
    """The same few objects without Dask, and on clusters of this machine; empty if Dask is not installed."""
    if find_spec("distributed") is None:
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = variations(bench.observations, EACH * WORKERS[-1], bench.seed, folder)
        task = Task(hand=bench.hand_name, settings=bench.settings, count=bench.starts, seed=bench.seed)
        alone = measured(task, files, Workers(1), folder / "alone")
        runs = {count: on_cluster(count, task, files, folder / str(count)) for count in WORKERS}
    size = f"{len(files)} objects x {bench.starts} starts, {os.cpu_count()} cores"
    yield from _told("without dask", alone, size)
    for count, run in runs.items():
        yield from _told(f"dask, {count} workers", run, size)
        equal = sum(same(run.grasps[file], alone.grasps[file]) for file in files)
        yield spread(f"dask, {count} workers: the same bits", "1", [equal], f"of {len(files)} objects, as without")
    least, most = (runs[count].busy * count for count in WORKERS)
    yield spread(GAIN, "1", [most / least], "throughput, by counted time: a core for each worker")
    lost = 100 * (1 - most / least * WORKERS[0] / WORKERS[-1])
    yield spread(LOST, "%", [lost], "of so many times that of one")


def _told(label: str, run: Run, size: str) -> Iterator[Row]:
    """What a run took."""
    count = len(run.spans)
    times = [Time(span.end - span.begin, span.cpu) for span in run.spans]
    yield timing(f"{label}: planning one", "s", times, size)
    yield spread(f"{label}: a gap", "ms", [1e3 * gap for gap in run.gaps] or [0.0], "between two tasks of a worker")
    yield spread(f"{label}: the main process", "ms", [1e3 * run.main], "CPU time an object")
    yield spread(f"{label}: objects a minute", "1", [60 * count / run.seconds], "with the start of the workers")


def on_cluster(count: int, task: Task, files: Sequence[Path], folder: Path) -> Run:
    """The run on a cluster of this machine with so many workers of one thread."""
    options = {"processes": True, "dashboard_address": None, "silence_logs": 50, "threads_per_worker": 1}
    with import_module("distributed").LocalCluster(n_workers=count, **options) as cluster:
        return measured(task, files, Workers(count, cluster.scheduler_address), folder)


def measured(task: Task, files: Sequence[Path], workers: Workers, folder: Path) -> Run:
    """Plan and save every file, in the order in which they end."""
    spans, grasps = list[Span](), dict[Path, Grasps]()
    begin, cpu = time.perf_counter(), list[float]()
    try:
        for file, found in each(partial(spanned, task), files, workers):
            if isinstance(found, str):
                raise RuntimeError(f"{file.name}: {found}")
            (made, summary, ways, motion), span = found
            results.save(made, summary, folder / file.stem, ways, motion)
            grasps[file] = made
            spans.append(span)
            cpu.append(time.process_time())
        main = (cpu[-1] - cpu[0]) / max(len(cpu) - 1, 1)
        return Run(spans, grasps, time.perf_counter() - begin, main)
    finally:
        workers.close()


def spanned(task: Task, file: Path) -> tuple[Planned, Span]:
    """The result for a file, and when it was made."""
    begin, cpu = time.time(), cpu_seconds()
    planned = plan(task, file)
    return planned, Span(os.getpid(), begin, time.time(), cpu_seconds() - cpu)
