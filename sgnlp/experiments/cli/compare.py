"""`sgnlp compare`: solvers on the same problems from the same starts, judged by recomputed residuals, resumable."""

import json
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import tyro
from rich.console import Console

from sgnlp.base.checked import POSITIVE, Interval
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Formulation
from sgnlp.cli import codes, compiling, lacks
from sgnlp.cli.flags import ROWS, Starting, Tabling, made
from sgnlp.cli.progress import Bar, bars
from sgnlp.experiments.compare import carried, page
from sgnlp.experiments.compare.route import Run
from sgnlp.experiments.compare.row import Row
from sgnlp.experiments.compare.runs import rows_of
from sgnlp.experiments.compare.table import Table
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Setup, collect
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import Observation
from sgnlp.planning import results
from sgnlp.planning.additions import Additions
from sgnlp.planning.solvers import SOLVERS, solver_named
from sgnlp.planning.workers import Workers
from sgnlp.program.formulations import formulation as formulation_named
from sgnlp.show import plots, tables

MADE, SIMULATED = "made.json", "simulated.csv"
EVERY = "all"
"""In the place of the solvers' names."""


@dataclass(kw_only=True)
class Compare(Tabling, Starting):
    """Compare solvers on the same problems from the same starts; run again, it goes on where it ended."""

    valid: ClassVar[dict[str, Interval]] = Starting.valid | {"time_limit": POSITIVE, "repeats": POSITIVE}

    files: tyro.conf.Positional[tuple[Path, ...]] = ()
    """the clouds"""
    solvers: tuple[str, ...] = ()
    """names of `sgnlp solvers`, or `all`; all but those known to fail here if none is named"""
    formulations: tuple[Formulation, ...] = ("penalty", "constrained")
    """what is solved"""
    starts: int = 3
    """initial guesses for a cloud, the same for every solver; more of them later are added"""
    time_limit: float = 3.0
    """processor time of a solve at most [s]; what takes longer has failed"""
    repeats: int = 2
    """solves of each start in one process, the first of them cold; a failure is not repeated"""
    tolerances: tuple[float, ...] = (1e-3, 1e-6)
    """residuals of the problem as posed to be reached, each by a run that asks for a tenth of it"""
    simulate: bool = False
    """carry out each solver's first choice for each object in simulation too; pip install 'sgnlp[sim]'"""
    out: Path = Path("results/solvers")
    """folder of the results"""
    redraw: bool = False
    """only make the report anew, from the rows that are there"""

    def __post_init__(self) -> None:
        """Also that tolerances are positive."""
        super().__post_init__()
        if not self.tolerances or min(self.tolerances) <= 0:
            raise InputError("--tolerances must be positive numbers")

    def run(self, console: Console) -> int:
        """Every run that has no rows yet, then the report over all."""
        if not self.redraw:
            self._work(console)
        rows = results.read_rows(self.out / ROWS, Row)
        if not rows:
            raise InputError(f"there are no rows to report: '{self.out / ROWS}'")
        if self.parquet:
            results.write_parquet(self.out / "rows.parquet", rows)
        self._report(console, rows)
        console.print(f"written: {self.out}", soft_wrap=True)
        return codes.FEASIBLE

    def _work(self, console: Console) -> None:
        names = self._names()
        if not self.files:
            raise InputError("there is nothing to compare on: no file is named")
        results.writable(self.out)
        hand = load_hand(self.hand, self.settings.spheres)
        observations = Setup(self.files, self.hand, self.settings, self.starts, self.seed, 0.0).observations()
        inputs = {observation.name: observation.digest for observation in observations}
        how = results.resumed(self.out / MADE, made(study=self._facts(), inputs=inputs))
        results.read_rows(self.out / ROWS, Row)
        lacks.tell(console)
        with bars(console) as bar:
            if self.settings.solver.compiled:
                for formulation in self.formulations:
                    structures = Additions(formulation=formulation_named(formulation)).structures(self.settings)
                    compiling.build(hand, structures, self.jobs, bar)
            results.write_text(self.out / MADE, results.json_text(how))
            self._collect(console, self._cases(observations, names), Row, ROWS, bar("compare", None))
            if self.simulate:
                rows = Table(results.read_rows(self.out / ROWS, Row))
                cases = carried.cases(rows, self._runs(observations, names))
                self._collect(console, cases, carried.Row, SIMULATED, bar("simulate", None))

    def _names(self) -> tuple[str, ...]:
        if self.solvers == (EVERY,):
            return tuple(SOLVERS)
        for name in self.solvers:
            solver_named(name)
        return self.solvers or tuple(name for name, entry in SOLVERS.items() if not entry.known)

    def _facts(self) -> dict[str, Any]:
        """What rows depend on, beside clouds, solvers, formulations and starts, which can be added to."""
        facts = {"seed": self.seed, "hand": self.hand, "settings": asdict(self.settings)} | trials.loads()
        return facts | {"time_limit": self.time_limit, "repeats": self.repeats, "tolerances": self.tolerances}

    def _runs(self, observations: list[Observation], names: tuple[str, ...]) -> dict[tuple[str, ...], Run]:
        return {
            (whole.name, formulation, name, str(start)): Run(
                file=file,
                hand=self.hand,
                settings=self.settings,
                seed=self.seed,
                formulation=formulation,
                solver=name,
                start=start,
                tolerances=self.tolerances,
                repeats=self.repeats,
                limit=self.time_limit,
            )
            for file, whole in zip(self.files, observations, strict=True)
            for formulation in self.formulations
            for start in range(self.starts)
            for name in names
        }

    def _cases(self, observations: list[Observation], names: tuple[str, ...]) -> list[Case]:
        return [Case(key, partial(rows_of, run)) for key, run in self._runs(observations, names).items()]

    def _collect(self, console: Console, cases: list[Case], row: type[Any], file: str, bar: Bar) -> None:
        if not cases:
            return
        with closing(Workers(self.jobs)) as workers:
            _, broken = collect(row, cases, self.out / file, workers, bar.move)
        for case, reason in broken.items():
            console.print(f"failed: {case}: {reason}", soft_wrap=True)

    def _report(self, console: Console, rows: list[Row]) -> None:
        table, how = Table(rows), json.loads((self.out / MADE).read_text(encoding="utf-8"))
        simulated = results.read_rows(self.out / SIMULATED, carried.Row)
        for title, lines in page.tables(table).items():
            console.print(tables.rows_table(title, lines))
            console.print()
        for sentence in page.verdicts(table):
            console.print(sentence, soft_wrap=True)
        results.write_text(self.out / "report.md", page.page(table, how, simulated))
        try:
            for name, panels in page.figures_of(table).items():
                for suffix, content in plots.draw(panels, page.CAPTIONS[name], columns=2).items():
                    results.write_bytes(self.out / f"{name}.{suffix}", content)
        except InputError as error:
            console.print(f"no figures: {error}", soft_wrap=True)
