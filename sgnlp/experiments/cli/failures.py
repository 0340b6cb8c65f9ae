"""Pictures of a study's failed trials, each with the reasons, on a page."""

import io
from collections.abc import Iterable
from pathlib import Path

from sgnlp.cli.progress import Bar
from sgnlp.experiments.studies.failures import Failed
from sgnlp.experiments.studies.trials import LOADS
from sgnlp.planning import results
from sgnlp.show import tables
from sgnlp.show.png import picture
from sgnlp.show.simulation_pictures import scene
from sgnlp.simulation import command, true_body
from sgnlp.simulation.prepared import prepared

FOLDER, PAGE = "failures", "failures.md"
WIDTH = 720  # [px] of a picture
QUALITY = 85  # of the JPEG pictures, in percent


def write(folder: Path, failed: Iterable[Failed], bar: Bar) -> None:
    """Write the page and the pictures of how each trial ended."""
    lines = []
    for trial in failed:
        shown = _picture(folder, trial)
        line = {name: getattr(trial.row, name) for name in ("object", "condition", "load", "ending")}
        lines.append(line | {"what did not go as planned": "; ".join(trial.reasons), "how it ended": shown})
        bar.advance(trial)
    results.write_text(folder / PAGE, tables.markdown(lines) if lines else "Nothing failed.\n")


def _picture(folder: Path, trial: Failed) -> str:
    """Write the last phase that was reached; how a page shows it, or nothing where there was no grasp."""
    if trial.outcome is None:
        return ""
    from PIL import Image

    truth, hand = true_body(trial.plan.observation), trial.plan.problem.hand
    settings = LOADS[trial.row.load]
    told = prepared(command(trial.plan.arrays()), hand, settings)
    shown = scene(told, truth, settings, trial.outcome, f"{trial.row.object}, {trial.row.condition}")
    image = Image.open(io.BytesIO(picture(shown, len(shown.views) - 1, 0))).convert("RGB")
    image.thumbnail((WIDTH, image.height))
    content = io.BytesIO()
    image.save(content, "JPEG", quality=QUALITY)
    results.write_bytes(folder / FOLDER / f"{trial.name}.jpg", content.getvalue())
    return f"![{trial.name}]({FOLDER}/{trial.name}.jpg)"
