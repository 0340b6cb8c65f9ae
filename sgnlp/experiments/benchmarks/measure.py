"""Measurements: what is measured, wall and CPU times of a task, and rows with the median and spread of repeats."""

import math
import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from statistics import median
from typing import TypeVar

from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation, load
from sgnlp.planning.additions import NOTHING, Additions
from sgnlp.planning.environment import commit
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.program.compiled import can_compile, compile_program
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.structure import Structure

T = TypeVar("T")

LEAST = 0.02
"""A warm task is repeated within one measurement until it takes this long [s], a thousand times a clock's tick."""
SHORT = 8
"""Number of digits that identify a commit."""
UNITS = {"s": 1.0, "ms": 1e3, "µs": 1e6}  # units of time in a second


@dataclass(frozen=True)
class Bench:
    """The subject of all measurements. Measurements of a single object use the first file."""

    files: tuple[Path, ...]
    hand_name: str
    preset: str
    settings: Settings
    starts: int
    seed: int
    jobs: int
    repeats: int
    objects: int = 1000
    earlier: Path | None = None
    """A checkout of an earlier version."""

    @cached_property
    def hand(self) -> Hand:
        """The hand, loaded once."""
        return load_hand(self.hand_name, self.settings.spheres)

    @cached_property
    def observations(self) -> list[Observation]:
        """The observation of each file."""
        return [load(file) for file in self.files]

    @cached_property
    def problems(self) -> list[Problem]:
        """The problem of each file."""
        return [build_problem(observation, self.hand, self.settings, self.seed) for observation in self.observations]

    @property
    def earlier_commit(self) -> str:
        """Of the earlier version, in short."""
        return commit(self.earlier)[:SHORT] if self.earlier else ""

    @property
    def structures(self) -> list[Structure]:
        """The structures of the phases."""
        return NOTHING.structures(self.settings)

    @property
    def compiles(self) -> bool:
        """Whether compiled functions are wanted and can be made."""
        return self.settings.solver.compiled and can_compile()

    def ready(self) -> None:
        """Compile the functions that the phases and the comparisons need, unless that is done."""
        penalty = Additions(formulation=Penalty()).structures(self.settings)
        for needed in dict.fromkeys([*self.structures, *penalty]) if self.compiles else ():
            compile_program(self.hand, needed, self.jobs)


@dataclass(frozen=True)
class Row:
    """One measured quantity: spread and median over `repeats` values; `cpu` is the median CPU time of a time.

    CPU time is that of the process and of its children that have ended.
    """

    question: str
    name: str
    unit: str
    min: float
    median: float
    max: float
    cpu: float
    repeats: int
    note: str = ""


@dataclass(frozen=True)
class Time:
    """Wall and CPU time of a task [s]."""

    wall: float
    cpu: float


def cpu_seconds() -> float:
    """CPU time of this process and of its children that have ended [s]."""
    usages = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def clocked(task: Callable[[], T]) -> tuple[T, Time]:
    """What a task returns, and its times."""
    cpu, wall = cpu_seconds(), time.perf_counter()
    result = task()
    return result, Time(time.perf_counter() - wall, cpu_seconds() - cpu)


def clock(task: Callable[[], object], number: int = 1) -> Time:
    """Times of one call of a task, averaged over `number` of them."""
    _, total = clocked(lambda: [task() for _ in range(number)])
    return Time(total.wall / number, total.cpu / number)


def warm_times(task: Callable[[], object], repeats: int) -> list[Time]:
    """Times of a warm task: two calls before show how many calls one measurement needs."""
    task()
    number = math.ceil(LEAST / max(clock(task).wall, LEAST * 1e-6))
    return [clock(task, number) for _ in range(repeats)]


def cold_times(task: Callable[[], object], repeats: int) -> list[Time]:
    """Times of a task without any call before."""
    return [clock(task) for _ in range(repeats)]


def timing(name: str, unit: str, times: Sequence[Time], note: str = "") -> Row:
    """The row of several times."""
    scale = UNITS[unit]
    row = spread(name, unit, [scale * t.wall for t in times], note)
    return replace(row, cpu=scale * median(t.cpu for t in times))


def spread(name: str, unit: str, values: Sequence[float], note: str = "") -> Row:
    """The row of several values."""
    return Row("", name, unit, min(values), median(values), max(values), math.nan, len(values), note)
