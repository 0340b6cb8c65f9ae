"""Pictures of a study's failed trials, each with the reasons, on a page."""

import io
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

from sgnlp.cli.progress import Bar
from sgnlp.experiments.studies.failures import Failed
from sgnlp.experiments.studies.trials import LOADS
from sgnlp.planning import results
from sgnlp.show import simulation_pictures, tables
from sgnlp.simulation import command, true_body

FOLDER, PAGE = "failures", "failures.md"
SIZE = 240  # pixels of each of the three views
QUALITY = 85  # of the JPEG pictures, in percent


def write(console: Console, folder: Path, failed: Iterable[Failed], bar: Bar) -> None:
    """Write the page and the pictures of how each trial ended; without OpenGL the page alone."""
    lines = []
    for i, trial in enumerate(failed):
        picture = ""
        try:
            picture = _picture(folder, trial)
        except simulation_pictures.NoRenderer as error:
            if i == 0:
                console.print(f"no pictures: {error}", soft_wrap=True)
        line = {name: getattr(trial.row, name) for name in ("object", "condition", "load", "ending")}
        lines.append(line | {"what did not go as planned": "; ".join(trial.reasons), "how it ended": picture})
        bar.advance(trial)
    results.write_text(folder / PAGE, tables.markdown(lines) if lines else "Nothing failed.\n")


def _picture(folder: Path, trial: Failed) -> str:
    """Write the last phase that was reached; how a page shows it, or nothing where there was no grasp."""
    if trial.outcome is None:
        return ""
    from PIL import Image

    truth, hand = true_body(trial.plan.observation), trial.plan.problem.hand
    told, settings = command(trial.plan.arrays()), LOADS[trial.row.load]
    drawn = simulation_pictures.images(told, truth, hand, settings, trial.outcome.trace, SIZE)
    phase, image = list(drawn.items())[-1]
    lines = [trial.row.condition, *simulation_pictures.told(phase, settings, trial.outcome)]
    image = simulation_pictures.titled(image, f"{trial.row.object}, grasp 0 carried out", lines, hand)
    content = io.BytesIO()
    Image.fromarray(image).save(content, "JPEG", quality=QUALITY)
    results.write_bytes(folder / FOLDER / f"{trial.name}.jpg", content.getvalue())
    return f"![{trial.name}]({FOLDER}/{trial.name}.jpg)"
