"""Poses of the wrist around an object."""

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array

TILT = np.radians(20)
"""Largest turn of a pose about each horizontal axis [rad]."""
PART = np.array([0.25, 0.25, 0.4])
"""The middle of the grasp is drawn within this share of the cloud's box on both sides of the box's middle."""


def turned(wrist: Array, centre: Array, yaw: float) -> Array:
    """The pose turned by `yaw` [rad] about the vertical through `centre` (3)."""
    turn = pin.SE3(pin.utils.rotate("z", yaw), np.zeros(3))
    pose = pin.XYZQUATToSE3(wrist)
    pose.translation -= centre
    pose = turn * pose
    pose.translation += centre
    return np.asarray(pin.SE3ToXYZQUAT(pose))


def others(poses: Array, middle: Array, box: Array, count: int, rng: np.random.Generator) -> Array:
    """Poses (count, 7), each one of some poses (W, 7), turned about the vertical, tilted, and moved.

    They are moved so that `middle` (3,) [m], that of the grasp in the frame of the root link, is in the box (2, 3) [m].
    """
    centre, extents, found = box.mean(axis=0), box[1] - box[0], []
    for _ in range(count):
        pose = pin.XYZQUATToSE3(turned(poses[rng.integers(len(poses))], centre, rng.uniform(-np.pi, np.pi)))
        tilt = pin.exp3(np.append(rng.uniform(-TILT, TILT, 2), 0.0))
        rotation = tilt @ pose.rotation
        place = centre + rng.uniform(-1, 1, 3) * PART * extents
        found.append(np.asarray(pin.SE3ToXYZQUAT(pin.SE3(rotation, place - rotation @ middle))))
    return np.array(found)
