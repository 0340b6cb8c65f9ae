"""What commands do and print when the functions are not compiled yet."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Protocol

from rich.console import Console

from sgnlp.base import toolchain
from sgnlp.base.compilers import C
from sgnlp.base.errors import MachineError, SolverError
from sgnlp.base.flags import changed, differences
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.cli.flags import Planning
from sgnlp.cli.progress import Bar
from sgnlp.hand import placement_functions
from sgnlp.hand.hand import Hand
from sgnlp.hand.placements import BACKENDS
from sgnlp.planning.additions import Additions
from sgnlp.program import compiled
from sgnlp.program.around import ALONE, Around
from sgnlp.program.structure import Structure
from sgnlp.surface import native

PATIENCE = 10
"""Niceness of a build in the background, so that it does not slow down other work."""
CONTACT = ("samples", "density", "equilibrium", "metric", "heuristic")
"""Settings of `contact` that decide which functions there are."""
WORTH = 300
"""Number of starts for which building first pays: a build takes 60 s of processor time and saves 0.2 s a start."""


class Asked(Protocol):
    """The flags of a command that plans."""

    hand: str
    arm: str | None
    settings: Settings
    with_: Path | None

    @property
    def additions(self) -> Additions: ...  # noqa: D102


def build_kinematics(hand: Hand, bar: Callable[[str, int | None], Bar]) -> str:
    """Build Pinocchio's placements of the hand's joints and its arm's, unless they run here; why that cannot be done.

    A hand that is loaded after it moves by them. Without them it moves by a walk over its model, with the same results.
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
    """Whether it takes less time to build first than to solve so many starts interpreted."""
    return starts >= WORTH and missing(hand, asked, around) and compiled.can_compile()


def missing(hand: Hand, asked: Asked, around: Around = ALONE) -> bool:
    """Whether a program of the plans is not in the cache, though compiled functions are wanted."""
    paths = [compiled.path(hand, structure) for structure in asked.additions.structures(asked.settings, around)]
    return asked.settings.solver.compiled and not all(path is None or compiled.built(path) for path in paths)


def offer(console: Console, hand: Hand, asked: Asked, around: Around = ALONE) -> None:
    """Tell that the functions were interpreted; on a terminal, compile them in the background for the next run."""
    if not missing(hand, asked, around):
        return
    if not compiled.can_compile() or native.library() is None:
        why = toolchain.cache_fault() or C.fault() or native.attempt()[1]
        console.print(f"The functions are interpreted, which takes about twice as long: {why}", soft_wrap=True)
        return
    command = ["cache", "--build", *_flags(asked, around)]
    if not console.is_terminal:
        console.print(
            f"The functions are interpreted; 'sgnlp {' '.join(command)}' compiles them, once for all objects.",
            soft_wrap=True,
        )
        return
    subprocess.Popen(
        [sys.executable, "-m", "sgnlp", *command],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=lambda: os.nice(PATIENCE) and None,
    )
    text = "Compiling the functions in the background, once for all objects: later plans take half the time."
    console.print(text, soft_wrap=True)


def _flags(asked: Asked, around: Around) -> list[str]:
    """The flags that decide the structure, where they differ from the command's own."""
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
    around = replace(around, carried=False)  # which the arm says
    there = differences({"around": asdict(ALONE)}, {"around": asdict(around)})
    return [*hand, *own, *there, *differences(asdict(default), asdict(chosen))]
