"""Inverse kinematics of an arm: joints that bring the hand's root link to a pose.

Damped Gauss-Newton steps (Levenberg-Marquardt) on e = (p* - p, log(R* Rᵀ)) keep the joints within their limits: a joint
that would exceed its limit stops there, and the others compensate.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_kinematics import manipulability, wrist_and_jacobian, wrist_pose
from sgnlp.hand.plausible import TURNING, kind

MAX_STEPS = 60
MAX_TURN = 0.8
"""Largest change of a joint in one step [rad or m]: beyond it the pose is not linear in the joints any more."""
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-12, 1.0
EASIER, HARDER = 0.1, 10.0
"""Factors of the damping after a step that reduces the error, and after one that does not."""
DONE = 1e-9
"""Length of e [m and rad] that counts as zero."""
STALLED = 1e-3
"""A step that reduces |e| by less than this share hardly helps."""
PATIENCE = 3
"""This many such steps in a row end the search."""
NEAR = np.array([1e-4, 1e-3])
"""Errors in position [m] and in rotation [rad] at which `reach_all` counts a pose as reached."""
DISTINCT = 0.05
"""Solutions that differ by less than this in every joint [rad or m] are the same."""


@dataclass
class _Place:
    """A posture of the arm: joints q, error e (6,) and Jacobian (6, a)."""

    q: Array
    e: Array
    J: Array


def reach(arm: Arm, wrist_pose: Array, begin: Array) -> tuple[Array, Array]:
    """Joints (a,) within the limits that bring the hand's root link nearest to a pose (7,), found from `begin` (a,).

    Also returns the remaining error (2,): distance [m] and angle [rad].
    """
    goal, data = pin.XYZQUATToSE3(np.asarray(wrist_pose, float)), arm.model.createData()
    here = _place(arm, goal, np.clip(begin, arm.lower, arm.upper), data)
    damping, slow = FIRST_DAMPING, 0
    for _ in range(MAX_STEPS):
        length = np.linalg.norm(here.e)
        if length < DONE or slow == PATIENCE or damping > MOST_DAMPING:
            break
        there = _place(arm, goal, _stepped(arm, here, damping), data)
        gain = 1.0 - np.linalg.norm(there.e) / length
        if gain > 0:
            here, damping = there, max(EASIER * damping, LEAST_DAMPING)
            slow = slow + 1 if gain < STALLED else 0
        else:
            damping *= HARDER
    return here.q, np.array([np.linalg.norm(here.e[:3]), np.linalg.norm(here.e[3:])])


def reach_all(arm: Arm, pose: Array, seed: int, tries: int) -> list[Array]:
    """Different joints (a,) that bring the hand's root link to a pose (7,) within `NEAR`; none if it is out of reach.

    The search begins at home and at `tries` - 1 random postures. Angles are in the turn nearest to home. The solutions
    are sorted by decreasing `fitness`.
    """
    rng = np.random.default_rng(seed)
    begins = [arm.home, *rng.uniform(*_one_turn(arm), (tries - 1, len(arm.home)))]
    found: list[Array] = []
    for begin in begins:
        q, error = reach(arm, pose, begin)
        q = _unwound(arm, q)
        if (error <= NEAR).all() and all(np.abs(q - other).max() > DISTINCT for other in found):
            found.append(q)
    return sorted(found, key=lambda q: -fitness(arm, q))


def way_ends(arm: Arm, q: Array, back: Array, lift: Array) -> tuple[Array, Array]:
    """The joints (a,) nearest to q (a,) with the hand drawn back, and with the hand lifted.

    `back` (3,) [m] is in the frame of the hand's root link, `lift` (1,) [m] along the world's z.
    """
    wrist = pin.XYZQUATToSE3(wrist_pose(arm, q))
    steps = wrist.rotation @ back, np.append([0.0, 0.0], lift)
    poses = [pin.SE3ToXYZQUAT(pin.SE3(wrist.rotation, wrist.translation + step)) for step in steps]
    (standoff, _), (lifted, _) = (reach(arm, pose, q) for pose in poses)
    return standoff, lifted


def fitness(arm: Arm, q: Array) -> float:
    """Manipulability times the least distance of a joint from its limits, over half its range (0 to 1)."""
    room = np.minimum(q - arm.lower, arm.upper - q) / (arm.upper - arm.lower) * 2
    return manipulability(arm, q) * float(max(room.min(), 0.0))


def _place(arm: Arm, goal: pin.SE3, q: Array, data: pin.Data) -> _Place:
    pose, J = wrist_and_jacobian(arm, q, data)
    angle = pin.log3(goal.rotation @ pose.rotation.T)
    return _Place(q, np.concatenate([goal.translation - pose.translation, angle]), J)


def _stepped(arm: Arm, here: _Place, damping: float) -> Array:
    """The joints after a step, within the limits.

    min |J s - e|² + λ |s|². Joints that would exceed their limits are fixed there, and the others are solved for again.
    """
    low, high, step = arm.lower - here.q, arm.upper - here.q, np.zeros_like(here.q)
    free = np.ones(len(step), bool)
    while free.any():
        J = here.J[:, free]
        step[free] = np.linalg.solve(
            J.T @ J + damping * np.eye(J.shape[1]), J.T @ (here.e - here.J[:, ~free] @ step[~free])
        )
        beyond = free & ((step < low) | (step > high))
        if not beyond.any():
            break
        step[beyond] = np.minimum(np.maximum(step, low), high)[beyond]
        free &= ~beyond
    step *= MAX_TURN / max(float(np.abs(step).max()), MAX_TURN)
    return np.minimum(np.maximum(here.q + step, arm.lower), arm.upper)  # exactly, to the last bit


def _one_turn(arm: Arm) -> tuple[Array, Array]:
    """Limits (a,) of the random postures: at most half a turn from home, since poses repeat after a whole turn."""
    return np.maximum(arm.lower, arm.home - np.pi), np.minimum(arm.upper, arm.home + np.pi)


def _unwound(arm: Arm, q: Array) -> Array:
    """The joints with whole turns removed, so that each is as near to home as its limits allow."""
    turning = np.array([kind(arm.model, joint) == TURNING for joint in arm.joint_names])
    turns = np.where(turning, 2 * np.pi * np.round((q - arm.home) / (2 * np.pi)), 0.0)
    nearer = q - turns
    return np.where((nearer >= arm.lower) & (nearer <= arm.upper), nearer, q)
