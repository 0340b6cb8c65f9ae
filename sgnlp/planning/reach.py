"""The starts that an arm can reach: inverse kinematics from several postures, preferring those clear of obstacles."""

from dataclasses import replace
from itertools import islice

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_inverse import reach, reach_all
from sgnlp.hand.arm_kinematics import arm_spheres, wrist_pose
from sgnlp.hand.kinematics import frames
from sgnlp.planning.problem import Problem
from sgnlp.planning.starts import Start, starts
from sgnlp.program.carried import near_spheres

TRIES = 8
"""Number of postures from which inverse kinematics begins: a Panda has up to eight families of solutions."""
NEAR = np.array([0.08, 0.6])
"""If the arm misses a start by no more than this [m], [rad], it begins where it comes nearest: the program moves the
wrist farther than that anyway."""
OUT_OF_REACH = "out of the arm's reach"
"""Reason for a start without a grasp."""
CANDIDATES = 6
"""At most this many wrist poses are tried for each start that is asked for."""


def reachable(problem: Problem, count: int, seed: int) -> tuple[list[Start], list[int]]:
    """The first `count` starts that the arm can reach, and the indices of those before them that it cannot.

    Without an arm these are the first `count` starts.
    """
    if problem.hand.arm is None:
        return starts(problem, count, seed), []
    found: list[Start] = []
    missed = []
    for start in islice(starts(problem, CANDIDATES * count, seed), CANDIDATES * count):
        if len(found) == count:
            break
        arm = _begin(problem, problem.hand.arm, start.wrist, seed)
        if arm is None:
            missed.append(start.index)
        else:
            found.append(_on_arm(problem, start, arm))
    return found, missed


def _begin(problem: Problem, arm: Arm, wrist: Array, seed: int) -> Array | None:
    """The arm's joints (a,) at or near a wrist pose (7,): of all solutions found, the one with the most clearance."""
    candidates = reach_all(arm, wrist, seed, TRIES)
    if not candidates:
        q, error = reach(arm, wrist, arm.home)
        candidates = [q] if (error <= NEAR).all() else []
    return max(candidates, key=lambda q: min(_room(problem, arm, q), 0.0), default=None)


def _room(problem: Problem, arm: Arm, q: Array) -> float:
    """The least clearance [m] of the arm from obstacles, from the table and from the object."""
    free = arm.free_spheres
    radii = np.array([arm.spheres[i].radius for i in free])
    return float((problem.fields.arm.distance(arm_spheres(arm, q)[free]) - radii).min())


def _on_arm(problem: Problem, start: Start, arm: Array) -> Start:
    """The start with the arm's joints, and with the wrist that they give."""
    assert problem.hand.arm is not None
    return replace(start, wrist=wrist_pose(problem.hand.arm, arm), arm=arm)


def within_reach(problem: Problem, poses: int, seed: int) -> bool:
    """Whether the arm reaches one of `poses` wrist poses around the object, with arm and palm clear of everything.

    The poses are starts turned about the object. Without an arm only the palm has to be clear of obstacles.
    """
    hand, arm = problem.hand, problem.hand.arm
    palm = near_spheres(hand)
    radii = np.array([hand.spheres[i].radius for i in palm])
    for start in starts(problem, poses, seed):
        spheres = frames(hand, start.wrist, start.joints)[1][palm]
        if (problem.fields.way.distance(spheres) < radii).any():
            continue
        if arm is None or any(_room(problem, arm, q) > 0 for q in reach_all(arm, start.wrist, seed, TRIES)):
            return True
    return False
