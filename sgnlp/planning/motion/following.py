"""An arm that carries the hand along a path: inverse kinematics continued from pose to pose.

It begins at the planned joints of the pregrasp. The planned joints at the stand-off and with the object lifted may
belong to another elbow configuration, which the arm could reach only by a jump.
"""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_inverse import reach
from sgnlp.planning.motion.timing import seconds
from sgnlp.program.carried import LEVER

LAG = 10.0
"""A path takes at most this many times the duration that the wrist's speed gives. An arm that needs longer is near a
singularity, and the check of its speed fails."""


def followed(arm: Arm, planned: Array, poses: Array) -> tuple[Array, Array]:
    """Joints (K, a) within the limits for wrist poses (K, 7), each found from the one before, the first from `planned`.

    Also returns the distance (K,) [m] of the wrist from each pose, where angles are multiplied by `LEVER`.
    """
    joints, off = np.empty((len(poses), len(planned))), np.empty(len(poses))
    for k, pose in enumerate(poses):
        planned, error = reach(arm, pose, planned)
        joints[k], off[k] = planned, max(error[0], LEVER * error[1])
    return joints, off


def path_seconds(arm: Arm, joints: Array, share: float, least: float) -> float:
    """Duration [s] of an arm's path through joints (K, a), evenly spaced on a straight line of the wrist.

    It is at least `least` and at most `LAG` times that. Joints use `share` of their velocity limits.
    """
    rates = np.abs(np.diff(joints, axis=0)).max(axis=0) * (len(joints) - 1)
    return min(seconds(rates, share * arm.velocity, least), LAG * least)
