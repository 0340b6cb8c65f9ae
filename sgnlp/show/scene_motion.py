"""The motion of a grasp as frames of a view: the hand, the object that it carries, and the springs, at some samples."""

import numpy as np
from scipy.spatial.transform import Rotation

from sgnlp.base import palette
from sgnlp.base.arrays import Array, IntArray
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import tips
from sgnlp.hand.meshes import link_poses
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion.trajectory import APPROACH, CLOSE, LIFT, SQUEEZE, Trajectory
from sgnlp.show.scene_parts import SPRINGS, Frame, Stage
from sgnlp.show.scene_shapes import segments

MOST = 60
"""Largest number of frames: the page stays small, and a browser draws about 10 in a second."""
WIDTH = 4.0
"""Width of a spring that is drawn as a straight line [pixel]."""


def frames(made: Trajectory, grasps: Grasps, hand: Hand) -> tuple[Frame, ...]:
    """The frames of the trajectory of one of the grasps. While fingers squeeze they are drawn where they touch."""
    return tuple(_frame(made, grasps, hand, k) for k in chosen(made).tolist())


def poses(hand: Hand, wrist: Array, joints: Array, arm_joints: Array) -> Array:
    """Poses (L, 4, 4) of the meshes of the hand, followed by those of its arm at joints (a,)."""
    own, arm = link_poses(hand, wrist, joints), hand.arm
    return own if arm is None else np.concatenate([own, link_poses(arm, arm.base, arm_joints)])


def chosen(made: Trajectory) -> IntArray:
    """The samples that are shown: evenly spaced in time, and the end of each phase."""
    ends = made.ends
    return np.unique(np.concatenate([np.linspace(0, len(made) - 1, MOST - len(ends)).astype(int), ends]))


def _frame(made: Trajectory, grasps: Grasps, hand: Hand, k: int) -> Frame:
    phase, rank = str(made.phase[k]), int(made.meta["rank"])
    joints = made.joints[k] if phase in (APPROACH, CLOSE) else grasps.joints_contact[rank]
    rotation, translation = carried(made, grasps, k)
    pairs = zip(tips(hand, made.wrist[k], joints), made.setpoints[k], strict=True)
    pulls = [segments(SPRINGS, np.stack(pair), palette.finger(i), WIDTH) for i, pair in enumerate(pairs)]
    return Frame(
        time=float(made.times[k]),
        links=poses(hand, made.wrist[k], joints, made.arm[k]),
        stage=Stage(phase, rotation, translation, tuple(pulls)),
    )


def carried(made: Trajectory, grasps: Grasps, k: int) -> tuple[Array, Array]:
    """The object's motion (3, 3), (3,) at a sample: to the equilibrium in step with the squeeze, and up."""
    rank, phase = int(made.meta["rank"]), made.phase[k]
    if phase in (APPROACH, CLOSE):
        return np.eye(3), np.zeros(3)
    R, t, middle = grasps.rotation_eq[rank], grasps.translation_eq[rank], grasps.contacts[rank].mean(axis=0)
    touch, press = made.setpoints[made.last(CLOSE)], made.setpoints[made.last(SQUEEZE)]
    way = float(np.linalg.norm(press - touch))
    share = 1.0 if phase == LIFT or way == 0 else float(np.linalg.norm(made.setpoints[k] - touch)) / way
    rotation = Rotation.from_rotvec(share * Rotation.from_matrix(R).as_rotvec()).as_matrix()
    rise = made.wrist[k, :3] - made.wrist[made.last(SQUEEZE), :3]
    return rotation, middle + share * (R @ middle + t - middle) - rotation @ middle + rise
