"""Many objects in one run of `sgnlp batch`: how long they take, and whether the memory stays flat."""

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from sgnlp.experiments.benchmarks.bench import Bench
from sgnlp.experiments.benchmarks.measure import Row, clocked, spread, timing
from sgnlp.experiments.benchmarks.processes import memory_course
from sgnlp.experiments.benchmarks.solving import flags
from sgnlp.perception.observation import Observation
from sgnlp.planning.batch import Row as Planned
from sgnlp.planning.results import read_rows

SIZES = (0.85, 1.15)
"""Factors between which a cloud is scaled, so that it is another object of nearly the same size."""
LOOKING = 1.0
"""Time between two looks at the memory [s]."""
PART = 5
"""The first and the last of this many parts of the run are compared, the first without its start."""


def rows(bench: Bench) -> Iterator[Row]:
    """Time and memory of `bench.objects` clouds made of the given ones, with compiled functions."""
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
    """Files of clouds taken in turn, each turned about the vertical and scaled, on the table where it stood."""
    rng, files = np.random.default_rng(seed), []
    for i in range(count):
        seen = observations[i % len(observations)]
        angle, size = rng.uniform(0, 2 * np.pi), rng.uniform(*SIZES)
        R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        foot = np.append(seen.points[:, :2].mean(axis=0), seen.table_height)
        points = foot + size * (seen.points - foot) @ R.T
        files.append(folder / f"{seen.name}-{i}.npz")
        np.savez(files[-1], points=points, table_height=seen.table_height)
    return files


def parts(course: Sequence[float]) -> dict[str, list[float]]:
    """Looks at the memory early in the run and late in it."""
    size = max(1, len(course) // PART)
    return {"early": list(course[size : 2 * size]) or list(course), "late": list(course[-size:])}
