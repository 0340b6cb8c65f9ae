"""`sgnlp solve`: from a point cloud to a folder of grasps."""

import os
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from sgnlp import report, results
from sgnlp.cli import codes, compiling, flags
from sgnlp.cli.progress import starts_bar
from sgnlp.hand import load_hand
from sgnlp.observation import ObservationSettings, load
from sgnlp.plan import Plan, solve
from sgnlp.settings import ROBUST, Settings
from sgnlp.summary import arrays, summary


@dataclass
class Solve:
    """Plan compliant pregrasps for a point cloud (.npz, .ply, .pcd, .xyz)."""

    file: tyro.conf.Positional[Path]
    """the cloud: z up, metres; an npz holds `points` (N, 3) or one `points_<camera>` array a camera"""
    preset: str = "robust"
    """settings to begin with: robust or paper; every flag below changes one of them"""
    views: tuple[str, ...] = ()
    """cameras to use, by name or index; all if none is named"""
    hand: str = "allegro_left"
    """a hand of `sgnlp hands`, or a folder with a hand.yaml"""
    starts: int = 7
    """initial guesses: the hand's own first, then seeded ones around the cloud"""
    seed: int = 0
    """of everything random"""
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    """worker processes; the result does not depend on it"""
    timeout: float = 60.0
    """wall-clock limit of a start [s]"""
    scale: float = 1.0
    """factor to metres: 0.001 for a cloud in millimetres"""
    table_height: float | None = None
    """height of the table [m]; taken from the file, or estimated, if not given"""
    out: Path | None = None
    """folder of the result; results/NAME if not given"""
    json: bool = False
    """print the summary as JSON and nothing else"""
    quiet: bool = False
    """print nothing but errors"""
    cleaning: ObservationSettings = field(default_factory=ObservationSettings)
    """how the cloud is cleaned"""
    settings: Annotated[Settings, tyro.conf.arg(name="")] = ROBUST
    """everything about the plan"""

    def run(self, console: Console) -> int:
        """Load, plan, save, show."""
        flags.check(self.starts, self.seed, self.jobs, self.timeout, self.scale)
        observation = load(
            self.file,
            views=list(self.views) or None,
            scale=self.scale,
            table_height=self.table_height,
            settings=self.cleaning,
        )
        hand = load_hand(self.hand, self.settings.spheres)
        folder = self.out or Path("results") / observation.name
        results.writable(folder)
        show = not (self.json or self.quiet)
        with starts_bar(console, self.starts, show) as advance:
            plan = solve(
                observation,
                hand,
                self.settings,
                count=self.starts,
                seed=self.seed,
                jobs=self.jobs,
                timeout=self.timeout,
                progress=advance,
            )
        outcome = summary(plan)
        results.save(arrays(plan), outcome, folder)
        if self.json:
            sys.stdout.write(results.json_text(outcome))
        if show:
            _show(console, plan, folder, self.hand)
        return codes.FEASIBLE if plan.best else codes.NONE_FEASIBLE


def _show(console: Console, plan: Plan, folder: Path, hand: str) -> None:
    for note in plan.observation.notes:
        console.print(note, style="dim")
    for table in report.tables(plan):
        console.print(table)
        console.print()
    compiling.offer(console, plan.problem.hand, hand, plan.problem.settings)
    console.print(report.headline(plan))
    console.print(f"written: {folder / results.GRASPS}, {folder / results.SUMMARY}", soft_wrap=True)
