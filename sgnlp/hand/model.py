"""The tree of a hand's joints, from its URDF: which joints there are, how far they go, and which follow others.

A joint that mimics another stands at `multiplier · q + offset`, with q of the joint that it follows. It has no
coordinate of its own; its limits narrow those of the other.
"""

import functools
import importlib.metadata
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.hand.yaml_nodes import mapping, unknown_name


@dataclass(frozen=True)
class Mimic:
    """The joint `name` follows joint number `joint` of the hand's `joint_names`: multiplier · q + offset."""

    name: str
    joint: int
    multiplier: float
    offset: float  # [rad or m]

    def angle(self, q: Any) -> Any:
        """Where it stands [rad or m], for q of the joint that it follows."""
        return self.multiplier * q + self.offset


def urdf_file(source: Any, folder: Path) -> Path:
    """The URDF: a file beside the YAML, or a path inside an installed package that carries no Python module.

    Raises:
        InputError: it is not there.
    """
    if isinstance(source, str):
        path: Path | None = folder / source
    else:
        source = mapping(source, "urdf", ("package", "path"))
        path = _packaged(source["package"], source["path"])
    if path is None or not path.is_file():
        raise InputError(f"the URDF {source} is not there; is its package installed?")
    return path


@functools.cache
def _packaged(package: str, path: str) -> Path | None:
    shared = Path(sys.prefix) / "share" / package / path  # where conda and source builds put it
    if shared.is_file():
        return shared
    try:
        files = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    return next((Path(str(f.locate())) for f in files if str(f).endswith(f"{package}/{path}")), None)


def joint_model(description: str) -> pin.Model:
    """The tree of joints with the root link fixed at the origin; mimic joints narrow the limits of those they follow.

    `description` is that of `sgnlp.hand.description`. Raises:
        InputError: a joint mimics one that comes later, or leaves nothing of that joint's limits.
    """
    joints = ElementTree.fromstring(description).findall("joint")
    coupled = {joint.get("name", ""): joint for joint in joints if joint.find("mimic") is not None}
    try:
        free = pin.buildModelFromXML(description)
        _check_order(free, coupled)
        model = pin.buildModelFromXML(description, mimic=True) if coupled else free
    except (ValueError, RuntimeError) as error:
        raise InputError(f"Pinocchio cannot read the URDF: {' '.join(str(error).split())}") from None
    for mimic in mimics(model):
        limit = coupled[mimic.name].find("limit")
        assert limit is not None  # every moving joint of a description has one
        _narrow(model, mimic, limit)
    return model


def _check_order(free: pin.Model, coupled: dict[str, ElementTree.Element]) -> None:
    """Refuse a joint that mimics one that comes later in the model, where all joints have coordinates of their own."""
    for name, joint in coupled.items():
        mimic = joint.find("mimic")
        assert mimic is not None
        other = mimic.get("joint", "")
        if free.getJointId(other) > free.getJointId(name):
            k, b = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
            law = f"multiplier {1 / k:g}, offset {-b / k + 0.0:g}"
            change = f"let '{other}' mimic '{name}' ({law}), and give '{name}' no <mimic>"
            raise InputError(f"the URDF's joint '{name}' mimics '{other}', which comes later; {change}")


def own_joints(model: pin.Model) -> tuple[str, ...]:
    """The names of the joints that have a coordinate, in the order of the coordinates."""
    return tuple(name for name, joint in zip(model.names[1:], model.joints[1:], strict=True) if joint.nq == 1)


def mimics(model: pin.Model) -> tuple[Mimic, ...]:
    """The joints that have none, in the order of the model."""
    found = []
    for i in range(1, model.njoints):
        if model.joints[i].nq == 0:
            joint = model.joints[i].extract()
            found.append(Mimic(model.names[i], model.idx_qs[i], joint.scaling, joint.offset))
    return tuple(found)


def link(name: Any, model: pin.Model, kind: str) -> int:
    """The index of the link's frame in the model.

    Raises:
        InputError: there is no such link; `kind` says what it was needed for.
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


def _narrow(model: pin.Model, mimic: Mimic, limit: ElementTree.Element) -> None:
    """Narrow the limits of the joint that a mimic follows to those between which the mimic keeps its own."""
    ends = [(float(limit.get(key, "nan")) - mimic.offset) / mimic.multiplier for key in ("lower", "upper")]
    i, (low, high) = mimic.joint, sorted(ends)
    model.lowerPositionLimit[i] = low = max(low, model.lowerPositionLimit[i])
    model.upperPositionLimit[i] = high = min(high, model.upperPositionLimit[i])
    if not low < high:
        followed = own_joints(model)[i]
        raise InputError(f"the limits of '{mimic.name}' leave nothing of those of '{followed}', which it mimics")
