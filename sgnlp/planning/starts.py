"""Initial guesses: the wrist starts of the hand's file around the cloud, then randomly turned copies of them."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import with_base
from sgnlp.hand.arm_inverse import reach, way_ends
from sgnlp.hand.inverse import reached
from sgnlp.hand.kinematics import frames
from sgnlp.planning.placing.placed import chooses, placed
from sgnlp.planning.placing.poses import turned
from sgnlp.planning.problem import Problem
from sgnlp.program.carried import UNIT
from sgnlp.program.nlp import Nlp
from sgnlp.program.variables import AtContact, posture, variable_units

KEPT = 64
"""Chosen starts that a process keeps: more than five rounds of seven."""
TARGET_DEPTH = 0.5
"""Initial targets lie this far from each tip towards the middle of the tips (paper's appendix: halfway)."""


@dataclass(frozen=True, eq=False)
class Start:
    """An initial guess: wrist pose (7), joints (n) [rad], targets (m, 3) [m], gains (m) [N/m]."""

    index: int
    wrist: Array
    joints: Array
    targets: Array
    gains: Array
    arm: Array | None = None  # (a,) [rad], of an arm that carries the hand


def starts(problem: Problem, count: int, seed: int) -> list[Start]:
    """The first `count` starts: those of the hand's file, then seeded ones.

    A seeded start is one of the file's, turned by a random angle about the vertical through the middle of the cloud's
    box.
    """
    centre, file = problem.box.mean(axis=0), _file(problem)
    rng = np.random.default_rng(seed)
    seeded = [
        turned(file[rng.integers(len(file))], centre, rng.uniform(-np.pi, np.pi))
        for _ in range(max(count - len(file), 0))
    ]
    wrists = [*file, *seeded][:count]
    if chooses(problem):
        return [_chosen(problem, i, tuple(wrist), seed) for i, wrist in enumerate(wrists)]
    return [_start(problem, i, wrist) for i, wrist in enumerate(wrists)]


def _file(problem: Problem) -> list[Array]:
    """The wrist poses of the hand's file around the cloud."""
    centre, extents = problem.box.mean(axis=0), problem.box[1] - problem.box[0]
    return [start.pose(centre, extents) for start in problem.hand.wrist_starts]


@lru_cache(maxsize=KEPT)
def _chosen(problem: Problem, index: int, wrist: tuple[float, ...], seed: int) -> Start:
    """The start that is chosen near a wrist pose (7,); rounds of starts and cautions ask for it again."""
    p = placed(problem, np.array(wrist), np.array(_file(problem)), (seed, index))
    return Start(index, p.wrist, p.joints, _inside(problem, p.targets), p.gains)


def initial(nlp: Nlp, start: Start) -> Array:
    """The scaled variables of a start: v = 0, its targets and gains, without slacks."""
    n = len(nlp.hand.joint_names)
    return np.concatenate([np.zeros(6 + n), start.targets.ravel(), start.gains]) / variable_units(nlp.hand)


def at_contact(nlp: Nlp, x: Array, p: Array) -> Array:
    """Initial values of the variables of the hand at first contact, from the common variables x and the parameters p.

    Each finger begins with the c of the settings, its joints where inverse kinematics brings the tips to the contacts,
    and an arm where it brings the hand to the wrist, to the stand-off and up.
    """
    at, given, hand = nlp.structure.at_contact, nlp.parameters.unpack(p), nlp.hand
    begin = posture(hand, AtContact(), (given.wrist, given.joints), x, float(given.c[0]))
    parts = [begin.c] if at.c else []
    if at.joints:
        tips, _ = frames(hand, begin.wrist, begin.joints)
        contacts = begin.targets + begin.c[:, None] * (tips - begin.targets)
        parts.append(reached(hand, begin.wrist, begin.joints, contacts))
    if hand.arm:
        arm = with_base(hand.arm, given.base)
        q, _ = reach(arm, begin.wrist, given.arm)
        parts += [angles / UNIT for angles in (q, *way_ends(arm, q, -given.standoff * hand.palm, given.lift))]
    return np.concatenate([np.zeros(0), *parts])


def _start(problem: Problem, index: int, wrist: Array) -> Start:
    hand = problem.hand
    tips, _ = frames(hand, wrist, hand.reference)
    targets = _inside(problem, tips + TARGET_DEPTH * (tips.mean(axis=0) - tips))
    gains = np.clip(hand.gain_initial, *problem.gain_bounds())
    return Start(index, wrist, hand.reference, targets, gains)


def _inside(problem: Problem, targets: Array) -> Array:
    """The targets (m, 3) [m] moved into the cube in which the surface is valid."""
    side = problem.gpis.radius / np.sqrt(3)
    return np.clip(targets, problem.gpis.centre - side, problem.gpis.centre + side)
