"""What commands do and print when the functions are not compiled yet."""

import os
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import cached_property, partial
from pathlib import Path
from threading import Thread
from typing import Protocol

from rich.console import Console

from sgnlp.base import toolchain
from sgnlp.base.compilers import C
from sgnlp.base.errors import MachineError, SolverError
from sgnlp.base.flags import changed, differences
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.cli import background
from sgnlp.cli.flags import Planning
from sgnlp.cli.progress import Bar
from sgnlp.hand import placement_functions
from sgnlp.hand.hand import Hand
from sgnlp.hand.placements import BACKENDS
from sgnlp.planning.additions import Additions
from sgnlp.planning.solvers import kkt_factors
from sgnlp.program import compiled
from sgnlp.program.around import ALONE, Around
from sgnlp.program.structure import Structure
from sgnlp.surface import native

LIBRARIES = (native.LIBRARY, kkt_factors.LIBRARY)
"""What all hands and settings share: the jets of the surface, and the factors of Ipopt's linear systems."""
PACE = 6e-5
"""Time to write and to compile one instruction on one core [s]."""
CONTACT = ("samples", "density", "equilibrium", "metric", "heuristic")
"""Settings of `contact` that decide which functions are built."""
WORTH = 300
"""Number of starts from which building first is faster: it takes 60 s of processor time and saves 0.2 s per start."""


class Asked(Protocol):
    """The flags of a command that plans."""

    build: bool
    hand: str
    arm: str | None
    settings: Settings
    with_: Path | None

    @property
    def additions(self) -> Additions: ...  # noqa: D102


def build_kinematics(hand: Hand, bar: Callable[[str, int | None], Bar]) -> str:
    """Build Pinocchio's placement functions of the hand and its arm, unless they exist. Returns "", or why it failed.

    A hand that is loaded afterwards uses them. Without them a walk over the model gives the same placements.
    """
    if hand.kinematics != BACKENDS[-1]:
        return ""
    try:
        progress = bar("compiling kinematics", len(hand.models)).advance
        for model in hand.models:
            placement_functions.build(model)
            progress(model)
    except (SolverError, MachineError) as error:
        return f"Pinocchio's kinematics cannot be compiled; a walk over the model gives the same: {error}"
    return ""


def build(hand: Hand, structures: Sequence[Structure], jobs: int, bar: Callable[[str, int | None], Bar]) -> None:
    """Compile what plans need, unless that is done; `bar` makes a progress bar.

    Raises:
        SolverError: there is no compiler, it fails, or the cache cannot be written.
        MachineError: there is no room for it.
    """
    for structure in structures:
        progress = bar(f"compiling {structure.formulation.name}", None).move
        try:
            compiled.compile_program(hand, structure, jobs, progress)
        except (SolverError, MachineError) as error:
            raise type(error)(f"cannot compile: {error}") from None


def worthwhile(hand: Hand, asked: Asked, starts: int, around: Around = ALONE) -> bool:
    """Whether building first takes less time than solving this number of starts with interpreted functions."""
    return starts >= WORTH and missing(hand, asked, around) and compiled.can_compile()


def missing(hand: Hand, asked: Asked, around: Around = ALONE) -> bool:
    """Whether compiled functions are wanted, but a program of these plans is not in the cache."""
    if not asked.settings.solver.compiled:
        return False
    structures = [structure.inner for structure in asked.additions.structures(asked.settings, around)]
    return any(compiled.path(hand, s) is not None and compiled.load(hand, s) is None for s in structures)


