"""The paper's study of computation time: 1 and 7 starts, ours and its bilevel baseline, in one process.

The cases run one at a time, whatever the number of jobs. The machine should have nothing else to do. The paper's times
are of an i7-13700K.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path

from sgnlp.base.presets import VARIANTS
from sgnlp.experiments.frames import Frame, Lines
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.experiments.studies.trials import Condition, feasible, planned
from sgnlp.perception.observation import Observation
from sgnlp.show.plots import Panel, Series

CAMERAS = 0  # all cameras
CONDITIONS = (Condition("ours", CAMERAS), Condition("bilevel", CAMERAS, VARIANTS["bilevel-high"]))
"""The gains of the bilevel baseline are the paper's high ones."""
REPEATS = 3
PAPER = {("ours", 7): 15.58, ("ours", 1): 7.02, ("bilevel", 7): 34.97, ("bilevel", 1): 9.17}
"""Seconds on its processor."""


@dataclass(frozen=True)
class Row:
    """A plan. `fit` and `solve` are the seconds of fitting the surface and of solving all starts in one process."""

    object: str
    condition: str
    starts: int
    repeat: int
    fit: float
    solve: float
    feasible: int


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object with one start and with as many as the setup says."""
    return [
        Case((whole.name, condition.name, str(count)), partial(repeated, replace(setup, starts=count), file, condition))
        for file, whole in zip(setup.files, observations, strict=True)
        for condition in CONDITIONS
        for count in sorted({1, setup.starts})
    ]


def repeated(setup: Setup, file: Path, condition: Condition) -> list[Row]:
    """The rows of an object. An untimed plan of one start comes first; it builds what all plans share."""
    planned(replace(setup, starts=1), file, condition, None, rounds=1)
    rows = []
    for repeat in range(REPEATS):
        plan = planned(setup, file, condition, None, rounds=1)
        key = (plan.observation.name, condition.name, setup.starts)
        rows.append(Row(*key, repeat, plan.seconds["fit"], plan.seconds["solve"], feasible(plan)))
    return rows


def medians(rows: Frame) -> Frame:
    """Seconds of `fit`, `solve` and the `whole` plan by condition, starts and object, over the repeats."""
    rows = rows.assign(whole=rows.fit + rows.solve).sort_values("starts", ascending=False, kind="stable")
    return rows.groupby(["condition", "starts", "object"], sort=False)[["fit", "solve", "whole"]].median()


def table(rows: Frame) -> Lines:
    """A line for each condition and number of starts: median seconds and their spread over the objects."""
    lines, plans = [], rows.groupby(["condition", "starts"])
    for (name, count), found in medians(rows).groupby(["condition", "starts"], sort=False):
        least, low, middle, high, most = found.whole.quantile([0, 0.25, 0.5, 0.75, 1])
        own = plans.get_group((name, count))
        line = {"condition": f"{name} ({count})", "objects": str(len(found)), "median [s]": f"{middle:.2f}"}
        line |= {"quartiles [s]": f"{low:.2f}-{high:.2f}", "range [s]": f"{least:.2f}-{most:.2f}"}
        line |= {f"{part} [s]": f"{found[part].median():.2f}" for part in ("fit", "solve")}
        line["feasible"] = f"{own.feasible.sum()} of {own.starts.sum()}"
        lines.append(line | {"paper [s]": f"{PAPER[name, count]:.2f}" if (name, count) in PAPER else "-"})
    return lines


def panels(rows: Frame) -> list[Panel]:
    """Median seconds with quartiles beside the paper's, for each condition and number of starts."""
    found = (
        medians(rows).whole.groupby(["condition", "starts"], sort=False).quantile([0.25, 0.5, 0.75]).unstack(sort=False)
    )
    names = [f"{condition} ({count})" for condition, count in found.index]
    ours = Series("here", names, list(found[0.5]), list(found[0.25]), list(found[0.75]))
    paper = Series("paper, i7-13700K", names, [PAPER.get(key, nan) for key in found.index])
    return [Panel("One process", "", "time of a plan [s]", (ours, paper), bars=True)]


STUDY = Study(
    question="how long does a plan take with 1 and 7 starts, against the paper's times?",
    row=Row,
    cases=cases,
    tables=lambda rows: {"Seconds of a plan in one process": table(rows)},
    panels=panels,
    caption="Median seconds of a plan in one process with their quartiles, beside the paper's.",
    alone=True,
)
