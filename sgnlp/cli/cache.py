"""`sgnlp cache`: what has been compiled for this user, building it and clearing it."""

import os
import subprocess
from dataclasses import dataclass, field
from typing import Annotated

import tyro
from rich.console import Console

from sgnlp import compiled, report, toolchain
from sgnlp.cli.flags import Planning
from sgnlp.cli.progress import counting_bar
from sgnlp.errors import SolverError
from sgnlp.hand import load_hand
from sgnlp.ipopt import schedule
from sgnlp.nlp import structure
from sgnlp.settings import ROBUST, Settings


@dataclass(kw_only=True)
class Cache(Planning):
    """Show, build or clear the compiled functions. A build takes half a minute and serves every object."""

    build: bool = False
    """compile for the hand and the settings given, unless that is done"""
    clear: bool = False
    """delete everything in the cache"""
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    """compilers at once"""
    settings: Annotated[Settings, tyro.conf.arg(name="")] = ROBUST
    """everything about the plan; the structure is what counts: spheres, samples, density, equilibrium, formulation"""

    def run(self, console: Console) -> int:
        """Clear, then build, then show."""
        if self.clear:
            for file in toolchain.entries():
                file.unlink(missing_ok=True)
        if self.build:
            self._build(console)
        libraries = [file for file in toolchain.entries() if file.suffix == ".so"]
        sizes = {file.name: f"{file.stat().st_size / 1e6:.2f} MB" for file in libraries}
        console.print(report.facts_table(f"Compiled, in {toolchain.cache_folder()}", sizes))
        return 0

    def _build(self, console: Console) -> None:
        hand = load_hand(self.hand, self.settings.spheres)
        for formulation, _ in schedule(self.settings.solver):
            with counting_bar(console, f"compiling {formulation}") as progress:
                try:
                    compiled.compile_program(hand, structure(self.settings.contact, formulation), self.jobs, progress)
                except (OSError, subprocess.SubprocessError) as error:
                    raise SolverError(f"cannot compile: {error}") from None
