"""The flags that several commands share, each defined and checked once. A command inherits its flags."""

import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tyro

from sgnlp.base.checked import NOT_NEGATIVE, POSITIVE, Checked, Positive
from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST, preset
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception import clouds
from sgnlp.perception.observation import PLAIN, Reading
from sgnlp.planning import environment, results
from sgnlp.planning.additions import NOTHING, Additions
from sgnlp.planning.ending import ROUNDS, Ending
from sgnlp.planning.extension import Extension, extension
from sgnlp.planning.shape_files import load_shapes
from sgnlp.planning.solvers import solver_named
from sgnlp.planning.surroundings import Surroundings

Command = TypeVar("Command")
ROWS, PARQUET = "rows.csv", "rows.parquet"


@dataclass(kw_only=True)
class Planning(Checked):
    """Hand, preset and settings."""

    preset: str = "robust"
    """settings to begin with: one of `sgnlp --help`; every flag below changes one of them"""
    hand: str = "allegro_left"
    """a hand of `sgnlp hands`, or a folder with a hand.yaml"""
    arm: str | None = None
    """what carries the hand: an arm of `sgnlp arms`, or a folder with an arm.yaml; if not given, the wrist is free"""
    arm_base: tuple[float, ...] = ()
    """where the arm stands: x y z [m], with three angles [deg] or a quaternion x y z w; else as its file says"""
    jobs: Annotated[int, POSITIVE] = field(default_factory=lambda: os.cpu_count() or 1)
    """worker processes; the result does not depend on it"""
    settings: Annotated[Settings, tyro.conf.arg(name="")] = ROBUST
    """everything about the plan"""

    @property
    def robot(self) -> Hand:
        """The hand, on its arm if there is one."""
        return load_hand(self.hand, self.settings.spheres, self.arm, self.arm_base)


@dataclass(kw_only=True)
class Extending:
    """With what of the user's own."""

    with_: Annotated[Path | None, tyro.conf.arg(name="with")] = None
    """a file of your own with TERMS, CONSTRAINTS, KERNEL, FORMULATION or SOLVER"""

    @property
    def extension(self) -> Extension | None:
        """What the file adds."""
        return extension(self.with_) if self.with_ else None

    @property
    def additions(self) -> Additions:
        """What it adds to a plan."""
        return self.extension.additions() if self.extension else NOTHING


@dataclass(kw_only=True)
class Surrounding:
    """Among what, and where on the object."""

    obstacle: tuple[Path, ...] = ()
    """YAML files of shapes that the hand stays clear of, beside the table and what the cloud has seen around"""
    avoid: tuple[Path, ...] = ()
    """YAML files of shapes in which no finger is to touch the object"""
    touch: tuple[Path, ...] = ()
    """YAML files of shapes in one of which each finger is to touch it"""

    @property
    def surroundings(self) -> Surroundings:
        """What the files hold."""
        kinds = (self.obstacle, self.avoid, self.touch)
        return Surroundings(*(tuple(shape for file in files for shape in load_shapes(file)) for files in kinds))


@dataclass(kw_only=True)
class Abstaining:
    """When a plan is not to be carried out."""

    min_confidence: Annotated[float, (0.0, 1.0)] = 0.0
    """abstain, with exit code 1, where the first choice's confidence is below this or unknown; 0: never"""


@dataclass(kw_only=True)
class Ended:
    """When an object's search ends."""

    first: Annotated[int | None, POSITIVE] = None
    """end when so many feasible grasps are known, counted in the order of the starts; if not given, try them all"""
    deadline: Annotated[float | None, POSITIVE] = None
    """end so long after the cloud was read, with the best known by then [s]"""
    rounds: Annotated[int, POSITIVE] = ROUNDS
    """where no start has ended feasible, but one near, try as many more, up to so many rounds of them"""
    widen: bool = True
    """where none of these is feasible either, solve the starts again with wider limits of the object's motion"""

    @property
    def ending(self) -> Ending:
        """All of these together."""
        return Ending(self.first, self.deadline, self.rounds, self.widen)


@dataclass(kw_only=True)
class Starting(Planning):
    """The same, and the starts."""

    starts: Annotated[int, POSITIVE] = 7
    """initial guesses for a cloud: the hand's own first, then seeded ones around it"""
    seed: Annotated[int, NOT_NEGATIVE] = 0
    """of everything random"""


@dataclass(kw_only=True)
class Observing(Starting):
    """The same, how the cloud is read, and the time limit of a start."""

    solver: str | None = None
    """a solver of `sgnlp solvers`; if not given, Ipopt, which plans best"""
    timeout: Positive = 60.0
    """wall-clock limit of a start [s]"""
    reading: Annotated[Reading, tyro.conf.arg(name="")] = PLAIN
    """how the cloud is read"""

    def __post_init__(self) -> None:
        """Also that there is such a solver."""
        super().__post_init__()
        if self.solver is not None:
            solver_named(self.solver)


@dataclass(kw_only=True)
class Tabling:
    """How commands write a table of many rows."""

    parquet: bool = False
    """write the rows as rows.parquet too; pip install 'sgnlp[parquet]'"""

    def __post_init__(self) -> None:
        """Also that Parquet can be written, before any work."""
        super().__post_init__()  # type: ignore[misc]
        if self.parquet:
            results.arrow()

    @property
    def tables(self) -> tuple[str, ...]:
        """The files that are written."""
        return (ROWS, PARQUET) if self.parquet else (ROWS,)

    def write(self, folder: Path, rows: Sequence[Any]) -> None:
        """Write them."""
        results.write_rows(folder / ROWS, rows)
        if self.parquet:
            results.write_parquet(folder / PARQUET, rows)


def beginning(command: type[Command], name: str) -> Command:
    """A command with its flags where none is given: a plan's settings are the preset's, what is required is missing.

    Raises:
        InputError: there is no such preset.
    """
    settings = preset(name)
    chosen = {"preset": name, "settings": settings} if issubclass(command, Planning) else {}
    required = [f.name for f in fields(command) if f.default is f.default_factory is MISSING]  # type: ignore[arg-type]
    return command(**dict.fromkeys(required, tyro.MISSING) | chosen)


def check_problem_file(file: Path) -> None:
    """Raise `InputError` unless a problem can be written to a file, before any work."""
    clouds.check_name(file.stem)
    if file.suffix != ".npz":
        raise InputError(f"--out must end in .npz; found '{file}'")
    results.writable(file.parent)


def made(**facts: Any) -> dict[str, Any]:
    """How rows were made: the command, the commit, the facts given, versions and machine."""
    return {
        "command": shlex.join(["sgnlp", *sys.argv[1:]]),
        "commit": environment.commit(),
        **facts,
        "versions": environment.versions(),
        "machine": environment.machine(),
    }
