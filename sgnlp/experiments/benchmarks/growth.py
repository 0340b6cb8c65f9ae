"""How the work grows with the training points, the starts and the objects, up to many objects in one batch."""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from sgnlp.base.settings import Settings
from sgnlp.experiments.benchmarks.measure import Bench, Row, clocked, cold_times, spread, timing, warm_times
from sgnlp.experiments.benchmarks.oracle import call, scene
from sgnlp.experiments.benchmarks.processes import memory_course
from sgnlp.experiments.benchmarks.solving import flags, planned
from sgnlp.perception.observation import Observation
from sgnlp.planning.batch import Row as Planned
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import build_problem
from sgnlp.planning.results import read_rows
from sgnlp.planning.starts import starts

SURFACE_POINTS = (100, 200, 500, 1000)  # on the surface
STARTS = (1, 7, 28)  # numbers of starts
SIZES = (0.85, 1.15)  # factors between which a cloud is scaled, so that it is another object of nearly the same size
LOOKING = 1.0  # time between two samples of the memory of a batch [s]
PART = 5
"""The first and the last of this many parts of a batch are compared, the first without its start."""


def points(bench: Bench) -> Iterator[Row]:
    """Fit, Hessian and a start of the first object with more and more training points."""
    for count in SURFACE_POINTS:
        settings = with_points(bench.settings, count)
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


def with_points(settings: Settings, surface: int, interior: int | None = None) -> Settings:
    """Settings with this many points on the surface, and inside if given, with free space and without."""
    inside = settings.gpis.interior_points if interior is None else interior
    gpis = replace(settings.gpis, surface_points=surface, interior_points=inside)
    return replace(settings, gpis=gpis, free_space=replace(settings.free_space, surface_points=surface))


def count_starts(bench: Bench) -> Iterator[Row]:
    """`sgnlp.solve` of the first object with more and more starts."""
    for count in STARTS:
        times = cold_times(partial(planned, bench, bench.observations[0], count), bench.repeats)
        yield timing(f"{count} starts", "s", times, f"sgnlp.solve, {bench.jobs} jobs")


def objects(bench: Bench) -> Iterator[Row]:
    """`sgnlp.solve` of one object after another in this process, for more and more objects."""
    for count in (2**i for i in range(len(bench.observations).bit_length())):
        each = [partial(planned, bench, seen, bench.starts) for seen in bench.observations[:count]]
        times = cold_times(lambda each=each: [task() for task in each], bench.repeats)  # type: ignore[misc]
        yield timing(f"{count} objects", "s", times, f"{bench.starts} starts each, {bench.jobs} jobs")


def many(bench: Bench) -> Iterator[Row]:
    """Time and memory of `sgnlp batch` on `bench.objects` clouds made of the given ones, with compiled functions."""
    count, name = bench.objects, f"sgnlp batch, {bench.objects} objects"
    with tempfile.TemporaryDirectory() as folder:
        files = variations(bench.observations, count, bench.seed, Path(folder))
        arguments = ["batch", *map(str, files), "--results", folder, *flags(bench)]
        course, time = clocked(lambda: memory_course(arguments, LOOKING))
        planned = read_rows(Path(folder) / "batch" / "rows.csv", Planned)
    feasible, failed = sum(row.feasible for row in planned), sum(not row.starts for row in planned)
    size = f"{bench.starts} starts each, {bench.jobs} jobs; {feasible} feasible, {failed} failed"
    yield timing(name, "s", [time], size)
    yield spread(f"{name}: planning one", "s", [row.seconds for row in planned if row.starts], "fit and starts")
    for part, values in parts(course).items():
        yield spread(f"{name}: memory, {part}", "MB", values, "all processes together, what they share once")


def variations(observations: Sequence[Observation], count: int, seed: int, folder: Path) -> list[Path]:
    """Files of clouds taken in turn, each turned about the vertical and scaled, at its place on the table.

    The background turns with the cloud, so that free space stays known.
    """
    rng, files = np.random.default_rng(seed), []
    for i in range(count):
        seen = observations[i % len(observations)]
        angle, size = rng.uniform(0, 2 * np.pi), rng.uniform(*SIZES)
        R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        foot = np.append(seen.points[:, :2].mean(axis=0), seen.table_height)
        cameras = {"camera_positions": seen.camera_positions} if seen.camera_positions is not None else {}
        placed = {"points": seen.points, **cameras}
        moved = {name: foot + size * (values - foot) @ R.T for name, values in placed.items()}
        files.append(folder / f"{seen.name}-{i}.npz")
        np.savez(files[-1], **moved, view=seen.view, table_height=seen.table_height)
    return files


def parts(course: Sequence[float]) -> dict[str, list[float]]:
    """Samples of the memory early and late in the run."""
    size = max(1, len(course) // PART)
    return {"early": list(course[size : 2 * size]) or list(course), "late": list(course[-size:])}
