"""`sgnlp benchmark`: where the time goes, with command, versions and machine beside the rows."""

import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import tyro
from rich.console import Console

from sgnlp.base.checked import POSITIVE
from sgnlp.base.errors import InputError
from sgnlp.cli.flags import Starting, made
from sgnlp.cli.interrupts import check
from sgnlp.experiments import benchmarks
from sgnlp.experiments.benchmarks.measure import Bench, Row
from sgnlp.planning import results
from sgnlp.show import tables as report

Section = Literal[
    "startup",
    "oracle",
    "surface",
    "solving",
    "whole",
    "replanning",
    "ratios",
    "points",
    "starts",
    "objects",
    "many",
    "cluster",
    "earlier",
]
PROBLEMS = Path("problems")  # default folder of the clouds


@dataclass(kw_only=True)
class Benchmark(Starting):
    """Measure fit, build, oracle, solves, memory, ratios and growth over some clouds, and write table and raw rows."""

    files: tyro.conf.Positional[tuple[Path, ...]] = ()
    """the clouds; problems/*_0.npz if not given"""
    sections: tuple[Section, ...] = get_args(Section)
    """what to measure; everything takes half an hour or more"""
    repeats: Annotated[int, POSITIVE] = 5
    """number of values of each measurement"""
    objects: Annotated[int, POSITIVE] = 1000
    """number of objects in the section many, made from the clouds by turning and scaling them"""
    jobs: Annotated[int, POSITIVE] = 2
    """number of worker processes in sections with several"""
    earlier: Path | None = None
    """a checkout of an earlier version, for the section `earlier`"""
    out: Path = field(default_factory=lambda: Path("results") / "benchmark")
    """folder of the results"""

    def run(self, console: Console) -> int:
        """Measure section by section, each row written as it comes, then the tables."""
        files = self.files or tuple(sorted(PROBLEMS.glob("*_0.npz")))
        if not files:
            raise InputError(f"no cloud is named, and there is none in '{PROBLEMS}'")
        numbers = {name: getattr(self, name) for name in ("starts", "seed", "jobs", "repeats", "objects")}
        if self.earlier and not (self.earlier / "sgnlp" / "cli").is_dir():
            raise InputError(f"--earlier: there is no checkout of sgnlp in '{self.earlier}'")
        before = self.earlier and self.earlier.resolve()
        bench = Bench(files, self.hand, self.preset, self.settings, **numbers, earlier=before)
        how = self._made(bench)
        results.writable(self.out)
        results.write_text(self.out / "made.json", results.json_text(how))
        rows: list[Row] = []
        with console.status("compiling the functions") as status:
            bench.ready()
            for row in benchmarks.measured(bench, self.sections):
                check()
                rows.append(row)
                results.write_rows(self.out / "rows.csv", rows)
                status.update(f"{len(rows)} measured, the last: {row.name}")
        tables = benchmarks.tables(rows)
        texts = [f"## {question}\n\n{report.markdown(lines)}" for question, lines in tables.items()]
        results.write_text(self.out / "table.md", "\n".join(texts))
        for question, lines in tables.items():
            console.print(report.rows_table(question, lines))
            console.print()
        console.print(f"written: {self.out}", soft_wrap=True)
        return 0

    def _made(self, bench: Bench) -> dict[str, Any]:
        numbers = ("sections", "repeats", "objects", "starts", "seed", "jobs")
        study = {name: getattr(self, name) for name in numbers}
        study |= {"earlier": bench.earlier_commit, "hand": bench.hand.name, "settings": asdict(self.settings)}
        inputs = {observation.name: observation.digest for observation in bench.observations}
        how = made(study=study, inputs=inputs, functions="compiled C" if bench.compiles else "interpreted")
        how["machine"] |= {"processors": os.cpu_count(), "load before": os.getloadavg()}
        return how
