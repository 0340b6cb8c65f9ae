"""Changes that a hand's file makes to its description."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, field

from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import unknown_name


@dataclass(frozen=True)
class Changes:
    """Limits, couplings and mirroring in a hand's file."""

    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By joint: lower and upper limit [rad or m]."""
    couplings: Mapping[str, tuple[str, float, float]] = field(default_factory=dict)
    """By joint: the joint that it follows, multiplier, and offset [rad or m]."""
    mirror: bool = False
    """Whether the hand is the mirror image in the plane y = 0 of the root link."""


UNCHANGED = Changes()


def apply_changes(joints: Mapping[str, ElementTree.Element], changes: Changes) -> None:
    """Replace the joints' limits and couplings by those of the hand's file.

    Raises:
        InputError: a joint does not exist, or is fixed.
    """
    for key, named in (("limits", changes.limits), ("couplings", changes.couplings)):
        for name in named:
            if name not in joints:
                raise unknown_name(f"joint in {key}", name, joints)
            if joints[name].get("type") == "fixed":
                raise InputError(f"{key}: joint '{name}' is fixed; remove it there")
    for name, (lower, upper) in changes.limits.items():
        joint = joints[name]
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
        _only(joint, "limit").attrib.update(lower=repr(float(lower)), upper=repr(float(upper)))
    for name, (followed, multiplier, offset) in changes.couplings.items():
        law = {"multiplier": repr(float(multiplier)), "offset": repr(float(offset))}
        _only(joints[name], "mimic").attrib.update(joint=followed, **law)


def _only(joint: ElementTree.Element, tag: str) -> ElementTree.Element:
    """The joint's element with this tag, which is added if missing."""
    found = joint.find(tag)
    return ElementTree.SubElement(joint, tag) if found is None else found
