"""A motion as ROS 2 messages: plain values with every field of the message, in the message's order.

trajectory_msgs/JointTrajectory, moveit_msgs/Grasp and geometry_msgs/PoseStamped. Joints are those of the arm, if there
is one, and then those of the hand. The wrist is the hand's root link.
"""

from math import isfinite
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion.trajectory import APPROACH, SQUEEZE, Trajectory

NANO = 10**9
UNKNOWN = -1.0
"""`grasp_quality` of a grasp whose confidence is unknown."""


def joint_trajectory(made: Trajectory) -> dict[str, Any]:
    """trajectory_msgs/JointTrajectory: setpoints under position control."""
    names = [*made.arm_joint_names.tolist(), *made.joint_names.tolist()]
    positions, velocities = np.hstack([made.arm, made.joints]), made.velocities
    points = [_point(t, q, v) for t, q, v in zip(made.times, positions, velocities, strict=True)]
    return {"header": _header(made), "joint_names": names, "points": points}


def pregrasp(made: Trajectory) -> dict[str, Any]:
    """geometry_msgs/PoseStamped of the hand's root link at the pregrasp."""
    x, y, z, qx, qy, qz, qw = made.wrist[made.last(APPROACH)].tolist()
    pose = {"position": {"x": x, "y": y, "z": z}, "orientation": {"x": qx, "y": qy, "z": qz, "w": qw}}
    return {"header": _header(made), "pose": pose}


def grasp(made: Trajectory, grasps: Grasps) -> dict[str, Any]:
    """moveit_msgs/Grasp: approach from the stand-off, retreat by the lift, and after placing along the approach."""
    rank = int(made.meta["rank"])
    confidence = float(grasps.confidence[rank])
    end = made.last(APPROACH)
    way, rise = made.wrist[end, :3] - made.wrist[0, :3], made.wrist[-1, :3] - made.wrist[end, :3]
    effort = grasps.torques_eq[rank]
    return {
        "id": f"{made.meta['object']} {made.meta['start']}",
        "pre_grasp_posture": _posture(made, made.joints[end], np.empty(0)),
        "grasp_posture": _posture(made, made.joints[made.last(SQUEEZE)], effort),
        "grasp_pose": pregrasp(made),
        "grasp_quality": confidence if isfinite(confidence) else UNKNOWN,
        "pre_grasp_approach": _translation(made, way),
        "post_grasp_retreat": _translation(made, rise),
        "post_place_retreat": _translation(made, -way),
        "max_contact_force": float(np.linalg.norm(grasps.forces_eq[rank], axis=1).max()),
        "allowed_touch_objects": [str(made.meta["object"])],
    }


def _header(made: Trajectory) -> dict[str, Any]:
    return {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": str(made.meta["frame"])}


def _point(time: float, positions: Array, velocities: Array, effort: Array | None = None) -> dict[str, Any]:
    sec, nanosec = divmod(round(float(time) * NANO), NANO)
    return {
        "positions": positions.tolist(),
        "velocities": velocities.tolist(),
        "accelerations": [],
        "effort": [] if effort is None else effort.tolist(),
        "time_from_start": {"sec": sec, "nanosec": nanosec},
    }


def _posture(made: Trajectory, joints: Array, effort: Array) -> dict[str, Any]:
    """A trajectory_msgs/JointTrajectory of the hand with one point."""
    point = _point(0.0, joints, np.empty(0), effort)
    return {"header": _header(made), "joint_names": made.joint_names.tolist(), "points": [point]}


def _translation(made: Trajectory, way: Array) -> dict[str, Any]:
    """A moveit_msgs/GripperTranslation along a way (3,) [m]; all of it was checked, so its whole length is required."""
    length = float(np.linalg.norm(way))
    x, y, z = (way / length).tolist()
    direction = {"header": _header(made), "vector": {"x": x, "y": y, "z": z}}
    return {"direction": direction, "desired_distance": length, "min_distance": length}
