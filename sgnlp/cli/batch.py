"""`sgnlp batch`: a plan for each of many clouds, resumable, on this machine or a dask cluster."""

import json
import os
import time
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, field
from functools import partial
from math import isnan
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console

from sgnlp.base.checked import POSITIVE
from sgnlp.base.errors import InputError, MachineError, SolverError
from sgnlp.base.exclusive import alone
from sgnlp.cli import codes, compiling, lacks
from sgnlp.cli.flags import ROWS, Abstaining, Ended, Extending, Observing, Surrounding, Tabling, made
from sgnlp.cli.progress import Bar, bars
from sgnlp.hand.arm import available_arms
from sgnlp.hand.hand import Hand, available_hands, told
from sgnlp.planning import results
from sgnlp.planning.batch import Row, Task, batch
from sgnlp.planning.confidence import refusal
from sgnlp.planning.made import resumed
from sgnlp.planning.workers import Workers
from sgnlp.show import tables

MADE = "made.json"
STUDY = ("seed", "starts", "first", "deadline", "rounds", "widen", "solver", "reading", "settings")
"""The flags that the rows depend on."""


@dataclass(kw_only=True)
class Batch(Abstaining, Ended, Extending, Surrounding, Tabling, Observing):
    """Plan grasps for many clouds, each into its own folder; run it again to continue where it ended."""

    files: tyro.conf.Positional[tuple[Path, ...]]
    """the clouds, as for `sgnlp solve`"""
    jobs: Annotated[int, POSITIVE] = field(default_factory=lambda: os.cpu_count() or 1)
    """objects at the same time; on a cluster, as many as it has workers"""
    backend: Literal["loky", "dask"] = "loky"
    """processes of this machine, or a dask cluster that sees the same files"""
    scheduler: str | None = None
    """address of the dask scheduler, such as tcp://host:8786"""
    build: bool = True
    """compile the functions first, where there are so many starts that it pays; not on a cluster"""
    results: Path = Path("results")
    """where each object has the folder of its result"""
    out: Path | None = None
    """folder of the table of all objects; batch among the results if not given"""

    def run(self, console: Console) -> int:
        """Every object that has no result yet, a row as each ends, then the table."""
        files, begin, out = list(dict.fromkeys(self.files)), time.perf_counter(), self.out or self.results / "batch"
        if not any(file.is_file() for file in files):
            said = f"{files[0]} is a folder; give its files, {files[0]}/*.npz" if files and files[0].is_dir() else ""
            said = said or (f"{files[0]} is not there" if files else "no file is given")
            raise InputError(f"there is nothing to solve: {said}")
        hand = self.robot
        results.writable(self.results)
        results.writable(out)
        workers = self._workers()
        with ExitStack() as locked:
            folders = {out.resolve(): (out, "--out"), self.results.resolve(): (self.results, "--results")}
            for folder, flag in folders.values():
                locked.enter_context(alone(folder, flag))
            made = self._made(hand)
            if (out / ROWS).is_file():
                made = resumed(out / MADE, made)
            results.write_text(out / MADE, results.json_text(made))
            rows = self._rows(console, files, out, hand, workers)
        least = self.min_confidence
        _show(console, list(rows.values()), time.perf_counter() - begin, least)
        console.print(f"written: {', '.join(str(out / name) for name in (*self.tables, MADE))}", soft_wrap=True)
        accepted = (row.feasible and not refusal(row.confidence, least) for row in rows.values())
        return codes.FEASIBLE if all(accepted) else codes.NONE_FEASIBLE

    def _rows(
        self, console: Console, files: Sequence[Path], out: Path, hand: Hand, workers: Workers
    ) -> dict[Path, Row]:
        """The row of every file, written as they come."""
        lacks.tell(console)
        if lacking := workers.lacking():
            console.print(lacking, soft_wrap=True)
        rows: dict[Path, Row] = {}
        with bars(console) as bar:
            read, solved = bar("reading", len(files)), bar("solving", len(files))
            prepare = partial(self._prepare, console, bar, hand)
            planned = batch(files, self._task(), self.results, workers, progress=read.advance, before=prepare)
            with closing(planned) as ended:
                for row in ended:
                    rows[Path(row.file)] = row
                    self.write(out, [rows[file] for file in files if file in rows])
                    solved.advance(row)
        return {file: rows[file] for file in files}

    def _prepare(self, console: Console, bar: Callable[[str, int | None], Bar], hand: Hand, objects: int) -> None:
        """Compile first, where that pays; the machines of a cluster have caches of their own."""
        around = self.surroundings.around(self.settings, hand.arm is not None)
        if self.scheduler or not self.build or not compiling.worthwhile(hand, self, objects * self.starts, around):
            return
        console.print("Compiling the functions first, once for all objects (--no-build leaves them interpreted).")
        try:
            compiling.build(hand, self.additions.structures(self.settings, around), self.jobs, bar)
        except (SolverError, MachineError) as error:
            console.print(f"The functions stay interpreted: {error}", soft_wrap=True)

    def _task(self) -> Task:
        """The task of the workers. They may run elsewhere, so the folders of a hand and an arm are absolute paths."""
        return Task(
            hand=_anywhere(self.hand, available_hands()),
            arm=self.arm and _anywhere(self.arm, available_arms()),
            arm_base=self.arm_base,
            settings=self.settings,
            count=self.starts,
            seed=self.seed,
            timeout=self.timeout,
            ending=self.ending,
            solver=self.solver,
            reading=self.reading,
            extension=self.extension,
            surroundings=self.surroundings,
        )

    def _workers(self) -> Workers:
        if (self.backend == "dask") != (self.scheduler is not None):
            raise InputError("--backend dask and --scheduler ADDRESS go together")
        return Workers(self.jobs, self.scheduler)

    def _made(self, hand: Hand) -> dict[str, Any]:
        """How the rows are made; they depend on `study` and on the clouds."""
        flags = {key: value for key, value in asdict(self).items() if key != "files"}
        study = {key: flags[key] for key in STUDY}
        study |= {"hand": hand.name, "arm": told(hand), "surroundings": self.surroundings.plain()}
        study |= {"with": self.extension.digest if self.extension else None}
        plain = json.loads(json.dumps({"batch": flags, "study": study}, default=str))
        return made(**plain)


