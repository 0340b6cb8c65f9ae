"""The study of E_pose: the object should rise by 1 cm while it is grasped, before it is lifted.

The planned motion of the object's true centre of mass to the equilibrium is compared with the simulated one, from
where the object was given until rest, with E_pose and without. The plan knows the mass that is simulated: springs sag
by m g/Σk.
"""

from dataclasses import dataclass, replace
from functools import partial
from math import hypot, nan
from pathlib import Path

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.presets import VARIANTS
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Lines, Tables, lines
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.defaults import changed
from sgnlp.experiments.studies.study import Setup, Study
from sgnlp.experiments.studies.trials import LOADS, NO_PLAN, Condition
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.show.plots import Panel, Series
from sgnlp.simulation import true_body

CAMERAS = 3
"""All of the problem set: the motion is judged here, not the surface."""
LIGHT = next(iter(LOADS))


def _carried(settings: Settings) -> Settings:
    """Settings with the mass that is simulated."""
    return changed(settings, {"contact.mass": LOADS[LIGHT].mass})


WITH, WITHOUT = "E_pose", "without"
CONDITIONS = (
    Condition(WITH, CAMERAS, lambda settings: VARIANTS["lift"](_carried(settings))),
    Condition(WITHOUT, CAMERAS, _carried),
)


@dataclass(frozen=True)
class Row:
    """The first choice for an object. Rise and drift are the centre of mass's motion up and across the table [mm]."""

    object: str
    condition: str
    feasible: int
    ending: str = NO_PLAN
    planned_rise: float = nan
    planned_drift: float = nan
    rise: float = nan
    drift: float = nan
    turn_error_deg: float = nan


def risen(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The row of one object in one condition; values of phases that were not reached are NaN."""
    plan = trials.planned(setup, file, condition, views)
    row = Row(plan.observation.name, condition.name, trials.feasible(plan))
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


def by_object(rows: Frame) -> Lines:
    """A line for each object: planned and simulated rise and ending, with E_pose and without."""
    texts = rows[["object", "condition"]].assign(
        planned=rows.planned_rise.map("{:.1f}".format), simulated=rows.rise.map("{:.1f}".format), ending=rows.ending
    )
    wide = texts.pivot(index="object", columns="condition").swaplevel(axis=1)
    columns = [(condition, field) for condition in (WITH, WITHOUT) for field in ("planned", "simulated", "ending")]
    wide = wide.reindex(index=rows.object.unique(), columns=columns, fill_value="-").fillna("-")
    return lines(wide.set_axis(map(": ".join, columns), axis=1).reset_index(names="object"))


def means(rows: Frame) -> Lines:
    """A line for each condition: means over the objects whose motion was simulated, and their number."""
    found = []
    for condition in (WITH, WITHOUT):
        group = rows[rows.condition == condition]
        closed = group.dropna(subset="rise")
        numbers = {
            "planned rise": closed.planned_rise,
            "simulated rise": closed.rise,
            "|error|": (closed.rise - closed.planned_rise).abs(),
            "planned drift": closed.planned_drift,
            "simulated drift": closed.drift,
        }
        texts = {f"{name} [mm]": f"{v.mean():.1f}" if len(v) else "-" for name, v in numbers.items()}
        found.append({"condition": condition, "objects": f"{len(closed)} of {len(group)}"} | texts)
    return found


def tables(rows: Frame) -> Tables:
    """Means, then every object."""
    return {f"Rise while grasping, {LIGHT}": means(rows), "Rise while grasping [mm], by object": by_object(rows)}


def panels(rows: Frame) -> list[Panel]:
    """Simulated over planned rise, a point for each object."""
    closed = rows.dropna(subset="rise")
    groups = ((name, closed[closed.condition == name]) for name in (WITH, WITHOUT))
    series = tuple(Series(name, list(g.planned_rise), list(g.rise), look="points") for name, g in groups)
    return [Panel("Rise while grasping", "planned [mm]", "simulated [mm]", series, diagonal=True)]


STUDY = Study(
    question="does an object that is to rise by 1 cm while it is grasped rise so?",
    row=Row,
    cases=partial(trials.cases, CONDITIONS, work=risen),
    tables=tables,
    panels=panels,
    caption=(
        "Rise of the object while it is grasped, simulated over planned, a point for each object; on the grey line "
        "it rises as planned."
    ),
    facts=partial(trials.facts, CONDITIONS),
)
