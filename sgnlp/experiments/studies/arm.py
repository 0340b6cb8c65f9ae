"""The effect of an arm and an obstacle: feasible grasps, time and success, with and without them.

Each plan is made from two views. The obstacle is a box of 6 x 20 x 12 cm, 3 cm beside the true object, on a side that
is drawn at random for each object; the plan knows it. If no grasp is found, 500 seeded wrist poses are tried by inverse
kinematics: an object is within reach if the arm reaches one of them, with arm and palm clear of everything. In the
simulation the arm carries the hand along its motion, and the obstacle is there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.experiments.frames import Frame, Lines, Tables, percent, pick
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.experiments.studies.trials import LOADS, NO_PLAN, Condition
from sgnlp.experiments.true_clearance import true_clearance
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import Observation, load
from sgnlp.perception.shape import Shape
from sgnlp.planning.plan import Plan
from sgnlp.planning.reach import OUT_OF_REACH, within_reach
from sgnlp.planning.solve import solve
from sgnlp.simulation import Outcome, simulate

CAMERAS, POSES = 2, 500
SIZE, GAP = (0.06, 0.2, 0.12), 0.03
"""[m] Edges of the obstacle, and how far it stands from the object."""
ARM = "panda"
CONDITIONS: dict[str, tuple[str | None, bool]] = {
    "free wrist": (None, False),
    "free wrist, obstacle": (None, True),
    ARM: (ARM, False),
    f"{ARM}, obstacle": (ARM, True),
}
"""The arm that carries the hand, and whether there is an obstacle."""


@dataclass(frozen=True)
class Row(trials.Row):
    """A trial, with the reach of the arm and the distance to the obstacle."""

    out_of_reach: int = 0  # starts
    within_reach: bool = True  # whether the arm comes to some wrist pose about the object
    obstacle_mm: float = nan  # least distance of the meshes of hand and arm to the obstacle, over all feasible grasps
    iterations: float = nan  # mean of the starts
    obstacles_touched: int = 0  # in the simulation, by hand, arm or object


def obstacle(whole: Observation, seed: int) -> Shape:
    """The box beside the true object, on a side drawn for its name."""
    vertices = whole.mesh_vertices
    assert vertices is not None  # every trial has a true surface
    angle = np.random.default_rng(seed + crc32(whole.name.encode())).uniform(-np.pi, np.pi)
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    beyond = float((vertices @ R[:, 0]).max()) + GAP + SIZE[0] / 2
    place = middle + (beyond - middle @ R[:, 0]) * R[:, 0]
    return Shape.box([*place[:2], whole.table_height + SIZE[2] / 2], SIZE, R, "box beside")


def trial(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The rows of one object in one condition, one for each load."""
    arm, crowded = CONDITIONS[condition.name]
    observation = load(file, views=views)
    shapes = (obstacle(observation, setup.seed),) if crowded else ()
    hand = load_hand(setup.hand, setup.settings.spheres, arm)
    plan = solve(
        observation,
        hand,
        setup.settings,
        obstacles=shapes,
        jobs=1,
        count=setup.starts,
        seed=setup.seed,
        timeout=setup.timeout,
    )
    row = Row(load="", **trials.told(plan, condition, views), **_beside(plan, shapes))
    if plan.best is None:
        return [replace(row, load=name) for name in LOADS]
    return [replace(row, load=name, **_measured(simulate(plan.best, observation, s))) for name, s in LOADS.items()]


def _measured(outcome: Outcome) -> dict[str, Any]:
    """What a trial's row says of the simulation, and of the obstacles that were touched."""
    return trials.measured(outcome) | {"obstacles_touched": len(outcome.obstacles_touched)}


def _beside(plan: Plan, shapes: Sequence[Shape]) -> dict[str, Any]:
    """What a row says beside a trial's."""
    feasible = [solution for solution in plan.solutions if solution.feasible]
    gaps: list[float] = [true_clearance(plan.problem, solution, shapes) for solution in feasible] if shapes else []
    steps: Array = np.array([solution.iterations for solution in plan.solutions], float)
    return {
        "out_of_reach": sum(failure.reason == OUT_OF_REACH for failure in plan.failures),
        "within_reach": bool(feasible) or within_reach(plan.problem, POSES, plan.seed),
        "obstacle_mm": 1e3 * min(gaps) if gaps else nan,
        "iterations": float(steps.mean()) if len(steps) else nan,
    }


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object in every condition."""
    return trials.cases([Condition(name, CAMERAS) for name in CONDITIONS], setup, observations, trial)


def facts(setup: Setup) -> dict[str, Any]:
    """What the rows depend on."""
    return setup.facts() | trials.loads() | {"size": list(SIZE), "gap": GAP, "poses": POSES}


def tables(rows: Frame) -> Tables:
    """How many objects get a grasp, what it costs, and how often it holds."""
    return {
        "Objects with a grasp, and what it takes": table(rows),
        "Success in percent with 95 % intervals": trials.totals(rows),
        "Endings": trials.endings(rows),
    }


def table(rows: Frame) -> Lines:
    """A line for each condition, over all objects."""
    lines, first = [], next(iter(LOADS))
    base = pick(rows, condition="free wrist", load=first).set_index("object").seconds
    for name in rows.condition.unique():
        own = pick(rows, condition=name, load=first)
        there = own[own.within_reach]
        ratio = (own.set_index("object").seconds / base).median()
        lines.append(
            {"condition": str(name), "objects": str(len(own)), "within reach": str(len(there))}
            | {"with a grasp [%]": percent((there.ending != NO_PLAN).sum(), len(there))}
            | {"feasible starts": f"{own.feasible.sum()} of {own.starts.sum()}"}
            | {"out of reach": str(own.out_of_reach.sum())}
            | {"obstacle, least [mm]": f"{own.obstacle_mm.min():.1f}" if own.obstacle_mm.notna().any() else ""}
            | {"iterations": f"{own.iterations.mean():.0f}", "time ratio": f"{ratio:.2f}"}
        )
    return lines


STUDY = Study(
    question="what do an arm and an obstacle beside the object take away?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=partial(trials.panels, half="held_out"),
    facts=facts,
    caption=(
        "Success of the first choice from two views under two loads, for a hand on a free wrist and on an arm, with "
        "and without an obstacle 3 cm beside the object, with Wilson's 95 % intervals."
    ),
)
