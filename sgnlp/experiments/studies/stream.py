"""Replanning against planning afresh: an object that moves on its table, seen again at every step.

The object moves by 1 cm and turns in each step, in a direction that is drawn at random for each object. Two fixed
cameras measure it anew. `replan` follows it through all steps. At every fifth step it is also planned afresh from the
same cloud. At the last step both first choices are carried out on the true object in its present place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.experiments.frames import Frame, Lines, Tables, percent, pick
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.experiments.studies.trials import Condition
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import Observation, load, observe
from sgnlp.perception.synthetic.cameras import miscalibrated, view
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.scenes import CAMERA, RING
from sgnlp.planning.plan import Plan
from sgnlp.planning.replan import replan
from sgnlp.planning.solve import solve
from sgnlp.show.plots import Panel
from sgnlp.simulation import SimulationSettings
from sgnlp.surface.registration import PlanarMotion

CAMERAS, STEPS, EVERY = 2, 20, 5
LENGTH, TURN = 0.01, np.radians(3.0)
"""Shift and turn of a step [m], [rad]."""
NOMINAL = SimulationSettings(mass=0.3, friction=0.6, push_weights=0.0)
REPLANNED, AFRESH = "replanned", "planned afresh"
WITHIN = 0.01
"""A grasp is as good as another if it is feasible and its energy exceeds the other's by at most this share."""


@dataclass(frozen=True)
class Row:
    """The first choice at a step, carried over or planned afresh; the energy is the recomputed one."""

    object: str
    condition: str
    step: int
    half: str
    how: str  # the surface was "moved" or "fitted"; "": all was planned afresh
    seconds: float
    iterations: int = 0
    feasible: bool = False
    energy: float = nan
    margin: float = nan
    ending: str = ""  # of the simulation, at the last step
    score: float = nan


def motion(whole: Observation, step: int, seed: int) -> PlanarMotion:
    """The motion of the object after this number of steps."""
    assert whole.mesh_vertices is not None  # every trial has a true surface
    angle, side = np.random.default_rng(seed).uniform(-np.pi, np.pi, 2)
    shift = step * LENGTH * np.array([np.cos(angle), np.sin(angle), 0.0])
    return PlanarMotion(whole.mesh_vertices.mean(axis=0), step * TURN * float(np.sign(side)), shift)


def cloud(whole: Observation, step: int, seed: int, views: Sequence[str]) -> Observation:
    """The cloud of fixed cameras after this number of steps, with the same calibration errors each time."""
    assert whole.mesh_vertices is not None
    assert whole.mesh_faces is not None
    assert whole.camera_positions is not None
    moved = Mesh(motion(whole, step, seed)(whole.mesh_vertices), whole.mesh_faces)
    middle, points, numbers = whole.mesh_vertices.mean(axis=0), list[Array](), list[Array]()
    for number, name in enumerate(whole.view_names):
        if name not in views:
            continue
        noise = np.random.default_rng([seed, step, number])
        seen = view(moved, CAMERA, whole.camera_positions[number], middle, noise)
        shift = (RING.shift_min, RING.shift_max)
        seen = miscalibrated(seen, shift, RING.turn_deg, middle, np.random.default_rng([seed, number]))
        seen = seen[seen[:, 2] > whole.table_height + RING.crop]
        points.append(seen[np.sort(noise.permutation(len(seen))[: RING.points])])
        numbers.append(np.full(len(points[-1]), number))
    return observe(
        np.concatenate(points),
        view=np.concatenate(numbers),
        view_names=whole.view_names,
        camera_positions=whole.camera_positions,
        table_height=whole.table_height,
        name=whole.name,
        mesh_vertices=moved.vertices,
        mesh_faces=moved.faces,
    )


