"""The whole command beside that of an earlier version, pair by pair in one run: how much quicker has it become?"""

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, clock, spread, timing
from sgnlp.experiments.benchmarks.processes import cache, command
from sgnlp.experiments.benchmarks.solving import chosen, flags

WARM, COLD = "sgnlp solve, warm", "sgnlp solve, cold"


def rows(bench: Bench) -> Iterator[Row]:
    """Pairs of `sgnlp solve` of this version and of the one in `bench.earlier`, if one is named."""
    if bench.earlier is None:
        return
    versions = (bench.earlier, None)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        caches = [folder / "then", folder / "now"]
        for place, version in zip(caches, versions, strict=True):
            if bench.compiles:
                with cache(place):
                    command(["cache", "--build", "--jobs", str(bench.jobs), *chosen(bench)], version)
        warm, cold = [], []
        for i in range(bench.repeats):
            for k, file in enumerate(bench.files):
                solve = ["solve", str(file.resolve()), "--out", str(folder / "out"), "--quiet", *flags(bench)]
                warm.append([_timed(solve, place, at) for place, at in zip(caches, versions, strict=True)])
                if k == 0:
                    then = _timed(solve, folder / f"empty then {i}", bench.earlier)
                    alone = [*solve, "--no-build"]  # nothing may run in the background of the next measurement
                    cold.append([then, _timed(alone, folder / f"empty now {i}", None)])
    size = f"{bench.starts} starts, {bench.jobs} jobs; commit {bench.earlier_commit}"
    for name, pairs in ((WARM, warm), (COLD, cold)):
        yield timing(f"{name}, the earlier version", "s", [then for then, _ in pairs], size)
        yield timing(f"{name}, this version", "s", [now for _, now in pairs])
        over = [now.wall / then.wall for then, now in pairs]
        yield spread(f"{name}: this over the earlier version", "1", over, "of each pair")


def _timed(arguments: list[str], place: Path, version: Path | None) -> Time:
    """Times of the command with its own cache."""
    with cache(place):
        return clock(partial(command, arguments, version))
