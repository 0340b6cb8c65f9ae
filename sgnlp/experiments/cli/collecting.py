"""What `sgnlp study` and `sgnlp compare` share: rows of many cases, collected in a folder, resumable."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from sgnlp.cli.flags import ROWS, Starting, Tabling, made
from sgnlp.cli.progress import Bar
from sgnlp.experiments.studies.study import Case, collect
from sgnlp.perception.observation import Observation
from sgnlp.planning import results
from sgnlp.planning.made import resumed
from sgnlp.planning.workers import Workers

MADE = "made.json"


@dataclass(kw_only=True)
class Collecting(Tabling, Starting):
    """A command that resumes when it is run again."""

    redraw: bool = False
    """only make tables and figures again, from the existing rows"""

    def begin(self, folder: Path, facts: dict[str, Any], observations: Sequence[Observation], row: type[Any]) -> None:
        """Write how the rows are made.

        Raises `InputError` if the folder has rows of other settings or clouds, or of another kind.
        """
        inputs = {observation.name: observation.digest for observation in observations}
        how = resumed(folder / MADE, made(study=facts, inputs=inputs))
        results.read_rows(folder / ROWS, row)
        results.write_text(folder / MADE, results.json_text(how))

    def collected(
        self, console: Console, row: type[Any], cases: Sequence[Case], file: Path, bar: Bar, jobs: int
    ) -> tuple[list[Any], bool]:
        """The rows of all cases, and whether some case failed, which is printed."""
        with closing(Workers(jobs)) as workers:
            rows, broken = collect(row, cases, file, workers, bar.move)
        for case, reason in broken.items():
            console.print(f"failed: {case}: {reason}", soft_wrap=True)
        return rows, bool(broken)
