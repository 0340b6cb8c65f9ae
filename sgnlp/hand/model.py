"""The tree of a hand's joints, from its URDF: the joints, their limits, and mimic joints.

A mimic joint is at `multiplier · q + offset`, with q of the joint that it follows. It has no coordinate of its own; its
limits narrow those of the other joint.
"""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import unknown_name

NORM_OFF = 1e-3
"""By which the norm of a pose's quaternion may be off 1: poses have at least four digits."""


@dataclass(frozen=True)
class Mimic:
    """The joint `name` follows joint number `joint` of the hand's `joint_names`: multiplier · q + offset."""

    name: str
    joint: int
    multiplier: float
    offset: float  # [rad or m]

    def angle(self, q: Any) -> Any:
        """Its position [rad or m], for q of the joint that it follows."""
        return self.multiplier * q + self.offset


def joint_model(description: str) -> pin.Model:
    """The tree of joints with the root link fixed at the origin; mimic joints narrow the limits of those they follow.

    `description` is that of `sgnlp.hand.description`. Raises:
        InputError: Pinocchio cannot read it, or a mimic joint leaves no range to the joint that it follows.
    """
    joints = ElementTree.fromstring(description).findall("joint")
    coupled = {joint.get("name", ""): joint for joint in joints if joint.find("mimic") is not None}
    model = read_model(description, mimic=bool(coupled))
    for mimic in mimics(model):
        limit = coupled[mimic.name].find("limit")
        assert limit is not None  # every moving joint of a description has one
        _narrow(model, mimic, limit)
    return model


def read_model(description: str, mimic: bool) -> pin.Model:
    """The tree of joints as Pinocchio reads it; if not `mimic`, every joint has a coordinate of its own.

    Raises:
        InputError: Pinocchio cannot read it.
    """
    try:
        return pin.buildModelFromXML(description, mimic=mimic)
    except (ValueError, RuntimeError) as error:
        raise InputError(f"Pinocchio cannot read the URDF: {' '.join(str(error).split())}") from None


def own_joints(model: pin.Model) -> tuple[str, ...]:
    """The names of the joints that have a coordinate, in the order of the coordinates."""
    return tuple(name for name, joint in zip(model.names[1:], model.joints[1:], strict=True) if joint.nq == 1)


def mimics(model: pin.Model) -> tuple[Mimic, ...]:
    """The joints without a coordinate, in the order of the model."""
    found = []
    for i in range(1, model.njoints):
        if model.joints[i].nq == 0:
            joint = model.joints[i].extract()
            found.append(Mimic(model.names[i], model.idx_qs[i], joint.scaling, joint.offset))
    return tuple(found)


def link(name: Any, model: pin.Model, kind: str) -> int:
    """The index of the link's frame in the model.

    Raises:
        InputError: the link does not exist; the message calls it a `kind`.
    """
    if not model.existFrame(str(name), pin.FrameType.BODY):
        raise unknown_name(kind, str(name), [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY])
    return model.getFrameId(str(name), pin.FrameType.BODY)


def coordinates(model: pin.Model, frame: int) -> tuple[int, ...]:
    """The coordinates that move a frame, from the root on; a mimic joint counts as the one that it follows."""
    support = model.supports[model.frames[frame].parentJoint]
    return tuple(dict.fromkeys(model.idx_qs[joint] for joint in support if joint > 0))


def places(model: pin.Model, root: Array, joints: Array, points: list[tuple[str, Array]]) -> Array:
    """World positions (K, 3) [m] of points fixed to links, for the root link at `root` (7,), by numeric Pinocchio."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.asarray(joints, float))
    base = pin.XYZQUATToSE3(np.asarray(root, float))
    frames = [(model.getFrameId(link, pin.FrameType.BODY), point) for link, point in points]
    rows = [base.act(data.oMf[frame].act(np.array(point))) for frame, point in frames]
    return np.array(rows).reshape(-1, 3)


def check_unit(pose: Array, name: str) -> None:
    """Raise `InputError` if the quaternion of a pose (7,) has not the norm 1."""
    x, y, z, w = pose[3:].tolist()
    if not abs((x * x + y * y + z * z + w * w) ** 0.5 - 1.0) <= NORM_OFF:  # NaN too
        raise InputError(f"{name} must be x y z [m] and a unit quaternion qx qy qz qw, not {pose}")


def _narrow(model: pin.Model, mimic: Mimic, limit: ElementTree.Element) -> None:
    """Narrow the limits of the joint that a mimic joint follows, so that the mimic joint keeps its own limits."""
    ends = [(float(limit.get(key, "nan")) - mimic.offset) / mimic.multiplier for key in ("lower", "upper")]
    i, (low, high) = mimic.joint, sorted(ends)
    model.lowerPositionLimit[i] = low = max(low, model.lowerPositionLimit[i])
    model.upperPositionLimit[i] = high = min(high, model.upperPositionLimit[i])
    if not low < high:
        followed = own_joints(model)[i]
        raise InputError(f"the limits of '{mimic.name}' leave nothing of those of '{followed}', which it mimics")
