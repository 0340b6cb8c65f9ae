"""The gain of planning the hand at first contact, one step at a time, and how its settings were chosen.

Each plan is made from two views. It is carried out under both loads, and under the heavy one with the hand 20 mm beside
its planned place. The steps are chosen on the tuning half of the problems and judged on the held-out half.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from zlib import crc32

from sgnlp.base.presets import UNSURE
from sgnlp.base.settings import Settings, Weights
from sgnlp.experiments.frames import Frame, Lines, Tables
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.defaults import changed
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.experiments.studies.trials import LOADS, Condition, Row
from sgnlp.perception.observation import Observation

CAMERAS = 2
OFF = "0.3 kg, μ 0.6, 20 mm off"
TRIALS = LOADS | {OFF: replace(LOADS["0.3 kg, μ 0.6"], place_error=0.02)}
DIRECTIONS = 3
"""Of the error of the hand's place: one says little about a grasp."""
BEFORE = {"limits.place_error": 0.016}
MOVING = BEFORE | {"limits.rotation_deg": 10.0, "limits.shift": 0.01, "limits.give": 0.0}
UNCERTAIN = {"weights.uncer": Weights().uncer, "smoothing.deviation": UNSURE.deviation}
WIDE = {"limits.place_error": 0.02}
ALONE = {"closing.planned": False, "closing.c_freedom": 0.0, "limits.place_error": 0.0, "limits.effort": 0.0}
PREGRASP = MOVING | ALONE
AT_CONTACT = PREGRASP | {"closing.planned": True}
WITHIN = AT_CONTACT | {"limits.effort": 1.0}
STEPS: Mapping[str, Mapping[str, Any]] = {
    "pregrasp alone": PREGRASP,
    "hand at contact": AT_CONTACT,
    "torques within the effort": WITHIN,
    "gap of 8 mm": WITHIN | {"limits.place_error": 0.008},
    "c of each finger": MOVING | {"limits.place_error": 0.008},
    "gap of 16 mm": MOVING,
    "with E_uncer": MOVING | UNCERTAIN,
    "links 4 mm clear": MOVING | {"closing.margin": 0.004},
    "little motion": BEFORE,
    "gap of 20 mm": BEFORE | WIDE,
    "E_uncer": BEFORE | UNCERTAIN,
    "E_uncer, 16 mm": BEFORE | UNCERTAIN | {"smoothing.deviation": 0.016},
    "E_uncer, gap of 20 mm": BEFORE | UNCERTAIN | WIDE,
    "E_uncer of 5, gap of 20 mm": BEFORE | UNCERTAIN | WIDE | {"weights.uncer": 5.0},
    "E_uncer, gap of 20 mm, links 10 mm clear": BEFORE | UNCERTAIN | WIDE | {"closing.margin": 0.01},
    **{f"gap of {mm} mm": BEFORE | {"limits.place_error": mm / 1000} for mm in (24, 28, 32)},
}
"""Each step's changes of the preset `robust`, which is "gap of 24 mm"."""


def _step(name: str, settings: Settings) -> Settings:
    return changed(settings, STEPS[name])


CONDITIONS = tuple(Condition(name, CAMERAS, partial(_step, name)) for name in STEPS)


def trial(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The rows of one object in one step: under each load, and with the hand beside its place."""
    plan = trials.planned(setup, file, condition, views)
    row = Row(load="", **trials.told(plan, condition, views))
    if plan.best is None:
        return [replace(row, load=name) for name, _ in _directed()]
    seed = setup.seed + crc32(row.object.encode())
    trial = [(name, replace(TRIALS[name], seed=seed + direction)) for name, direction in _directed()]
    return [replace(row, load=name, **trials.measured(trials.carried_out(plan, s))) for name, s in trial]


def _directed() -> list[tuple[str, int]]:
    """Each trial's name, with the number of the direction of its error."""
    return [(name, i) for name, s in TRIALS.items() for i in range(DIRECTIONS if s.place_error else 1)]


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object in every step."""
    return trials.cases(CONDITIONS, setup, observations, trial)


def facts(setup: Setup) -> dict[str, Any]:
    """What the rows depend on."""
    return trials.facts(CONDITIONS, setup) | {"off": TRIALS[OFF].place_error}


def tables(rows: Frame) -> Tables:
    """Success, agreement with the plan, endings of the trials, and the meaning of the steps."""
    return {
        "Success in percent with 95 % intervals": trials.totals(rows),
        "How much of a plan happens": trials.fidelity(rows),
        "Endings": trials.endings(rows),
        "Steps": meaning(),
    }


def meaning() -> Lines:
    """A line for each step: what it changes of the preset."""
    return [
        {"step": name, "settings": ", ".join(f"{key} = {value}" for key, value in changes.items()) or "as the preset"}
        for name, changes in STEPS.items()
    ]


STUDY = Study(
    question="what does planning the hand at first contact gain, and how were its settings chosen?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=partial(trials.panels, half="tuning"),
    caption=(
        "Success of the first choice from two views under two loads, for each step from planning the pregrasp alone to "
        "the preset, on problems of the tuning half, with Wilson's 95 % intervals."
    ),
    facts=facts,
)
