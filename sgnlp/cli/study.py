"""`sgnlp study`: experiments over many objects, resumable, with command, versions and machine beside the rows."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import tyro
from rich.console import Console

from sgnlp import report, results
from sgnlp.checked import POSITIVE, Interval
from sgnlp.cli.flags import ROWS, Starting, Tabling, made
from sgnlp.cli.progress import starts_bar
from sgnlp.convergence import Row, case, table, view_sets
from sgnlp.hand import Hand, load_hand
from sgnlp.observation import Observation, load


@dataclass(kw_only=True)
class Study(Tabling, Starting):
    """Run an experiment over many clouds and write its table and raw rows; run again, it goes on where it ended."""

    valid: ClassVar[dict[str, Interval]] = Starting.valid | {"timeout": POSITIVE}

    name: tyro.conf.Positional[Literal["convergence"]]
    """convergence: solved and feasible starts, and Ipopt's energy against that of 1000 AdamW steps"""
    files: tyro.conf.Positional[tuple[Path, ...]]
    """the clouds"""
    timeout: float = 300.0
    """wall-clock limit of a start with all that it is compared with [s]"""
    out: Path | None = None
    """folder of the results; results/NAME if not given"""

    def run(self, console: Console) -> int:
        """Every case that has no rows yet, then the table over all."""
        folder = self.out or Path("results") / self.name
        results.writable(folder)
        hand = load_hand(self.hand, self.settings.spheres)
        wholes = [load(file) for file in self.files]  # so that a bad one is told before the hours of work
        how = self._made(wholes)
        results.same_study(folder / "made.json", how)
        rows = results.read_rows(folder / ROWS, Row)
        results.write_text(folder / "made.json", results.json_text(how))
        done = {(row.object, row.view_names) for row in rows}
        for file, whole in zip(self.files, wholes, strict=True):
            for views in view_sets(whole.view_names):
                if (whole.name, " ".join(views)) not in done:
                    rows += self._case(console, file, views, hand)
                    self.write(folder, rows)
        self.write(folder, rows)  # in another form too, though no case was missing
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
        study = {"seed": self.seed, "starts": self.starts, "hand": self.hand, "settings": asdict(self.settings)}
        return made(study=study, inputs={observation.name: observation.digest for observation in observations})
