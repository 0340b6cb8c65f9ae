"""Solves: iterations, time of an iteration, of a start, of an object, of the whole command and its memory."""

import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from sgnlp.base.flags import differences
from sgnlp.base.presets import preset
from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, clock, clocked, cold_times, spread, timing
from sgnlp.experiments.benchmarks.processes import cache, command, peak_memory
from sgnlp.perception.observation import Observation
from sgnlp.planning.plan import Plan
from sgnlp.planning.planner import Iterate, Planner
from sgnlp.planning.solve import solve
from sgnlp.planning.starts import Start, starts


@dataclass(frozen=True)
class Solve:
    """A start's solution, its times, and the part of them for f, ∇f, g, J and H [s]."""

    iterate: Iterate
    time: Time
    oracle: float


def solves(bench: Bench) -> Iterator[Row]:
    """Solves in this process on one core, then `sgnlp.solve` with its pool."""
    objects = []
    for problem in bench.problems:
        planner, guesses = Planner(problem), starts(problem, bench.starts, bench.seed)
        for _ in range(bench.repeats):
            with threadpool_limits(1):
                objects.append([timed(planner, start) for start in guesses])
    ended = [one for some in objects for one in some]
    size = f"{len(bench.problems)} objects x {bench.starts} starts x {bench.repeats} repeats"
    yield spread("iterations of a start", "1", [one.iterate.iterations for one in ended], size)
    yield from _iterations([one for one in ended if one.iterate.iterations])
    yield timing("a start", "s", [one.time for one in ended], size)
    for count in sorted({1, bench.starts}):
        firsts = [[one.time for one in some[:count]] for some in objects]
        sums = [Time(sum(time.wall for time in times), sum(time.cpu for time in times)) for times in firsts]
        yield timing(f"an object, {count} starts, one core", "s", sums, "solves alone, in this process")
    yield from _pooled(bench)


def timed(planner: Planner, start: Start) -> Solve:
    """Solve a start; CasADi counts the time of the oracle."""
    planner.prepare(start)

    def solve() -> tuple[Iterate, float]:
        answers = planner.run(start)
        return planner.ended(start, answers), sum(answer.seconds for answer in answers)

    (iterate, oracle), time = clocked(solve)
    return Solve(iterate, time, oracle)


def _iterations(ended: list[Solve]) -> Iterator[Row]:
    counts = [one.iterate.iterations for one in ended]
    each = [Time(one.time.wall / n, one.time.cpu / n) for one, n in zip(ended, counts, strict=True)]
    yield timing("an iteration", "ms", each, "of a start's time, all included")
    oracle = [1e3 * one.oracle / n for one, n in zip(ended, counts, strict=True)]
    yield spread("an iteration: f, ∇f, g, J, H", "ms", oracle, "as CasADi counts")
    rest = [1e3 * t.wall - o for t, o in zip(each, oracle, strict=True)]
    yield spread("an iteration: the rest", "ms", rest, "Ipopt, its linear solver, the check of the optimality")


def _pooled(bench: Bench) -> Iterator[Row]:
    for count in sorted({1, bench.starts}):
        tasks = [partial(planned, bench, seen, count) for seen in bench.observations for _ in range(bench.repeats)]
        ended = [clocked(task) for task in tasks]
        name, note = f"sgnlp.solve, {count} starts, {bench.jobs} jobs", "with the fit and the start of the workers"
        yield timing(name, "s", [time for _, time in ended], note)
        yield spread(f"{name}: solving", "s", [plan.seconds["solve"] for plan, _ in ended], "as the plan tells")


def planned(bench: Bench, observation: Observation, count: int) -> Plan:
    """The plan of one observation, from one round of starts, feasible or not."""
    return solve(observation, bench.hand, bench.settings, count=count, seed=bench.seed, jobs=bench.jobs, rounds=1)


def whole(bench: Bench) -> Iterator[Row]:
    """The whole command `sgnlp solve`, with nothing compiled and with everything compiled; its memory."""
    with tempfile.TemporaryDirectory() as name:
        folder, file = Path(name), bench.files[0]
        arguments = ["solve", str(file), "--out", str(folder / "out"), "--quiet", *flags(bench)]
        run = partial(command, arguments)
        cold = []
        for i in range(bench.repeats):
            with cache(folder / f"empty{i}"):
                cold.append(clock(partial(command, [*arguments, "--no-build"])))  # nothing runs on beside the next
        size = f"{bench.starts} starts, {bench.jobs} jobs"
        yield timing("sgnlp solve, cold", "s", cold, f"{size}, empty cache: interpreted")
        bench.ready()
        run()  # fills the cache with all else
        yield timing("sgnlp solve, warm", "s", cold_times(run, bench.repeats), f"{size}, filled cache")
        memory = [peak_memory(arguments) for _ in range(bench.repeats)]
        yield spread("sgnlp solve, peak memory", "MB", memory, "all processes together, what they share once")


def flags(bench: Bench) -> list[str]:
    """The flags of `sgnlp solve` for the measurement."""
    return [*chosen(bench), "--starts", str(bench.starts), "--seed", str(bench.seed), "--jobs", str(bench.jobs)]


def chosen(bench: Bench) -> list[str]:
    """The flags of hand and settings, which `sgnlp cache` has too."""
    changed = differences(asdict(preset(bench.preset)), asdict(bench.settings))
    return ["--preset", bench.preset, "--hand", bench.hand_name, *changed]
