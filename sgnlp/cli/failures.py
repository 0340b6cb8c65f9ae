"""Pictures of a study's failed trials, each with the reasons, on a page."""

import io
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

from sgnlp import report, results
from sgnlp.cli import pictures
from sgnlp.cli.progress import Bar
from sgnlp.simulation import command, true_body
from sgnlp.studies.failures import Failed
from sgnlp.studies.trials import LOADS
from sgnlp.summary import arrays

FOLDER, PAGE = "failures", "failures.md"
SIZE = 240
"""Pixels of each of the three views."""
QUALITY = 85
"""Of the JPEG pictures, in percent."""


def write(console: Console, folder: Path, failed: Iterable[Failed], bar: Bar) -> None:
    """Write the page and the pictures of how each trial ended; without OpenGL the page alone."""
    lines = []
    for i, trial in enumerate(failed):
        try:
            picture = _picture(folder, trial)
        except pictures.NoRenderer as error:
            if i == 0:
                console.print(f"no pictures: {error}", soft_wrap=True)
            picture = ""
        row = trial.row
        line = {"object": row.object, "condition": row.condition, "load": row.load, "ending": row.ending}
        lines.append(line | {"what went otherwise than planned": "; ".join(trial.reasons), "how it ended": picture})
        bar.advance(trial)
    results.write_text(folder / PAGE, report.markdown(lines) if lines else "Nothing failed.\n")


def _picture(folder: Path, trial: Failed) -> str:
    """Write the last phase that was reached; how a page shows it, or nothing where there was no grasp."""
    if trial.outcome is None:
        return ""
    from PIL import Image

    truth, hand = true_body(trial.plan.observation), trial.plan.problem.hand
    told, settings = command(arrays(trial.plan)), LOADS[trial.row.load]
    drawn = pictures.images(told, truth, hand, settings, trial.outcome.trace, SIZE)
    phase, image = list(drawn.items())[-1]
    lines = [trial.row.condition, *pictures.told(phase, settings, trial.outcome)]
    image = pictures.titled(image, f"{trial.row.object}, grasp 0 carried out", lines, hand)
    content = io.BytesIO()
    Image.fromarray(image).save(content, "JPEG", quality=QUALITY)
    results.write_bytes(folder / FOLDER / f"{trial.name}.jpg", content.getvalue())
    return f"![{trial.name}]({FOLDER}/{trial.name}.jpg)"
