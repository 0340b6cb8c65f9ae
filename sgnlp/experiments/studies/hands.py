"""All hands of the package: how many of the objects that fit a hand get a grasp, and how many of these it holds.

Each plan is made from two views. An object fits a hand if its least horizontal width, with the gap of the pregrasp on
both sides, is within the largest ball that the hand's pads can touch. The load is the preset's, 0.3 kg with a friction
of 0.6, if the motors can press hard enough for it. Such a hand is tried with a light and rough object too, since a
finger with one motor cannot choose the direction of its force. For weaker motors the object is light and rough in the
first place, with as much mass as they allow. The plan assumes the load.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from sgnlp.base.arrays import Array
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Lines, Tables, percent, pick
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.defaults import changed
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.experiments.studies.trials import NO_PLAN, Condition
from sgnlp.hand.hand import available_hands, load_hand
from sgnlp.hand.opening import Opening, opening, press
from sgnlp.perception.observation import Observation, load
from sgnlp.planning.problem import place_error
from sgnlp.planning.solve import solve
from sgnlp.show.plots import Panel
from sgnlp.simulation import SimulationSettings

CAMERAS = 2
SHARE = 1 / 3
"""Share of a hand's press that carries the weight; the rest is for torques, misplaced pads and accelerations."""
GRAVITY = 9.81  # [m/s²]
STEP = 0.01  # loads are rounded down to this [kg]
LIGHT, ROUGH = 0.1, 1.0  # [kg], friction
LIGHTLY = "-light"
"""The end of a condition's name: the hand before it with a light and rough object."""


@dataclass(frozen=True)
class Row(trials.Row):
    """A trial, with data of the hand and the object."""

    fingers: int = 0
    joints: int = 0
    opening_mm: float = 0.0
    press: float = 0.0  # [N]
    width_mm: float = 0.0  # least horizontal width of the object


@cache
def _opening(hand: str, preset: str) -> Opening | None:
    return opening(load_hand(hand, preset))


@cache
def _press(hand: str, preset: str) -> float:
    largest = _opening(hand, preset)
    return press(load_hand(hand, preset), largest) if largest else 0.0


def light(settings: Settings) -> Settings:
    """The settings with a light and rough object."""
    return changed(settings, {"contact.mass": LIGHT, "contact.friction": ROUGH})


def width(vertices: Array) -> float:
    """The least horizontal width [m] of a body: it is perpendicular to an edge of its outline."""
    outline = vertices[ConvexHull(vertices[:, :2]).vertices, :2]
    along = np.roll(outline, -1, axis=0) - outline
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    return float(np.ptp(outline @ across.T, axis=0).min())


def loaded(settings: Settings, force: float) -> tuple[float, float]:
    """Mass [kg] and friction of the load for a hand that presses with a force F [N]: 2 μ F · `SHARE` ≥ m g."""
    contact = settings.contact
    if carried(contact.friction, force) >= contact.mass:
        return contact.mass, contact.friction
    return min(LIGHT, float(np.floor(carried(ROUGH, force) / STEP) * STEP)), ROUGH


def carried(friction: float, force: float) -> float:
    """The mass [kg] that is held between two sides that press with a force [N]."""
    return 2 * friction * force * SHARE / GRAVITY


def trial(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The row of one object and hand."""
    name, preset = condition.name.removesuffix(LIGHTLY), setup.settings.spheres
    hand, observation = load_hand(name, preset), load(file, views=views)
    largest, force = _opening(name, preset), _press(name, preset)
    assert largest is not None  # without an opening there is no such case
    assert observation.mesh_vertices is not None
    mass, friction = loaded(condition.change(setup.settings), force)
    settings = changed(setup.settings, {"contact.mass": mass, "contact.friction": friction})
    plan = solve(observation, hand, settings, jobs=1, count=setup.starts, seed=setup.seed, timeout=setup.timeout)
    load_settings = SimulationSettings(mass=mass, friction=friction, push_weights=0.0)
    row = Row(
        load=f"{load_settings.mass:.2g} kg, μ {load_settings.friction:g}",
        **trials.told(plan, condition, views),
        fingers=len(hand.fingers),
        joints=len(hand.joint_names),
        opening_mm=1e3 * largest.diameter,
        press=force,
        width_mm=1e3 * width(observation.mesh_vertices),
    )
    return [row if plan.best is None else replace(row, **trials.measured(trials.carried_out(plan, load_settings)))]


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object with every hand that it fits, and again as a light one; `--hand` adds a hand in another folder."""
    names = list(dict.fromkeys([*available_hands(), setup.hand]))
    conditions = [Condition(name, CAMERAS) for name in names]
    conditions += [Condition(name + LIGHTLY, CAMERAS, light) for name in names if _strong(setup, name)]
    found = trials.cases(conditions, setup, observations, trial)
    bodies = {whole.name: whole.mesh_vertices for whole in observations}
    return [case for case in found if _fits(setup, case.key[1].removesuffix(LIGHTLY), bodies[case.key[0]])]


def _strong(setup: Setup, hand: str) -> bool:
    """Whether the motors press hard enough for the preset's load; if not, its object is light in the first place."""
    contact = setup.settings.contact
    return loaded(setup.settings, _press(hand, setup.settings.spheres)) == (contact.mass, contact.friction)


def _fits(setup: Setup, hand: str, vertices: Array | None) -> bool:
    largest = _opening(hand, setup.settings.spheres)
    if largest is None or vertices is None:
        return False
    return bool(width(vertices) + 2 * _gap(setup, hand) <= largest.diameter)


def _gap(setup: Setup, hand: str) -> float:
    return place_error(setup.settings.limits, load_hand(hand, setup.settings.spheres).few_joints)


def facts(setup: Setup) -> dict[str, Any]:
    """What the rows depend on; the hands are in the rows."""
    return {key: value for key, value in setup.facts().items() if key != "hand"} | {"share": SHARE}


def tables(rows: Frame) -> Tables:
    """For each hand its data, its grasps and its success; then the endings of the trials."""
    return {"Hand by hand": table(rows), "Endings": trials.endings(rows)}


def table(rows: Frame) -> Lines:
    """A line for each hand and load, by name."""
    lines = []
    for name, own in rows.groupby("condition"):
        planned, first = own[own.ending != NO_PLAN], own.iloc[0]
        lines.append(
            {"hand": str(name).removesuffix(LIGHTLY), "fingers": str(first.fingers), "joints": str(first.joints)}
            | {"largest ball [mm]": f"{first.opening_mm:.0f}", "load": str(first.load), "objects": str(len(own))}
            | {"with a grasp [%]": percent(len(planned), len(own))}
            | {"starts feasible [%]": percent(own.feasible.sum(), own.starts.sum())}
            | {"held [%]": trials.success(own)}
        )
    return lines


def panels(rows: Frame) -> list[Panel]:
    """Success of every hand with its interval."""
    scores = {name: pick(rows, condition=name).score for name in sorted(rows.condition.unique())}
    return [trials.success_panel("", "held", scores)]


STUDY = Study(
    question="what does each hand hold?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=panels,
    facts=facts,
    caption="Success of each hand's first choice from two views, with Wilson's 95 % intervals.",
)
