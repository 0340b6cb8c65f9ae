"""An arm that carries the hand along a path: inverse kinematics continued from pose to pose.

It begins at the planned joints of the pregrasp. Those that a plan has at the stand-off and with the object lifted may
belong to another elbow, which the arm could reach by a jump alone.
"""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_inverse import reach
from sgnlp.planning.motion.timing import seconds
from sgnlp.program.carried import LEVER

LAG = 10.0
"""A path takes at most so many times what the wrist's speed asks for. An arm that needs longer is near a singularity,
and the check of its speed tells."""


def followed(arm: Arm, planned: Array, poses: Array) -> tuple[Array, Array]:
    """Joints (K, a) within the limits for wrist poses (K, 7), each found from the one before, the first from `planned`.

    Beside them how far (K,) [m] the wrist is off each pose; angles count by `LEVER`.
    """
    joints, off = np.empty((len(poses), len(planned))), np.empty(len(poses))
    for k, pose in enumerate(poses):
        planned, error = reach(arm, pose, planned)
        joints[k], off[k] = planned, max(error[0], LEVER * error[1])
    return joints, off


def path_seconds(arm: Arm, joints: Array, share: float, least: float) -> float:
    """How long an arm takes through joints (K, a) at equal parts of a straight path: `least` [s], `LAG` times at most.

    `share` of its velocity limits is used.
    """
    rates = np.abs(np.diff(joints, axis=0)).max(axis=0) * (len(joints) - 1)
    return min(seconds(rates, share * arm.velocity, least), LAG * least)
