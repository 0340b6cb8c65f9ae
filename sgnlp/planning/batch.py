"""Many objects, one plan each, over worker processes that live across objects (`sgnlp.planning.workers`).

A worker solves the starts of one object one after another, each in a process forked from it and under its own limit
(`pool.map_starts` with one job). So a start that hangs or crashes costs that start alone, and the worker, where the
symbolic functions are built, goes on.
"""

import json
import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand, told
from sgnlp.hand.placements import Backend
from sgnlp.perception.observation import PLAIN, Observation, Reading, load, name_in
from sgnlp.planning import results
from sgnlp.planning.ending import Ending
from sgnlp.planning.extension import Extension
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.solve import solve
from sgnlp.planning.solvers import settled
from sgnlp.planning.surroundings import NOWHERE, Surroundings
from sgnlp.planning.widening import narrow
from sgnlp.planning.workers import Workers, each, one_at_a_time

LIMITS = ("timeout", "first", "deadline")
"""What a result does not depend on if no start was stopped or left out."""


@dataclass(frozen=True)
class Task:
    """What all objects of a batch have in common; the meaning is that of `load` and `solve`.

    `root` is the folder that relative files are in, wherever a worker runs. `kinematics` is the backend of the hand's
    placements, one for all objects, though a better one may be built meanwhile; the best here if it is not given.
    """

    hand: str = "allegro_left"
    arm: str | None = None
    arm_base: tuple[float, ...] = ()
    settings: Settings = ROBUST
    count: int = 7
    seed: int = 0
    timeout: float = 60.0
    ending: Ending = field(default_factory=Ending)
    solver: str | None = None
    reading: Reading = PLAIN
    extension: Extension | None = None
    surroundings: Surroundings = NOWHERE
    root: Path = field(default_factory=Path.cwd)
    kinematics: Backend | None = None

    @property
    def robot(self) -> Hand:
        """The hand, on its arm if there is one."""
        return load_hand(self.hand, self.settings.spheres, self.arm, self.arm_base, self.kinematics)

    def load(self, file: Path) -> Observation:
        """The observation in a file."""
        return load(self.root / file, self.reading)


@dataclass(frozen=True)
class Row:
    """One object of a batch. `margin`, `confidence` and `energy` are those of the best solution, else nan."""

    name: str
    file: str
    feasible: bool = False
    starts: int = 0
    feasible_starts: int = 0
    widened: bool = False  # its limits of the object's motion: no start was feasible with the narrow ones
    margin: float = math.nan
    confidence: float = math.nan
    energy: float = math.nan
    seconds: float = math.nan
    reused: bool = False
    failure: str = ""


def batch(
    files: Sequence[Path],
    task: Task,
    folder: Path,
    workers: Workers,
    *,
    progress: Callable[[object], None] = lambda read: None,
    before: Callable[[int], None] = lambda unsolved: None,
) -> Generator[Row]:
    """Plan grasps for every file into `folder`/NAME, yielding a row for each as it ends.

    The names in all files are compared before the first is solved; `progress` is called as each is read, and `before`
    with the number of those to solve, when that is known. Objects whose folder holds a result of the same input and
    task are not solved again. Whatever goes wrong with an object is its row's `failure`. The workers are closed at the
    end, however reached.

    Raises:
        InputError: the hand is not valid.
        MachineError: a result cannot be written for want of room; those before it are kept.
    """
    task = replace(task, kinematics=task.robot.kinematics)
    expected = _expected(task)
    try:
        found: dict[Path, tuple[str] | str] = {}
        for file, outcome in each(partial(named, task), dict.fromkeys(files), workers):
            found[file] = outcome
            progress(outcome)
        there = [file for file, told in found.items() if not isinstance(told, str) and (folder / told[0]).is_dir()]
        digests = dict(each(partial(digested, task), there, workers))
        owners: dict[str, Path] = {}
        unsolved = {}
        for file in dict.fromkeys(files):
            told = found[file]
            if isinstance(told, str):
                yield Row(file.stem, str(file), failure=told.removeprefix(f"{task.root / file}: "))
            elif owners.setdefault(told[0], file) != file:
                yield Row(told[0], str(file), failure=f"has the same name as {owners[told[0]]}")
            elif (known := _known(folder / told[0], expected, digests.get(file, ""))) is not None:
                yield _row(file, known, reused=True)
            else:
                unsolved[file] = told[0]
        before(len(unsolved))
        for file, planned in each(partial(plan, task), unsolved, workers):
            planned = planned.removeprefix(f"{task.root / file}: ") if isinstance(planned, str) else planned
            yield _saved(file, unsolved[file], planned, folder)
    finally:
        workers.close()


