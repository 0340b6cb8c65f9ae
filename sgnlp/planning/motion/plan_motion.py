"""From a planned grasp to its whole motion, with its checks."""

from math import inf

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion import clearances
from sgnlp.planning.motion.trajectory import APPROACH, BETWEEN, CLOSE, LIFT, Trajectory
from sgnlp.planning.motion.way import Way, way
from sgnlp.planning.problem import Problem
from sgnlp.program.constraint import LENGTH, Check
from sgnlp.program.tolerances import CLEARANCE

FULL = 1.0
"""Largest share of a joint's velocity limit that a step of the arm may need; more is a jump."""


def trajectory(problem: Problem, grasps: Grasps, points: Array, rank: int = 0) -> Trajectory:
    """The motion of the grasp of this rank, with checks against the object and the problem's surroundings.

    `points` (N, 3) [m] are the measured points of the object. On the lift they are kept clear of obstacles.
    """
    made = way(problem.hand, problem.settings.motion, problem.settings.closing, grasps, rank)
    load = points @ grasps.rotation_eq[rank].T + grasps.translation_eq[rank]
    meta = {name: grasps.meta.get(name) for name in ("object", "hand", "input_digest")}
    return Trajectory(
        times=made.times,
        phase=made.phase,
        wrist=made.wrist,
        joints=made.joints,
        arm=made.arm,
        setpoints=made.setpoints,
        gains=grasps.gains[rank],
        joint_names=grasps.joint_names,
        arm_joint_names=grasps.arm_joint_names,
        finger_names=grasps.finger_names,
        checks=(*_clear(problem, made, grasps.joints_contact[rank], load), *_followed(problem, made)),
        meta=meta
        | {
            "plan": grasps.digest,
            "rank": rank,
            "start": int(grasps.start[rank]),
            "frame": problem.settings.motion.frame,
        },
    )


def _clear(problem: Problem, made: Way, touch: Array, load: Array) -> tuple[Check, ...]:
    """Checks that nothing is hit. In squeeze and lift the fingers stay where they touch; only the setpoints move on."""
    hand, limits, near = problem.hand, problem.settings.limits, problem.fields.near
    free = clearances.moving(hand)
    links = [i for i in free if i not in hand.tip_spheres]
    floor = np.full(len(free), limits.table_margin)
    floor[list(hand.tip_spheres)] = limits.pad_margin
    found = []
    for name in (APPROACH, CLOSE, LIFT):
        at = made.phase == name
        joints = np.repeat(touch[None], at.sum(), axis=0) if name == LIFT else made.joints[at]
        whole = clearances.samples(hand, name, made.times[at], made.wrist[at], joints, made.arm[at])
        if name != LIFT:
            found.append(clearances.to_object(problem, whole.of(free if name == APPROACH else links)))
        if near.shapes:
            found.append(clearances.to_obstacles(whole.of(free), near, limits.obstacle_margin))
        found.append(clearances.to_table(whole.of(free), problem.table_height, floor * (name == APPROACH)))
        found.append(clearances.to_itself(hand, whole))
        if name == LIFT and near.shapes:
            rises = made.wrist[at, 2] - made.wrist[np.flatnonzero(at)[0] - 1, 2]
            found.append(clearances.load_to_obstacles(name, made.times[at], load, rises, near))
    return tuple(found)


def _followed(problem: Problem, made: Way) -> tuple[Check, ...]:
    """Checks that the arm follows the path without a jump."""
    arm, found = problem.hand.arm, []
    for name in (APPROACH, LIFT) if arm is not None else ():
        assert arm is not None
        at = np.flatnonzero(made.phase == name)
        off, k = float(made.off[at].max()), int(at[made.off[at].argmax()])
        where, read = f"the wrist at {made.times[k]:.2f} s", LENGTH.reading
        reached = off <= CLEARANCE
        found.append(
            Check(f"{name}{BETWEEN}arm off the path", read(off), -inf, read(CLEARANCE), 0.0, "mm", reached, where)
        )
        speed = np.abs(np.diff(made.arm[at], axis=0)) / (problem.settings.motion.step * arm.velocity)
        k, j = (int(i) for i in np.unravel_index(speed.argmax(), speed.shape))
        where, value = f"{arm.joint_names[j]} at {made.times[at[k]]:.2f} s", float(speed[k, j])
        unit = "of the velocity limit"
        found.append(Check(f"{name}{BETWEEN}arm speed", value, -inf, FULL, 0.0, unit, value <= FULL, where))
    return tuple(found)
