"""The arm of a grasp recomputed with Pinocchio in NumPy; it shares no code with the solver's expressions."""

import numpy as np
import pinocchio as pin
from scipy.spatial.distance import cdist

from sgnlp.base.arrays import Array
from sgnlp.hand.arm_kinematics import arm_spheres, manipulability, wrist_pose
from sgnlp.planning.problem import Problem
from sgnlp.program.carried import LEVER, Carried, far_spheres, near_spheres
from sgnlp.program.variables import Posture


def carried(problem: Problem, at: Posture, hand_spheres: Array) -> Carried | None:
    """The arm of a posture, with the hand's spheres (S, 3) [m] at the pregrasp; None without an arm."""
    hand, arm, motion = problem.hand, problem.hand.arm, problem.settings.motion
    if arm is None or at.arm is None:
        return None
    radii, s = np.array([sphere.radius for sphere in arm.spheres]), arm_spheres(arm, at.arm[0])
    free, far, near = arm.free_spheres, far_spheres(arm), near_spheres(hand)
    own = cdist(s, s) - radii[:, None] - radii
    other = cdist(hand_spheres[near], s[far]) - radii[far]
    other -= np.array([hand.spheres[i].radius for i in near])[:, None]
    wrist = pin.XYZQUATToSE3(np.asarray(at.wrist, float))
    back, up = -motion.standoff * wrist.rotation @ hand.palm, np.array([0.0, 0.0, motion.lift])
    gaps = [problem.fields.arm.distance(arm_spheres(arm, q)[free]) - radii[free] for q in at.arm]
    errors = [_error(wrist_pose(arm, q), wrist, by) for q, by in zip(at.arm, (np.zeros(3), back, up), strict=True)]
    return Carried(
        joints=at.arm[0],
        standoff=at.arm[1],
        lift=at.arm[2],
        home=arm.home,
        clearances=np.concatenate(gaps),
        pair_clearances=np.array([own[i, j] for i, j in arm.pairs]),
        hand_clearances=other.ravel(),
        wrist_error=errors[0],
        standoff_error=errors[1],
        lift_error=errors[2],
        dexterity=np.log(max(manipulability(arm, at.arm[0]), np.finfo(float).tiny) / manipulability(arm, arm.home)),
    )


def _error(found: Array, wrist: pin.SE3, by: Array) -> Array:
    """Error (6,) [m] in position and rotation of a pose (7,) against the wrist displaced by (3,) [m]."""
    pose = pin.XYZQUATToSE3(found)
    turn = pin.log3(pose.rotation @ wrist.rotation.T)
    return np.concatenate([pose.translation - wrist.translation - by, LEVER * turn])
