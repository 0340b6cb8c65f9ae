"""`sgnlp compare`: solvers on the same problems from the same starts, judged by recomputed residuals, resumable."""

import json
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from sgnlp.base.checked import POSITIVE, Positive
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Formulation
from sgnlp.cli import codes, compiling, lacks
from sgnlp.cli.flags import PARQUET, ROWS
from sgnlp.cli.progress import bars
from sgnlp.experiments.cli.collecting import MADE, Collecting
from sgnlp.experiments.compare import carried, page
from sgnlp.experiments.compare.route import Run
from sgnlp.experiments.compare.row import Row
from sgnlp.experiments.compare.runs import rows_of
from sgnlp.experiments.compare.table import Table
from sgnlp.experiments.compare.verdict import verdicts
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Key, Setup
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import Observation
from sgnlp.planning import results
from sgnlp.planning.additions import Additions
from sgnlp.planning.solvers import SOLVERS, solver_named
from sgnlp.program.formulations import formulation as formulation_named
from sgnlp.show import plots, tables

SIMULATED = "simulated.csv"
EVERY = "all"  # instead of the solvers' names


@dataclass(kw_only=True)
class Compare(Collecting):
    """Compare solvers on the same problems from the same starts. Run it again to resume.

    It needs pandas: pip install 'sgnlp[experiments]'.
    """

    files: tyro.conf.Positional[tuple[Path, ...]] = ()
    """the clouds"""
    solvers: tuple[str, ...] = ()
    """names from `sgnlp solvers`, or `all`; if not given, all but those known to fail here"""
    formulations: tuple[Formulation, ...] = ("penalty", "constrained")
    """what is solved"""
    starts: Annotated[int, POSITIVE] = 3
    """number of initial guesses for a cloud, the same for every solver; a later run may add more"""
    time_limit: Positive = 3.0
    """limit of a solve's processor time [s]; a solve that takes longer has failed"""
    repeats: Annotated[int, POSITIVE] = 2
    """number of solves of each start in one process, the first of them cold; a failure is not repeated"""
    tolerances: tuple[float, ...] = (1e-3, 1e-6)
    """residuals to reach on the problem as posed; the solver gets a tenth of each as its tolerance"""
    simulate: bool = False
    """also carry out each solver's first choice for each object in simulation; pip install 'sgnlp[sim]'"""
    out: Path = Path("results/solvers")
    """folder of the results"""

    def __post_init__(self) -> None:
        """Also that tolerances are positive."""
        super().__post_init__()
        if not self.tolerances or min(self.tolerances) <= 0:
            raise InputError("--tolerances must be positive numbers")

    def run(self, console: Console) -> int:
        """Every run that has no rows yet, then the report over all."""
        frame([])  # refuse before any work if pandas is missing
        if not self.redraw:
            self._work(console)
        rows = results.read_rows(self.out / ROWS, Row)
        if not rows:
            raise InputError(f"there are no rows to report: '{self.out / ROWS}'")
        if self.parquet:
            results.write_parquet(self.out / PARQUET, rows)
        self._report(console, Table(rows))
        console.print(f"written: {self.out}", soft_wrap=True)
        return codes.FEASIBLE

    def _work(self, console: Console) -> None:
        for name in () if self.solvers == (EVERY,) else self.solvers:
            solver_named(name)
        if not self.files:
            raise InputError("there is nothing to compare on: no file is named")
        results.writable(self.out)
        hand = load_hand(self.hand, self.settings.spheres)
        observations = Setup(self.files, self.hand, self.settings, self.starts, self.seed, 0.0).observations()
        self.begin(self.out, self._facts(), observations, Row)
        lacks.tell(console)
        runs = self._runs(observations)
        with bars(console) as bar:
            for name in self.formulations if self.settings.solver.compiled else ():
                structures = Additions(formulation=formulation_named(name)).structures(self.settings)
                compiling.build(hand, structures, self.jobs, bar)
            cases = [Case(key, partial(rows_of, run)) for key, run in runs.items()]
            if cases:
                rows, _ = self.collected(console, Row, cases, self.out / ROWS, bar("compare", None), self.jobs)
            if cases and self.simulate:
                cases = carried.cases(Table(rows), runs)
                self.collected(console, carried.Row, cases, self.out / SIMULATED, bar("simulate", None), self.jobs)

    def _facts(self) -> dict[str, Any]:
        """What rows depend on, beside clouds, solvers, formulations and starts, which can be added to."""
        facts = {"seed": self.seed, "hand": self.hand, "settings": asdict(self.settings)} | trials.loads()
        return facts | {"time_limit": self.time_limit, "repeats": self.repeats, "tolerances": self.tolerances}

    def _runs(self, observations: list[Observation]) -> dict[Key, Run]:
        known_good = tuple(name for name, entry in SOLVERS.items() if not entry.known)
        names = tuple(SOLVERS) if self.solvers == (EVERY,) else self.solvers or known_good
        given = (self.hand, self.settings, self.seed, self.tolerances, self.repeats, self.time_limit)
        return {
            (whole.name, formulation, name, str(start)): Run(file, formulation, name, start, *given)
            for file, whole in zip(self.files, observations, strict=True)
            for formulation in self.formulations
            for start in range(self.starts)
            for name in names
        }

    def _report(self, console: Console, table: Table) -> None:
        for title, lines in page.tables(table).items():
            console.print(tables.rows_table(title, lines))
            console.print()
        for sentence in verdicts(table):
            console.print(sentence, soft_wrap=True)
        how = json.loads((self.out / MADE).read_text(encoding="utf-8"))
        simulated = results.read_rows(self.out / SIMULATED, carried.Row)
        results.write_text(self.out / "report.md", page.page(table, how, simulated))
        try:
            for name, panels in page.figures_of(table).items():
                for suffix, content in plots.draw(panels, page.CAPTIONS[name], columns=2).items():
                    results.write_bytes(self.out / f"{name}.{suffix}", content)
        except InputError as error:
            console.print(f"no figures: {error}", soft_wrap=True)
