"""The parts of a study: cases give rows, and rows give tables and a figure.

A study is a file beside this one that ends with its `Study`, and a line in `STUDIES` (`__init__.py`). The rest is
common to all: the cases run in processes, the rows of a case are saved when it ends, and a case with rows is not run
again.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, astuple, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Tables
from sgnlp.perception.observation import Observation, ObservationSettings, load
from sgnlp.planning import results
from sgnlp.planning.workers import Workers, each, one_at_a_time
from sgnlp.show.plots import Panel

Key = tuple[str, ...]
REST = 2.0  # least interval between writes of the rows [s]: some studies have thousands of short cases


@dataclass(frozen=True)
class Setup:
    """The arguments of the command; a study uses those that it needs. `timeout` [s] is that of a start."""

    files: tuple[Path, ...]
    hand: str
    settings: Settings
    starts: int
    seed: int
    timeout: float

    def facts(self) -> dict[str, Any]:
        """What rows of plans depend on."""
        facts = {"seed": self.seed, "starts": self.starts, "hand": self.hand, "timeout": self.timeout}
        return facts | {"settings": asdict(self.settings), "cleaning": asdict(ObservationSettings())}

    def observations(self) -> list[Observation]:
        """Every cloud, read before any work; raises `InputError` if one is bad or two have the same name."""
        wholes = [load(file) for file in self.files]
        names = [whole.name for whole in wholes]
        if twice := [name for name in names if names.count(name) > 1]:
            raise InputError(f"two of the clouds are called '{twice[0]}'")
        return wholes


@dataclass(frozen=True)
class Case:
    """Work done completely or not at all, in its own process. Its rows begin with the fields of `key`."""

    key: Key
    work: Callable[[], list[Any]]


@dataclass(frozen=True)
class Study:
    """An experiment: its question, its cases, and the tables and figure from all rows."""

    question: str
    row: type[Any]  # a dataclass of str, int, float and bool
    cases: Callable[[Setup, Sequence[Observation]], list[Case]]
    tables: Callable[[Frame], Tables]
    panels: Callable[[Frame], list[Panel]]  # of the figure
    caption: str
    # what rows depend on besides clouds; rows with other facts are not mixed
    facts: Callable[[Setup], dict[str, Any]] = Setup.facts
    clouds: bool = True  # whether it takes clouds
    alone: bool = False  # whether cases run one at a time, because they are timed
    failed: Callable[[Setup, Sequence[Any]], Iterator[Any]] | None = None  # carries out failed trials again


def body(name: str) -> str:
    """The name of an object without the number of its pose."""
    stem, _, pose = name.rpartition("_")
    return stem if stem and pose.isdigit() else name


def view_sets(names: Sequence[str]) -> list[list[str]]:
    """One camera (the first), two (the others), all: as in the paper's experiments."""
    names = list(names)
    return [names] if len(names) < 2 else [names[:1], names[1:], names] if len(names) > 2 else [names[:1], names]


def over_views(
    work: Callable[[Setup, Path, list[str]], list[Any]], setup: Setup, observations: Sequence[Observation]
) -> list[Case]:
    """A case for each object and set of views; rows begin with the name and the views."""
    return [
        Case((whole.name, " ".join(views)), partial(work, setup, file, views))
        for file, whole in zip(setup.files, observations, strict=True)
        for views in view_sets(whole.view_names)
    ]


def collect(
    kind: type[Any], cases: Sequence[Case], file: Path, workers: Workers, progress: Callable[[int, int], None]
) -> tuple[list[Any], dict[str, str]]:
    """The rows of all cases in order, read from a file or computed and saved in it, and the reasons of failed cases.

    `progress` is called with the number of cases done and of all.
    """
    width = len(cases[0].key)
    done: dict[Key, list[Any]] = {}
    for row in results.read_rows(file, kind):
        done.setdefault(tuple(str(value) for value in astuple(row)[:width]), []).append(row)
    order = dict.fromkeys([*(case.key for case in cases), *done])
    failures: dict[str, str] = {}
    written = -math.inf
    waiting = [case for case in cases if case.key not in done]

    def rows() -> list[Any]:
        return [row for key in order for row in done.get(key, [])]

    try:
        for ended, (case, outcome) in enumerate(each(_work, waiting, workers), len(cases) - len(waiting) + 1):
            if isinstance(outcome, str):
                failures[" ".join(case.key)] = outcome
            else:
                done[case.key] = outcome
                if time.monotonic() > written + REST:
                    results.write_rows(file, rows())
                    written = time.monotonic()
            progress(ended, len(cases))
    finally:
        if written > -math.inf:
            results.write_rows(file, rows())
    return rows(), failures


def _work(case: Case) -> list[Any]:
    with one_at_a_time():
        return case.work()