class Behind:
    """Compiling in the background of a plan, for later plans: the plan itself is done before the compiler."""

    def __init__(self, hand: Hand, asked: Asked, around: Around):
        self._given = hand, asked, around
        self._work: background.Work | None = None
        self._goes_on = False
        compilers = [Thread(target=library.load) for library in LIBRARIES]  # they wait a second for the compiler
        for thread in compilers:
            thread.start()
        if self._missing:
            for structure in self._structures:
                # the plan needs it too: it is made before the fork, for both processes
                compiled.program(hand, structure)
        for thread in compilers:
            thread.join()
        if self._begun and asked.build:
            self._work = background.Work(partial(_compile, hand, self._structures))

    @property
    def _structures(self) -> Sequence[Structure]:
        _, asked, around = self._given
        return asked.additions.structures(asked.settings, around)

    @cached_property
    def _missing(self) -> bool:
        return missing(*self._given)

    @cached_property
    def _begun(self) -> bool:
        return self._missing and compiled.can_compile() and native.LIBRARY.load() is not None

    def end(self) -> None:
        """The command has no result."""
        if self._work is not None:
            self._work.end()
            self._work = None

    def finish(self) -> None:
        """The command has its result: compilers that are nearly done go on."""
        if self._work is not None:
            self._goes_on = self._work.finish()
            self._work = None

    def told(self, console: Console) -> None:
        """Print that the functions were interpreted, and whether they are being compiled."""
        hand, asked, around = self._given
        if not self._begun:
            if self._missing:
                why = toolchain.cache_fault() or C.fault() or native.LIBRARY.fault()
                console.print(f"The functions are interpreted, which takes about twice as long: {why}", soft_wrap=True)
            return
        self.finish()
        if self._goes_on:
            text = "The functions are being compiled, once for all objects: later plans take half the time."
        else:
            paths = [compiled.path(hand, structure) for structure in self._structures]
            shares = [compiled.share(path) for path in paths if path]
            command = shlex.join(["sgnlp", "cache", "--build", *_flags(asked, around)])
            text = (
                f"The functions are interpreted: {100 * sum(shares) / len(shares):.0f} % of them are compiled so far. "
            )
            text += "The next plans go on compiling. " if asked.build else ""
            text += f"'{command}' compiles them at once, for all objects: plans then take half the time."
        console.print(text, soft_wrap=True)


@contextmanager
def behind(hand: Hand, asked: Asked, around: Around) -> Iterator[Behind]:
    """While a plan is made, compile for the next one, if that is wanted, possible and not done yet."""
    work = Behind(hand, asked, around)
    try:
        yield work
    except BaseException:
        work.end()
        raise
    work.finish()


def _compile(hand: Hand, structures: Sequence[Structure], left: background.Left) -> None:
    """Save the functions, so that they are not built again, then compile them."""
    jobs = os.cpu_count() or 1
    todo = [
        structure for structure in structures if (path := compiled.path(hand, structure)) and not compiled.built(path)
    ]
    seconds = [PACE * compiled.instructions(compiled.program(hand, structure)) / jobs for structure in todo]
    left(sum(seconds))
    for structure in todo:
        compiled.keep(hand, structure)
    for i, structure in enumerate(todo):

        def progress(done: int, total: int, later: float = sum(seconds[i + 1 :]), own: float = seconds[i]) -> None:
            left(later + own * (1 - done / total))

        compiled.compile_program(hand, structure, jobs, progress)
    left(0.0)


def _flags(asked: Asked, around: Around) -> list[str]:
    """The flags that decide the structure, if they differ from the defaults of `sgnlp cache`."""
    default, settings = ROBUST, asked.settings
    contact = {field: getattr(settings.contact, field) for field in CONTACT}
    chosen = replace(
        default,
        spheres=settings.spheres,
        contact=replace(default.contact, **contact),
        closing=replace(default.closing, planned=settings.closing.planned, c_freedom=settings.closing.c_freedom),
        limits=replace(default.limits, effort=settings.limits.effort),
        solver=replace(default.solver, formulation=settings.solver.formulation),
    )
    own = ["--with", str(asked.with_)] if asked.with_ else []
    hand = changed("", {"hand": Planning.hand, "arm": None}, {"hand": asked.hand, "arm": asked.arm})
    around = replace(around, carried=False)  # implied by the arm
    there = differences({"around": asdict(ALONE)}, {"around": asdict(around)})
    return [*hand, *own, *there, *differences(asdict(default), asdict(chosen))]
