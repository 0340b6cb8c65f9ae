"""`sgnlp cache`: show, build and clear the functions compiled for this user."""

import os
from dataclasses import dataclass, field, replace
from typing import Annotated

import tyro
from rich.console import Console

from sgnlp.base import toolchain
from sgnlp.base.checked import POSITIVE
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.cli import compiling
from sgnlp.cli.flags import Extending, Planning
from sgnlp.cli.progress import bars
from sgnlp.program.around import ALONE, Around
from sgnlp.show import tables


@dataclass(kw_only=True)
class Cache(Extending, Planning):
    """Show, build or clear the compiled functions. A build takes half a minute and serves every object.

    For a hand of your own it takes five seconds more, once for all hands: Pinocchio's kinematics are compiled too.
    """

    build: bool = False
    """compile for the given hand and settings, unless that is done already"""
    clear: bool = False
    """delete everything in the cache"""
    jobs: Annotated[int, POSITIVE] = field(default_factory=lambda: os.cpu_count() or 1)
    """compilers at once"""
    around: Around = ALONE
    """what surrounds the object in these plans"""
    settings: Annotated[Settings, tyro.conf.arg(name="")] = ROBUST
    """settings of the plan; only those matter that change the functions: spheres, formulation, metric, what is planned
    at first contact, whether torques are bounded"""

    def run(self, console: Console) -> int:
        """Clear, then build, then show."""
        if self.clear:
            toolchain.clear()
        if self.build:
            for library in compiling.LIBRARIES:
                library.load()
            with bars(console) as bar:
                fault = compiling.build_kinematics(self.robot, bar)
            console.print(fault, soft_wrap=True, end="\n" if fault else "")
            hand = self.robot
            structures = self.additions.structures(self.settings, replace(self.around, carried=hand.arm is not None))
            with bars(console) as bar:
                compiling.build(hand, structures, self.jobs, bar)
        built = [file for file in toolchain.entries() if file.suffix != ".lock"]
        sizes = {file.name: f"{file.stat().st_size / 1e6:.2f} MB" for file in built}
        folder = toolchain.cache_folder()
        empty = f"Nothing is compiled in {folder}: 'sgnlp cache --build' compiles what plans need."
        console.print(tables.facts_table(f"Compiled, in {folder}", sizes) if sizes else empty, soft_wrap=not sizes)
        return 0