def named(task: Task, file: Path) -> tuple[str]:
    """The name of the observation in a file."""
    return (name_in(task.root / file, task.reading),)


def digested(task: Task, file: Path) -> tuple[str]:
    """The digest of the observation in a file."""
    with one_at_a_time():
        return (task.load(file).digest,)


Planned = tuple[Grasps, dict[str, Any], dict[str, Any], dict[str, bytes]]
"""Grasps, their summary, how their starts went, and the files of the best one's motion."""


def plan(task: Task, file: Path) -> Planned:
    """The result for one file."""
    with one_at_a_time():
        hand = task.robot
        options = {"count": task.count, "seed": task.seed, "timeout": task.timeout, "solver": task.solver}
        options |= asdict(task.ending)
        around = dict(task.surroundings.kinds())
        found = solve(task.load(file), hand, task.settings, jobs=1, extension=task.extension, **around, **options)  # type: ignore[arg-type]
        return found.arrays(), found.summary(), found.histories(), found.motion_files()


def _saved(file: Path, name: str, planned: Planned | str, folder: Path) -> Row:
    if isinstance(planned, str):
        return Row(name, str(file), failure=planned)
    grasps, found, ways, motion = planned
    try:
        results.save(grasps, found, folder / name, ways, motion)
    except InputError as error:
        return Row(name, str(file), failure=str(error))
    failures = [start["failure"] for start in found["starts_table"] if "failure" in start]
    return _row(file, grasps, failure="; ".join(dict.fromkeys(failures)))


def _row(file: Path, grasps: Grasps, *, reused: bool = False, failure: str = "") -> Row:
    """The row of grasps, best first; `failure` is why starts gave none."""
    meta = grasps.meta
    seconds = meta["seconds"]["fit"] + meta["seconds"]["solve"]
    row = Row(meta["object"], str(file), starts=meta["tried"], seconds=seconds, reused=reused, failure=failure)
    if not len(grasps):
        return row
    return replace(
        row,
        feasible=bool(grasps.feasible[0]),
        feasible_starts=int(grasps.feasible.sum()),
        widened=bool(meta.get("widened", False)),
        margin=float(min(grasps.margins_initial[0].min(), grasps.margins_equilibrium[0].min())),
        confidence=float(grasps.confidence[0]),
        energy=float(grasps.energy[0]),
        failure="" if grasps.feasible[0] else f"violated: {grasps.violated[0]}",
    )


def _expected(task: Task) -> dict[str, Any]:
    """What the meta block of a result of this task says, as it is read from JSON."""
    hand = task.robot
    made: dict[str, Any] = {
        "hand_digest": hand.digest,
        "arm": told(hand),
        "kinematics": hand.kinematics,
        "settings": asdict(task.settings),
        "seed": task.seed,
        "starts": task.count,
    }
    added = {"file": task.extension.file, "sha256": task.extension.digest} if task.extension else None
    own = task.extension.additions().solver if task.extension else None
    solver = settled(task.solver or own, task.settings.solver)
    made |= {"timeout": task.timeout, **asdict(task.ending), "extension": added, "solver": solver.told()}
    return json.loads(json.dumps(made | {"surroundings": task.surroundings.plain()}))


def _known(folder: Path, expected: dict[str, Any], digest: tuple[str] | str) -> Grasps | None:
    """The grasps in a folder, if it is whole, of the expected input and task, and of some start at least."""
    if isinstance(digest, str):  # there is no folder, or the cloud is none
        return None
    expected = expected | {"input_digest": digest[0]}
    try:
        grasps = results.load_grasps(folder)
        results.load_summary(folder, grasps)
    except InputError:
        return None
    if len(grasps) == grasps.meta.get("tried") and grasps.feasible.any():  # limits of time do not matter
        expected = {key: value for key, value in expected.items() if key not in LIMITS}
    same = all(_asked(grasps.meta, key) == value for key, value in expected.items())
    return grasps if same and len(grasps) else None


def _asked(meta: dict[str, Any], key: str) -> Any:
    """What a plan was asked for: the settings without the wide limits that it found to be needed."""
    if key == "settings" and meta.get("widened"):
        return json.loads(json.dumps(asdict(narrow(Settings.restored(meta[key])))))
    return meta.get(key)
