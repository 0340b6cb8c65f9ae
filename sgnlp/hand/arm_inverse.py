"""Inverse kinematics of an arm: joints that bring the hand's root link to a pose.

The error is e = (p* - p, log(R* Rᵀ)).
"""

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_kinematics import manipulability, wrist_and_jacobian, wrist_pose
from sgnlp.hand.damped import nearest
from sgnlp.hand.plausible import TURNING, kind

NEAR = np.array([1e-4, 1e-3])
"""Errors in position [m] and in rotation [rad] at which `reach_all` counts a pose as reached."""
DISTINCT = 0.05
"""Solutions that differ by less than this in every joint [rad or m] are the same."""


def reach(arm: Arm, wrist_pose: Array, begin: Array) -> tuple[Array, Array]:
    """Joints (a,) within the limits that bring the hand's root link nearest to a pose (7,), found from `begin` (a,).

    Also returns the remaining error (2,): distance [m] and angle [rad].
    """
    goal, data = pin.XYZQUATToSE3(np.asarray(wrist_pose, float)), arm.model.createData()

    def place(q: Array) -> tuple[Array, Array]:
        pose, J = wrist_and_jacobian(arm, q, data)
        angle = pin.log3(goal.rotation @ pose.rotation.T)
        return np.concatenate([goal.translation - pose.translation, angle]), J

    q, e = nearest(place, begin, arm.lower, arm.upper)
    return q, np.array([np.linalg.norm(e[:3]), np.linalg.norm(e[3:])])


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


def _one_turn(arm: Arm) -> tuple[Array, Array]:
    """Limits (a,) of the random postures: at most half a turn from home, since poses repeat after a whole turn."""
    return np.maximum(arm.lower, arm.home - np.pi), np.minimum(arm.upper, arm.home + np.pi)


def _unwound(arm: Arm, q: Array) -> Array:
    """The joints with whole turns removed, so that each is as near to home as its limits allow."""
    turning = np.array([kind(arm.model, joint) == TURNING for joint in arm.joint_names])
    turns = np.where(turning, 2 * np.pi * np.round((q - arm.home) / (2 * np.pi)), 0.0)
    nearer = q - turns
    return np.where((nearer >= arm.lower) & (nearer <= arm.upper), nearer, q)