def trial(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The rows of one object: of every step, and of those at which it was planned afresh."""
    hand, whole = load_hand(setup.hand, setup.settings.spheres), load(file)
    seed = setup.seed + crc32(whole.name.encode())
    options = {"jobs": 1, "count": setup.starts, "seed": setup.seed, "timeout": setup.timeout, "rounds": 1}
    plan = solve(cloud(whole, 0, seed, views), hand, setup.settings, **options)  # type: ignore[arg-type]
    if plan.best is None:
        return [Row(whole.name, REPLANNED, 0, whole.half, "", sum(plan.seconds.values()))]
    rows = []
    for step in range(1, STEPS + 1):
        seen = cloud(whole, step, seed, views)
        plan = replan(plan, seen)
        rows.append(_row(plan, whole, REPLANNED, step))
        if step % EVERY == 0:
            fresh = solve(seen, hand, setup.settings, **options)  # type: ignore[arg-type]
            rows.append(_row(fresh, whole, AFRESH, step))
    return rows


def _row(plan: Plan, whole: Observation, condition: str, step: int) -> Row:
    row = Row(whole.name, condition, step, whole.half, plan.replanned, sum(plan.seconds.values()))
    best = plan.best
    if best is None:
        return row
    row = replace(row, iterations=best.iterations, feasible=True, energy=best.energy, margin=best.worst_margin)
    if step < STEPS:
        return row
    outcome = trials.carried_out(plan, NOMINAL)
    return replace(row, ending=outcome.ending, score=outcome.score)


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object."""
    return trials.cases([Condition(REPLANNED, CAMERAS)], setup, observations, trial)


def facts(setup: Setup) -> dict[str, Any]:
    """What the rows depend on."""
    return setup.facts() | {"steps": STEPS, "every": EVERY, "length": LENGTH, "turn": float(TURN)}


def tables(rows: Frame) -> Tables:
    """The steps, and the quality of carried-over grasps compared with those planned afresh."""
    return {"Steps": steps(rows), "Against planning afresh": against(rows), "Held at the last step": held(rows)}


def steps(rows: Frame) -> Lines:
    """A line for each condition: how the surface was updated, the time, and how often a grasp was feasible."""
    lines = []
    for name, own in rows[rows.step > 0].groupby("condition", sort=False):
        ways = {how: str(((own.how == how) & (own.condition == REPLANNED)).sum()) for how in ("moved", "fitted")}
        lines.append(
            {"condition": str(name), "steps": str(len(own))}
            | ways
            | {"feasible [%]": percent(own.feasible.sum(), len(own))}
            | {"time, median [ms]": f"{1e3 * own.seconds.median():.0f}"}
            | {"90 % within [ms]": f"{1e3 * own.seconds.quantile(0.9):.0f}"}
            | {"iterations": f"{own.iterations[own.feasible].median():.0f}"}
        )
    return lines


def against(rows: Frame) -> Lines:
    """How often the carried-over grasp is as good, over the steps where planning afresh found a grasp."""
    keys = ["object", "step"]
    mine, other = (pick(rows, condition=name).set_index(keys) for name in (REPLANNED, AFRESH))
    other = other[other.feasible]
    mine = mine.reindex(other.index)
    feasible = mine.feasible.fillna(value=False).astype(bool)
    good = feasible & (mine.energy <= other.energy + WITHIN * other.energy.abs())
    line = {"steps": str(len(other)), "feasible [%]": percent(feasible.sum(), len(other))}
    return [line | {"as good [%]": percent(good.sum(), len(other))}]


def held(rows: Frame) -> Lines:
    """A line for each condition: success at the last step, over the objects that had a grasp at the first."""
    last = rows[rows.step == STEPS]
    return [
        {"condition": str(name), "objects": str(len(own)), "held [%]": percent(own.score.fillna(0).sum(), len(own))}
        for name, own in last.groupby("condition", sort=False)
    ]


def panels(rows: Frame) -> list[Panel]:
    """Success at the last step with its interval."""
    last = rows[rows.step == STEPS]
    scores = {name: pick(last, condition=name).score.fillna(0) for name in (REPLANNED, AFRESH)}
    return [trials.success_panel(f"after {STEPS} steps", "held", scores)]


STUDY = Study(
    question="is a plan that follows a moving object as good as one made afresh?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=panels,
    facts=facts,
    caption="Success of the first choice after 20 steps of 1 cm, carried over or planned afresh.",
)
