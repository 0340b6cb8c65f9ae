"""How the defaults were chosen: one step at a time, from the paper's weights with its errata corrected.

Each step changes some settings of an earlier one. Steps are chosen on the tuning half of the problems and judged on
the held-out half. The study has its own settings and refuses those of the command line.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.base.presets import PAPER, ROBUST
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Lines, Tables
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.experiments.studies.trials import HALVES, LOADS, Condition
from sgnlp.perception.observation import Observation

CAMERAS = 2
CLOSED = "exterior noise 0.05 m"
AT_CONTACT = "hand at contact"  # its settings are studied in the study `contact`
FREE = "free space, gap of 16 mm"
STILL = "little motion"
FINAL = "gap of 24 mm"  # the step that ends at the robust preset


@dataclass(frozen=True)
class Step:
    """Settings by name, changed from those of an earlier step; the first step has no earlier one."""

    before: str
    changes: Mapping[str, Any]
    cameras: int = CAMERAS


_FORCES = {
    "limits.force_min": 4.0,
    "limits.force_max": 10.0,
    "limits.gain_min": 100.0,
    "weights.gain": 0.0,
    "contact.friction": 0.6,
    "limits.rotation_deg": 10.0,
    "limits.shift": 0.01,
}
_CLOSED = {"gpis.exterior_noise": 0.05}
_TORQUES = {"limits.effort": 1.0}
_CONTACT = {"closing.planned": True, "closing.c_freedom": 0.3, "limits.place_error": 0.008, "limits.effort": 1.0}
_FREE = {"free_space.used": True, "weights.uncer": 0.0, "closing.margin": 0.008, "limits.place_error": 0.016}
_STILL = {"limits.rotation_deg": 2.0, "limits.shift": 0.003, "limits.give": 0.001}
_WIDE = {"limits.place_error": 0.024}
STEPS = {
    "paper": Step("", {}),
    "whole hand covered": Step("paper", {"spheres": "cover", "limits.table_margin": 0.012}),
    "force, stiffness, reserve": Step("whole hand covered", _FORCES),
    "weight of 0.3 kg": Step("force, stiffness, reserve", {"contact.mass": 0.3}),
    CLOSED: Step("weight of 0.3 kg", _CLOSED),
    AT_CONTACT: Step(CLOSED, _CONTACT),
    FREE: Step(AT_CONTACT, _FREE),
    STILL: Step(FREE, _STILL),
    FINAL: Step(STILL, _WIDE),
    "weight of 0.3 kg, 1 view": Step("weight of 0.3 kg", {}, cameras=1),
    f"{CLOSED}, 1 view": Step("weight of 0.3 kg, 1 view", _CLOSED, cameras=1),
    f"{AT_CONTACT}, 1 view": Step(f"{CLOSED}, 1 view", _CONTACT, cameras=1),
    f"{FREE}, 1 view": Step(f"{AT_CONTACT}, 1 view", _FREE, cameras=1),
    f"{STILL}, 1 view": Step(f"{FREE}, 1 view", _STILL, cameras=1),
    f"{FINAL}, 1 view": Step(f"{STILL}, 1 view", _WIDE, cameras=1),
    "pad ignored": Step(CLOSED, {"contact.pad": False}),
    "exterior noise 0.02 m": Step(CLOSED, {"gpis.exterior_noise": 0.02}),
    "ranked by energy": Step(CLOSED, {"rank_by": "energy"}),
    "ranked by stiffness": Step(CLOSED, {"rank_by": "stiffness"}),
    "Matérn 5/2": Step(CLOSED, {"gpis.kernel": "matern52"}),
    "force 6 to 15 N": Step(CLOSED, {"limits.force_min": 6.0, "limits.force_max": 15.0}),
    "friction 0.5": Step(CLOSED, {"contact.friction": 0.5}),
    "torques within the effort": Step(CLOSED, _TORQUES),
    "torques within the effort, 1 view": Step(f"{CLOSED}, 1 view", _TORQUES, cameras=1),
}
"""From the paper to the default, then what was tried beside it."""


def changed(settings: Settings, changes: Mapping[str, Any]) -> Settings:
    """Settings with some of them changed, each by its name, `limits.shift`."""
    for path, value in changes.items():
        section, _, name = path.rpartition(".")
        part = {section: replace(getattr(settings, section), **{name: value})} if section else {name: value}
        settings = replace(settings, **part)
    return settings


def settings_of(name: str) -> Settings:
    """The whole settings of a step."""
    step = STEPS[name]
    return changed(settings_of(step.before), step.changes) if step.before else PAPER


def _given(settings: Settings, _: Settings) -> Settings:
    return settings


CONDITIONS = tuple(Condition(name, step.cameras, partial(_given, settings_of(name))) for name, step in STEPS.items())


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object in every step; raises `InputError` if the settings are not the default, as they have no effect."""
    if setup.settings != ROBUST:
        raise InputError("the study of the defaults has its own settings: leave out --preset and the flags of settings")
    return trials.cases(CONDITIONS, setup, observations)


def table(load_name: str, rows: Frame) -> Lines:
    """A line for each step under a load: success on both halves, and the gain over the step that it changes."""
    lines = []
    for line in trials.totals(rows[rows.load == load_name]):
        name = line["condition"]
        found = {"step": name, "changes": STEPS[name].before}
        found |= {key: text for key, text in line.items() if key not in ("condition", "load", "all")}
        lines.append(found | {f"gain, {text}": gain(rows, name, load_name, half) for half, text in HALVES.items()})
    return lines


def gain(rows: Frame, name: str, load_name: str, half: str) -> str:
    """Points of success gained over the step before, on the objects of a half that have both."""
    names = (name, STEPS[name].before)
    now, before = (trials.of(rows, each, load_name, half).set_index("object").score for each in names)
    gained = (now - before).dropna()
    return f"{100 * gained.mean():+.0f}" if len(gained) else "-"


def meaning() -> Lines:
    """A line for each step: what it changes."""
    return [
        {"step": name, "changes": step.before or "the preset paper", "cameras": str(step.cameras)}
        | {"settings": ", ".join(f"{name} = {value}" for name, value in step.changes.items())}
        for name, step in STEPS.items()
    ]


def tables(rows: Frame) -> Tables:
    """Success under each load, how the trials ended, and what the steps are."""
    found = {f"Success in percent with 95 % intervals, {name}": table(name, rows) for name in LOADS}
    return found | {"Endings": trials.endings(rows), "Steps": meaning()}


STUDY = Study(
    question="how were the defaults chosen, and what does each step from the paper to them gain?",
    row=trials.Row,
    cases=cases,
    tables=tables,
    panels=partial(trials.panels, half="tuning"),
    caption=(
        "Success of the first choice in simulation under two loads, for each step from the paper's settings to the "
        "defaults and for what was tried beside them, on problems of the tuning half, with Wilson's 95 % intervals."
    ),
    facts=partial(trials.facts, CONDITIONS),
)
