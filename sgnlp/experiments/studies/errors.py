"""How much error a first choice tolerates: a displaced hand, and an object with another weight or friction.

Each plan is made once, from two views, and carried out under one deviation at a time from the nominal trial, with the
load of the preset `robust` and the hand in its planned place. The errors' directions differ from object to object.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import nan
from pathlib import Path
from typing import Any
from zlib import crc32

from sgnlp.base.presets import PRESETS, VARIANTS
from sgnlp.experiments.frames import Frame, Lines, Tables, percent, pick, wilson
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.experiments.studies.trials import Condition
from sgnlp.perception.observation import Observation
from sgnlp.show.plots import Panel, Series
from sgnlp.simulation import Outcome, SimulationSettings

CAMERAS = 2
NOMINAL = SimulationSettings(mass=0.3, friction=0.6, push_weights=0.0)
CONDITIONS = (
    Condition("robust", CAMERAS),
    Condition("paper", CAMERAS, lambda _: PRESETS["paper"]),
    *(Condition(name, CAMERAS, VARIANTS[name]) for name in ("bilevel-high", "bilevel-low", "bilevel-heuristic")),
)
"""The first is planned with the settings of the command line, by default those of `robust`."""


@dataclass(frozen=True)
class Axis:
    """What deviates from the nominal trial, in which unit, and how far."""

    label: str
    values: tuple[float, ...]
    deviate: Callable[[SimulationSettings, float], SimulationSettings]


AXES = {
    "place": Axis("error of the hand's place [mm]", (0, 5, 10, 20), lambda s, v: replace(s, place_error=1e-3 * v)),
    "turn": Axis("error of the hand's turn [deg]", (0, 5, 10), lambda s, v: replace(s, turn_error=v)),
    "mass": Axis("mass [kg]", (0.1, 0.3, 0.5, 1.0), lambda s, v: replace(s, mass=v)),
    "friction": Axis("friction", (0.3, 0.6, 1.0), lambda s, v: replace(s, friction=v)),
}
SCORES = {"score": "success [%]", "strict": "risen by 4 cm [%]"}


@dataclass(frozen=True)
class Row(trials.Row):
    """A trial, and the axis on which it deviates from the nominal one; each axis has the nominal value, too."""

    axis: str = ""
    value: float = nan


def trial(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The rows of one object in one condition, one for each value of each axis; equal trials are carried out once."""
    plan = trials.planned(setup, file, condition, views)
    row, done = Row(load="", **trials.told(plan, condition, views)), dict[SimulationSettings, Outcome]()
    nominal, rows = replace(NOMINAL, seed=setup.seed + crc32(row.object.encode())), []
    for name, value, settings in deviations(nominal):
        if plan.best is not None and settings not in done:
            done[settings] = trials.carried_out(plan, settings)
        found = trials.measured(done[settings]) if plan.best is not None else {}
        rows.append(replace(row, load=f"{name} {value:g}", axis=name, value=float(value), **found))
    return rows


def deviations(nominal: SimulationSettings) -> Iterator[tuple[str, float, SimulationSettings]]:
    """Every value of every axis, and the settings of its trial."""
    for name, axis in AXES.items():
        for value in axis.values:
            yield name, value, axis.deviate(nominal, value)


def facts(setup: Setup) -> dict[str, Any]:
    """What the rows depend on."""
    axes = {name: list(axis.values) for name, axis in AXES.items()}
    return setup.facts() | trials.changes(CONDITIONS, setup) | {"nominal": asdict(NOMINAL), "axes": axes}


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """A case for each object and preset."""
    return trials.cases(CONDITIONS, setup, observations, trial)


def tables(rows: Frame) -> Tables:
    """A table for each axis and score."""
    return {
        f"{text.removesuffix(' [%]').capitalize()} in percent, {axis.label}": table(rows, name, score)
        for score, text in SCORES.items()
        for name, axis in AXES.items()
    }


def table(rows: Frame, axis: str, score: str) -> Lines:
    """A line for each preset: the score in percent with its interval at each value of an axis."""
    return [
        {"preset": condition.name}
        | {f"{value:g}": percent(own[score].sum(), len(own)) for value, own in _at(rows, condition.name, axis)}
        for condition in CONDITIONS
    ]


def panels(rows: Frame) -> list[Panel]:
    """Both scores against each axis, a line for each preset with its interval."""
    return [
        Panel(f"{name} error" if name in ("place", "turn") else name, axis.label, text, _series(rows, name, score))
        for score, text in SCORES.items()
        for name, axis in AXES.items()
    ]


def _series(rows: Frame, axis: str, score: str) -> tuple[Series, ...]:
    return tuple(_curve(rows, condition.name, axis, score) for condition in CONDITIONS)


def _curve(rows: Frame, condition: str, axis: str, score: str) -> Series:
    found = [(value, own[score]) for value, own in _at(rows, condition, axis)]
    spans = [wilson(own.sum(), len(own)) for _, own in found]
    low, high = ([100 * end for end in ends] for ends in zip(*spans, strict=True))
    return Series(condition, [value for value, _ in found], [100 * own.mean() for _, own in found], low, high)


def _at(rows: Frame, condition: str, axis: str) -> list[tuple[float, Frame]]:
    found = pick(rows, condition=condition, axis=axis)
    return [(value, pick(found, value=float(value))) for value in AXES[axis].values]


STUDY = Study(
    question="how much does the first choice bear: a hand that stands wrong, another weight, another friction?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=panels,
    facts=facts,
    caption=(
        "Success of the first choice from two views against one deviation at a time from 0.3 kg, friction 0.6 and the "
        "hand in its place, and the share that has risen by 4 cm, with Wilson's 95 % intervals."
    ),
)
