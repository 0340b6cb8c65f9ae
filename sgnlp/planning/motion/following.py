"""An arm that carries the hand along a straight path whose two ends are planned: inverse kinematics in between.

Every pose is reached from the joints at its share of the way between those of the ends, so that the arm neither drifts
nor flips where the ends belong together.
"""

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_inverse import reach
from sgnlp.hand.arm_kinematics import wrist_pose
from sgnlp.planning.motion.timing import seconds
from sgnlp.program.carried import LEVER

LAG = 10.0
"""A path takes at most so many times what the wrist's speed asks for. An arm that needs longer is near a singularity,
and the check of its speed tells."""


def followed(arm: Arm, begin: Array, end: Array, s: Array, poses: Array) -> tuple[Array, Array]:
    """Joints (K, a) within the limits for wrist poses (K, 7) at shares s (K,) of the way; `begin` and `end` (a,) stay.

    Beside them how far (K,) [m] the wrist is off each pose; angles count by `LEVER`.
    """
    joints = begin + s[:, None] * (end - begin)
    for k in np.flatnonzero((s > 0) & (s < 1)):
        joints[k], _ = reach(arm, poses[k], joints[k])
    joints[s == 1] = end
    return joints, np.array([_off(arm, q, pose) for q, pose in zip(joints, poses, strict=True)])


def path_seconds(arm: Arm, joints: Array, share: float, least: float) -> float:
    """How long an arm takes through joints (K, a) at equal parts of a straight path: `least` [s], `LAG` times at most.

    `share` of its velocity limits is used.
    """
    rates = np.abs(np.diff(joints, axis=0)).max(axis=0) * (len(joints) - 1)
    return min(seconds(rates, share * arm.velocity, least), LAG * least)


def _off(arm: Arm, joints: Array, pose: Array) -> float:
    found, wanted = pin.XYZQUATToSE3(wrist_pose(arm, joints)), pin.XYZQUATToSE3(np.asarray(pose, float))
    turn = float(np.linalg.norm(pin.log3(found.rotation @ wanted.rotation.T)))
    return max(float(np.linalg.norm(found.translation - wanted.translation)), LEVER * turn)
