"""`sgnlp study`: experiments over many objects, resumable, with command, versions and machine beside the rows."""

import os
import shlex
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console

from sgnlp import environment, report, results
from sgnlp.cli import flags
from sgnlp.cli.progress import starts_bar
from sgnlp.convergence import Row, case, table, view_sets
from sgnlp.hand import Hand, load_hand
from sgnlp.observation import Observation, load
from sgnlp.settings import ROBUST, Settings


@dataclass
class Study:
    """Run an experiment over many clouds and write its table and raw rows; run again, it goes on where it ended."""

    name: tyro.conf.Positional[Literal["convergence"]]
    """convergence: solved and feasible starts, and Ipopt's energy against that of 1000 AdamW steps"""
    files: tyro.conf.Positional[tuple[Path, ...]]
    """the clouds"""
    preset: str = "robust"
    """settings to begin with: robust or paper"""
    hand: str = "allegro_left"
    """a hand of `sgnlp hands`, or a folder with a hand.yaml"""
    starts: int = 7
    """initial guesses for each cloud and set of views"""
    seed: int = 0
    """of everything random"""
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    """worker processes"""
    timeout: float = 300.0
    """wall-clock limit of a start with all that it is compared with [s]"""
    out: Path | None = None
    """folder of the results; results/NAME if not given"""
    settings: Annotated[Settings, tyro.conf.arg(name="")] = ROBUST
    """everything about the plan"""

    def run(self, console: Console) -> int:
        """Every case that has no rows yet, then the table over all."""
        flags.check(self.starts, self.seed, self.jobs, self.timeout)
        folder = self.out or Path("results") / self.name
        results.writable(folder)
        rows_file, hand = folder / "rows.csv", load_hand(self.hand, self.settings.spheres)
        wholes = [load(file) for file in self.files]  # so that a bad one is told before the hours of work
        made = self._made(wholes)
        results.same_study(folder / "made.json", made)
        rows = results.read_rows(rows_file, Row)
        results.write_text(folder / "made.json", results.json_text(made))
        done = {(row.object, row.view_names) for row in rows}
        for file, whole in zip(self.files, wholes, strict=True):
            for views in view_sets(whole.view_names):
                if (whole.name, " ".join(views)) not in done:
                    rows += self._case(console, file, views, hand)
                    results.write_rows(rows_file, rows)
        lines = table(rows)
        results.write_text(folder / "table.md", report.markdown(lines))
        console.print(report.rows_table(f"{self.name}, preset {self.preset}", lines))
        console.print(f"written: {folder}", soft_wrap=True)
        return 0

    def _case(self, console: Console, file: Path, views: list[str], hand: Hand) -> list[Row]:
        with starts_bar(console, self.starts, show=True) as advance:
            return case(
                load(file, views=views),
                hand,
                self.settings,
                count=self.starts,
                seed=self.seed,
                jobs=self.jobs,
                timeout=self.timeout,
                progress=advance,
            )

    def _made(self, observations: list[Observation]) -> dict[str, Any]:
        return {
            "command": shlex.join(["sgnlp", *sys.argv[1:]]),
            "study": {
                "seed": self.seed,
                "starts": self.starts,
                "hand": self.hand,
                "settings": asdict(self.settings),
            },
            "inputs": {observation.name: observation.digest for observation in observations},
            "versions": environment.versions(),
            "machine": environment.machine(),
        }
