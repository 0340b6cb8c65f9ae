"""The paper's study of its weights: each is halved and doubled, on the paper's three objects.

Success of the first choice from two views, beside the paper's (its Tab. III).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import nan

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Lines
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.defaults import changed
from sgnlp.experiments.studies.study import Case, Setup, Study, body
from sgnlp.experiments.studies.trials import LOADS, Condition
from sgnlp.perception.observation import Observation
from sgnlp.show.plots import Panel, Series

OBJECTS = ("pear", "mustard", "cracker")
CAMERAS = 2
FACTORS = (0.5, 2.0)
AS_SET = "as set"
PAPER = {
    "sp": (0.80, 0.90),
    "dist": (0.83, 0.77),
    "uncer": (0.77, 0.83),
    "gain": (0.77, 0.83),
    "tar": (0.73, 0.77),
    "col": (0.93, 0.83),
    "reg": (0.77, 0.90),
    "force": (0.90, 0.83),
}
"""Success at half and at twice each weight; 0.83 as set."""
PAPER_AS_SET = 0.83


def scaled(name: str, factor: float, settings: Settings) -> Settings:
    """Settings with one weight scaled."""
    return changed(settings, {f"weights.{name}": factor * getattr(settings.weights, name)})


def _condition(name: str, factor: float) -> str:
    return f"{name} x {factor:g}"


CONDITIONS = (
    Condition(AS_SET, CAMERAS),
    *(Condition(_condition(n, f), CAMERAS, partial(scaled, n, f)) for n in PAPER for f in FACTORS),
)


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """The three objects with every weight changed; raises `InputError` if no cloud is of these objects."""
    chosen = [i for i, seen in enumerate(observations) if body(seen.name) in OBJECTS]
    if not chosen:
        raise InputError(f"the study of weights takes clouds of {', '.join(OBJECTS)}, such as {OBJECTS[0]}_0")
    ours = replace(setup, files=tuple(setup.files[i] for i in chosen))
    return trials.cases(CONDITIONS, ours, [observations[i] for i in chosen])


def table(load_name: str, rows: Frame) -> Lines:
    """A line for each weight: success in percent at half and twice it, and the paper's; the last line as set."""
    lines = [
        {"weight": f"w_{name}"}
        | {f"x {f:g}": trials.success(trials.of(rows, _condition(name, f), load_name)) for f in FACTORS}
        | {f"x {f:g}, paper": f"{100 * share:.0f}" for f, share in zip(FACTORS, theirs, strict=True)}
        for name, theirs in PAPER.items()
    ]
    as_set = trials.success(trials.of(rows, AS_SET, load_name))
    return [*lines, dict.fromkeys(lines[0], "") | {"weight": f"as set: {as_set}; paper: {100 * PAPER_AS_SET:.0f}"}]


def panels(rows: Frame) -> list[Panel]:
    """Success at half, once and twice each weight, a panel for each load."""
    shown, factors = [], ["0.5", "1", "2"]
    for load_name in LOADS:
        means = 100 * rows[rows.load == load_name].groupby("condition").score.mean()
        columns = ((name, (_condition(name, 0.5), AS_SET, _condition(name, 2))) for name in PAPER)
        series = tuple(Series(f"w_{name}", factors, [means.get(c, nan) for c in column]) for name, column in columns)
        shown.append(Panel(load_name, "factor on a weight", "success [%]", series, y_range=(0, 100)))
    return shown


STUDY = Study(
    question="how much does success depend on each weight?",
    row=trials.Row,
    cases=cases,
    tables=lambda rows: {f"Success in percent, {name}": table(name, rows) for name in LOADS},
    panels=panels,
    caption="Success of the first choice in simulation at half, once and twice each weight, under two loads.",
    facts=partial(trials.facts, CONDITIONS),
)
