"""The flags that several commands have, each said and checked once. A command inherits those that it has."""

import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

import tyro

from sgnlp.base.checked import NOT_NEGATIVE, POSITIVE, Checked, Interval
from sgnlp.base.presets import ROBUST, preset
from sgnlp.base.settings import Settings
from sgnlp.perception.observation import Observation, ObservationSettings, Up, load
from sgnlp.planning import environment, results
from sgnlp.planning.additions import NOTHING, Additions
from sgnlp.planning.extension import Extension, extension
from sgnlp.planning.solvers import solver_named

Command = TypeVar("Command")
ROWS, PARQUET = "rows.csv", "rows.parquet"


@dataclass(kw_only=True)
class Planning(Checked):
    """With what plans are made."""

    valid: ClassVar[dict[str, Interval]] = {"jobs": POSITIVE}

    preset: str = "robust"
    """settings to begin with: one of `sgnlp --help`; every flag below changes one of them"""
    hand: str = "allegro_left"
    """a hand of `sgnlp hands`, or a folder with a hand.yaml"""
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    """worker processes; the result does not depend on it"""
    settings: Annotated[Settings, tyro.conf.arg(name="")] = ROBUST
    """everything about the plan"""

    def _check(self, name: str, value: Any, names: tuple[str, ...]) -> None:
        if value is not tyro.MISSING:  # the default of what is required
            super()._check(name, value, names)


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
class Starting(Planning):
    """And from which starts."""

    valid: ClassVar[dict[str, Interval]] = Planning.valid | {"starts": POSITIVE, "seed": NOT_NEGATIVE}

    starts: int = 7
    """initial guesses for a cloud: the hand's own first, then seeded ones around it"""
    seed: int = 0
    """of everything random"""


@dataclass(kw_only=True)
class Observing(Starting):
    """And of which clouds, with the limit of a start."""

    valid: ClassVar[dict[str, Interval]] = Starting.valid | {"timeout": POSITIVE, "scale": POSITIVE}

    solver: str | None = None
    """a solver of `sgnlp solvers`; if not given, Ipopt, which plans best"""
    timeout: float = 60.0
    """wall-clock limit of a start [s]"""
    views: tuple[str, ...] = ()
    """cameras to use, by name or index; all if none is named"""
    scale: float = 1.0
    """factor to metres: 0.001 for a cloud in millimetres"""
    table_height: float | None = None
    """height of the table [m]; taken from the file, or estimated, if not given"""
    key: str | None = None
    """array of an npz that holds the points, where it is not `points`"""
    up: Up = "z"
    """axis of the cloud that points up; it is turned to z"""
    pose: Annotated[tuple[float, ...] | None, tyro.conf.arg(metavar="16 NUMBERS")] = None
    """pose of the cloud's frame in the world, such as its camera's: 16 numbers of a matrix in metres, row by row"""
    cleaning: ObservationSettings = field(default_factory=ObservationSettings)
    """how the cloud is cleaned"""

    def __post_init__(self) -> None:
        """Also that there is such a solver."""
        super().__post_init__()
        if self.solver is not None:
            solver_named(self.solver)

    def observation(self, file: Path) -> Observation:
        """The cloud in a file, read as the flags say."""
        return load(
            file,
            views=list(self.views) or None,
            scale=self.scale,
            table_height=self.table_height,
            key=self.key,
            up=self.up,
            pose=self.pose,
            settings=self.cleaning,
        )


@dataclass(kw_only=True)
class Tabling:
    """How rows are written, for commands that have many."""

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


def made(**facts: Any) -> dict[str, Any]:
    """How rows were made: the command, the commit, the facts given, versions and machine."""
    return {
        "command": shlex.join(["sgnlp", *sys.argv[1:]]),
        "commit": environment.commit(),
        **facts,
        "versions": environment.versions(),
        "machine": environment.machine(),
    }
