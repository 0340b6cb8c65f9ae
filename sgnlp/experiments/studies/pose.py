"""The study of E_pose: the object is to rise by 1 cm while it is grasped, before it is lifted.

The planned motion of the object's true centre of mass to the equilibrium against the simulated one, from where the
object was given until rest, and both again without E_pose. The plan counts on the mass that is simulated, and on
gravity with it: springs sag by m g/Σk.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import hypot, nan
from pathlib import Path
from statistics import mean

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.presets import VARIANTS
from sgnlp.base.settings import Settings
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Lines, Setup, Study, Tables
from sgnlp.experiments.studies.trials import LOADS, NO_PLAN, Condition
from sgnlp.perception.observation import Observation
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.show.plots import Panel, Series
from sgnlp.simulation import true_body

Array = NDArray[np.float64]

CAMERAS = 3
"""All of the problem set, for the motion is judged here and not the surface."""
LIGHT = next(iter(LOADS))


def _carried(change: Callable[[Settings], Settings]) -> Callable[[Settings], Settings]:
    """A change of the settings that plans for the mass that is simulated, too."""
    return lambda s: change(replace(s, contact=replace(s.contact, mass=LOADS[LIGHT].mass)))


WITH, WITHOUT = "E_pose", "without"
CONDITIONS = (
    Condition(WITH, CAMERAS, _carried(VARIANTS["lift"])),
    Condition(WITHOUT, CAMERAS, _carried(lambda settings: settings)),
)


@dataclass(frozen=True)
class Row:
    """The first choice for an object. Rise and drift are the centre of mass's motion up and across the table [mm]."""

    object: str
    condition: str
    feasible: int
    ending: str
    planned_rise: float
    planned_drift: float
    rise: float
    drift: float
    turn_error_deg: float

    @property
    def error(self) -> float:
        """Simulated less planned rise [mm]."""
        return self.rise - self.planned_rise


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object with E_pose and without."""
    return trials.cases(CONDITIONS, setup, observations, risen)


def risen(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The row of one object in one condition; what was not reached is NaN."""
    plan = trials.planned(setup, file, condition, views)
    feasible = sum(solution.feasible for solution in plan.solutions)
    row = Row(plan.observation.name, condition.name, feasible, NO_PLAN, nan, nan, nan, nan, nan)
    if plan.best is None:
        return [row]
    truth = true_body(plan.observation)
    centre = Mesh(truth.vertices, truth.faces.astype(np.int64)).centroid
    outcome = trials.carried_out(plan, LOADS[LIGHT])
    rise, drift = motion(plan.best.grasp.rotation, plan.best.translation_eq, centre)
    row = replace(row, ending=outcome.ending, planned_rise=rise, planned_drift=drift)
    if closing := outcome.closing:
        rise, drift = motion(closing.rotation, closing.translation, centre)
        row = replace(row, rise=rise, drift=drift, turn_error_deg=trials.DEGREE * (closing.turn_error or 0.0))
    return [row]


def motion(rotation: Array, translation: Array, centre: Array) -> tuple[float, float]:
    """Rise and drift [mm] of a point (3,) [m] under R (3, 3), t (3,) [m]: R c + t - c, upwards and across the table."""
    x, y, z = 1e3 * (rotation @ centre + translation - centre)
    return float(z), hypot(x, y)


def closed(rows: Sequence[Row], condition: str) -> list[Row]:
    """The rows of a condition whose motion was simulated."""
    return [row for row in rows if row.condition == condition and row.rise == row.rise]


def by_object(rows: Sequence[Row]) -> Lines:
    """A line for each object: planned → simulated rise with and without E_pose."""
    found = {(row.object, row.condition): row for row in rows}
    return [
        {"object": name}
        | {
            f"{condition.name}: {field}": text
            for condition in CONDITIONS
            for field, text in _fields(found.get((name, condition.name))).items()
        }
        for name in dict.fromkeys(row.object for row in rows)
    ]


def _fields(row: Row | None) -> dict[str, str]:
    if row is None:
        return dict.fromkeys(("planned", "simulated", "ending"), "-")
    return {"planned": f"{row.planned_rise:.1f}", "simulated": f"{row.rise:.1f}", "ending": row.ending}


def means(rows: Sequence[Row]) -> Lines:
    """A line for each condition: means over the objects whose motion was simulated, and how many there are of all."""
    lines = []
    for condition in CONDITIONS:
        group, count = closed(rows, condition.name), sum(row.condition == condition.name for row in rows)
        numbers = {
            "planned rise": [row.planned_rise for row in group],
            "simulated rise": [row.rise for row in group],
            "|error|": [abs(row.error) for row in group],
            "planned drift": [row.planned_drift for row in group],
            "simulated drift": [row.drift for row in group],
        }
        lines.append(
            {"condition": condition.name, "objects": f"{len(group)} of {count}"}
            | {f"{name} [mm]": f"{mean(values):.1f}" if values else "-" for name, values in numbers.items()}
        )
    return lines


def tables(rows: Sequence[Row]) -> Tables:
    """Means, then every object."""
    return {f"Rise while grasping, {LIGHT}": means(rows), "Rise while grasping [mm], by object": by_object(rows)}


def panels(rows: Sequence[Row]) -> list[Panel]:
    """Simulated over planned rise, a point for each object."""
    shown = {c.name: closed(rows, c.name) for c in CONDITIONS}
    series = (Series(n, [r.planned_rise for r in g], [r.rise for r in g], look="points") for n, g in shown.items())
    return [Panel("Rise while grasping", "planned [mm]", "simulated [mm]", tuple(series), diagonal=True)]


STUDY = Study(
    question="does an object that is to rise by 1 cm while it is grasped rise so?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=panels,
    caption=(
        "Rise of the object while it is grasped, simulated over planned, a point for each object; on the grey line "
        "it rises as planned."
    ),
    facts=partial(trials.facts, CONDITIONS),
)
