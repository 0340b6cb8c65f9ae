"""`sgnlp study`: experiments over many objects, resumable, with command, versions and machine beside the rows."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro
from rich.console import Console

from sgnlp.base.checked import Positive
from sgnlp.base.errors import InputError, unknown
from sgnlp.cli import codes, lacks
from sgnlp.cli.flags import ROWS
from sgnlp.cli.progress import bars
from sgnlp.experiments import studies
from sgnlp.experiments.cli import failures
from sgnlp.experiments.cli.collecting import Collecting
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import STUDIES
from sgnlp.experiments.studies.study import Case, Setup
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import load
from sgnlp.planning import results
from sgnlp.show import plots
from sgnlp.show import tables as report
from sgnlp.show.png import drawable

if TYPE_CHECKING:
    Name = str
else:
    Name = tyro.extras.literal_type_from_choices(tuple(STUDIES))
QUESTIONS = "; ".join(f"{name}: {study.question}" for name, study in STUDIES.items())


@dataclass(kw_only=True)
class Study(Collecting):
    """Run an experiment and write its tables, raw rows and figure. Run it again to resume.

    It needs pandas: pip install 'sgnlp[experiments]'.
    """

    name: Annotated[tyro.conf.Positional[Name], tyro.conf.arg(help=QUESTIONS)]
    files: tyro.conf.Positional[tuple[Path, ...]] = ()
    """the clouds, if the study uses clouds"""
    half: Literal["tuning", "held_out"] | None = None
    """only the clouds of this half of a problem set"""
    conditions: tuple[str, ...] = ()
    """only these conditions, by their names in the study's tables; all if not given"""
    timeout: Positive = 300.0
    """wall-clock limit of a start, including what it is compared with [s]"""
    pictures: bool = False
    """carry out the failed trials again, and write pictures and reasons to failures.md, if the study has trials"""
    out: Path | None = None
    """folder of the results; results/NAME if not given"""

    def run(self, console: Console) -> int:
        """Run every case without rows, then make the tables and the figure from all rows."""
        study, folder = STUDIES[self.name], self.out or Path("results") / self.name
        frame([])  # refuse before any work if pandas is missing
        if self.redraw:
            return self._redraw(console, study, folder)
        self._refuse(study)
        results.writable(folder)
        load_hand(self.hand, self.settings.spheres)
        setup = Setup(self._chosen(), self.hand, self.settings, self.starts, self.seed, self.timeout)
        observations = setup.observations()
        cases = self._asked(study.cases(setup, observations))
        self.begin(folder, study.facts(setup), observations, study.row)
        lacks.tell(console)
        jobs = 1 if study.alone else self.jobs
        with bars(console) as bar:
            progress = bar(self.name, len(cases))
            rows, broken = self.collected(console, study.row, cases, folder / ROWS, progress, jobs)
        if rows:
            self.write(folder, rows)  # also as Parquet, even if no case was missing
            _show(console, study, rows, folder)
        if self.pictures and study.failed:
            with bars(console) as bar:
                failures.write(folder, study.failed(setup, rows), bar("pictures of failures", None))
        console.print(f"written: {folder}", soft_wrap=True)
        return codes.NONE_FEASIBLE if broken else codes.FEASIBLE

    def _refuse(self, study: studies.Study) -> None:
        """Raise if the study cannot do what the flags ask."""
        if study.clouds != bool(self.files):
            raise InputError(f"the study {self.name} " + ("needs clouds" if study.clouds else "takes no files"))
        if self.pictures:
            drawable()
            if not study.failed:
                raise InputError(f"the study {self.name} has no trials to take pictures of")

    def _chosen(self) -> tuple[Path, ...]:
        """The files of the half that is asked for."""
        files = tuple(file for file in self.files if self.half in (None, load(file).half))
        if self.files and not files:
            raise InputError(f"none of the clouds is of the half '{self.half}'")
        return files

    def _asked(self, cases: list[Case]) -> list[Case]:
        """The cases of the conditions that are asked for; a case's key ends with its condition."""
        names = tuple(dict.fromkeys(case.key[-1] for case in cases))
        for name in self.conditions:
            if name not in names:
                raise unknown("condition", name, names)
        return [case for case in cases if not self.conditions or case.key[-1] in self.conditions]

    def _redraw(self, console: Console, study: studies.Study, folder: Path) -> int:
        """Make only tables and figure; rows and `made.json` stay, whatever the flags."""
        rows = results.read_rows(folder / ROWS, study.row)
        if not rows:
            raise InputError(f"there are no rows to draw: '{folder / ROWS}'")
        _show(console, study, rows, folder)
        console.print(f"drawn again: {folder}", soft_wrap=True)
        return codes.FEASIBLE


def _show(console: Console, study: studies.Study, rows: list[Any], folder: Path) -> None:
    """Write and print the tables, write the figure; without Matplotlib say that there is none."""
    found = frame(rows)
    tables = study.tables(found)
    shown = [report.rows_table(title, lines) for title, lines in tables.items()]
    for table in shown:
        console.print(table)
        console.print()
    parts = [f"## {title}\n\n{report.markdown(lines)}" for title, lines in tables.items()]
    try:
        for suffix, content in plots.draw(study.panels(found), study.caption).items():
            results.write_bytes(folder / f"figure.{suffix}", content)
        parts.append(f"## Figure\n\n![{study.question}](figure.svg)\n\n{study.caption}\n")
    except InputError as error:
        console.print(f"no figure: {error}", soft_wrap=True)
    results.write_text(folder / "table.md", "\n".join(parts))
    results.write_text(folder / "table.txt", "\n".join(map(report.text, shown)))
