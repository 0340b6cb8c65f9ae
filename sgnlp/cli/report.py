"""`sgnlp report`: a page about a result."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from sgnlp.base.errors import InputError
from sgnlp.cli import again, codes
from sgnlp.cli.simulate import PICTURE, SIMULATION
from sgnlp.planning import reopen, results
from sgnlp.planning.archive import read_archive
from sgnlp.planning.grasps import Grasps
from sgnlp.show.png import drawable
from sgnlp.show.report import content, pages
from sgnlp.show.simulation_pictures import PHASES

COURSES = ("formulation", "start", "energy", "primal")
"""The arrays of `history.npz` that are drawn."""
HTML, MARKDOWN = "report.html", "report.md"


@dataclass
class Report:
    """Write report.html and report.md into a result: pictures, tables, figures, cautions. Needs the extra `view`."""

    folder: tyro.conf.Positional[Path]
    """a result of `sgnlp solve`"""
    object: Path | None = None
    """the file that was solved, if it is elsewhere now"""
    hand: str | None = None
    """folder of the hand, if `sgnlp hands` does not list it"""

    def run(self, console: Console) -> int:
        """Read the result, rebuild its problem, write the pages."""
        files = write(self.folder, self.object, self.hand)
        console.print(f"written: {', '.join(map(str, files))}", soft_wrap=True)
        return codes.FEASIBLE


def write(folder: Path, file: Path | None = None, hand: str | None = None) -> list[Path]:
    """Write both reports into the folder of a result, and return their paths.

    Raises:
        InputError: there is no result, it has no grasps, a file beside it is damaged or of another plan, or the drawing
            packages are not installed.
    """
    drawable("skimage")
    result = reopen.reopen(folder, file, hand)
    folder = folder if folder.is_dir() else folder.parent
    summary = results.load_summary(folder, result.grasps)
    command = again.command(result.grasps.meta, folder)
    courses, simulated = _courses(folder / results.HISTORY, result.grasps), _simulated(folder, result.grasps)
    report = content.report(result, summary, courses, command, simulated)
    text, pictures = pages.markdown(report)
    results.write_files(folder, pictures | {MARKDOWN: results.encoded(text), HTML: results.encoded(pages.html(report))})
    return [folder / HTML, folder / MARKDOWN]


def _courses(file: Path, grasps: Grasps) -> dict[str, Any]:
    """The arrays of `history.npz`; empty for results of older versions, which have none."""
    if not file.is_file():
        return {}
    try:
        plan, found = read_archive(file, "a history of sgnlp", _rows)
    except InputError as error:
        raise InputError(f"{error}; delete it, or solve again") from None
    results.check_plan(file, plan, grasps)
    return found


def _rows(data: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    """The digest of the plan, "" if it is not told, and the arrays."""
    found = {name: data[name] for name in COURSES}
    if len({array.shape for array in found.values()}) != 1 or found["start"].ndim != 1:
        raise ValueError("its arrays differ in length")
    return str(data["plan"]) if "plan" in data else "", found


def _simulated(folder: Path, grasps: Grasps) -> content.Section | None:
    """The section on the simulation of these grasps, if there was one."""
    file = folder / SIMULATION
    if not file.is_file():
        return None
    try:
        found = dict(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        raise InputError(f"'{file}' is no outcome of sgnlp simulate; delete it, or simulate again") from None
    results.check_plan(file, found.get("plan"), grasps)
    pictures = {phase: folder / PICTURE.format(phase) for phase in PHASES}
    drawn = {phase: picture.read_bytes() for phase, picture in pictures.items() if picture.is_file()}
    own = found.get("pictures", {})
    return content.simulation(
        found, {p: png for p, png in drawn.items() if sha256(png).hexdigest() == own.get(PICTURE.format(p))}
    )