def _anywhere(name_or_folder: str, known: Collection[str]) -> str:
    return name_or_folder if name_or_folder in known else str(Path(name_or_folder).absolute())


def _known(value: float, digits: int) -> str:
    """A number; nothing where there is none."""
    return "" if isnan(value) else f"{value:.{digits}f}"


def _show(console: Console, rows: Sequence[Row], seconds: float, least: float) -> None:
    told = not all(isnan(row.confidence) for row in rows)
    lines = [
        {
            "object": row.name,
            "feasible": "yes" if row.feasible else "no",
            "starts": f"{row.feasible_starts}/{row.starts}",
            "margin": _known(row.margin, 3),
        }
        | ({"confidence": _known(row.confidence, 2)} if told else {})
        | {
            "energy": _known(row.energy, 1),
            "time [s]": _known(row.seconds, 2),
        }
        for row in rows
    ]
    feasible, reused = sum(row.feasible for row in rows), sum(row.reused for row in rows)
    console.print(tables.rows_table("Objects", lines))
    console.print()
    for row in rows:
        if row.failure:
            console.print(f"{row.name}: {row.failure}", soft_wrap=True)
    there = f", {reused} solved before" if reused else ""
    console.print(f"{feasible} of {len(rows)} objects have a feasible grasp{there}, in {seconds:.1f} s")
    if refused := [row.name for row in rows if row.feasible and refusal(row.confidence, least)]:
        said = f"do not carry these out, whose confidence is below --min-confidence {least:g} or unknown"
        console.print(f"abstained: {said}: {', '.join(refused)}", soft_wrap=True)
