"""The description of a hand or an arm: a URDF or MJCF, checked and rewritten as one URDF for Pinocchio and MuJoCo.

In it every mesh has its absolute path, and chains of mimic joints are resolved. A link has its visual geometry, or its
collision geometry if it has no visual one. Everything that neither program needs is left out.
"""

import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from sgnlp.base.errors import InputError
from sgnlp.hand.description.below import below
from sgnlp.hand.description.changes import UNCHANGED, Changes, apply_changes
from sgnlp.hand.description.joints import bare, check_joint
from sgnlp.hand.description.links import dress, strip
from sgnlp.hand.description.mimics import resolve_mimics
from sgnlp.hand.description.mirror import mirror
from sgnlp.hand.description.numbers import check_numbers
from sgnlp.hand.description.tree import named

__all__ = ["UNCHANGED", "Changes", "description"]


def description(file: Path, root: str | None = None, changes: Changes = UNCHANGED) -> str:
    """The text of the URDF for both programs: the tree below the link `root`, with the changes of the hand's file.

    The file is a URDF, or an MJCF, which MuJoCo reads and whose bodies become links. By default the root is the root
    link of the URDF, or the only body in the world of the MJCF.

    Raises:
        InputError: the file is neither, it is xacro, or a link, joint, number, mesh or change is invalid.
    """
    robot = below(file, root)
    try:
        _check(robot, changes)
        for name, link in named(robot, "link").items():
            dress(name, link, Path(os.path.abspath(file.parent)))
        strip(robot)
        resolve_mimics(robot)
    except InputError as error:
        raise error.within(file.name) from None
    if changes.mirror:
        mirror(robot)
    return ElementTree.tostring(robot, encoding="unicode")


def _check(robot: ElementTree.Element, changes: Changes) -> None:
    """Check that numbers are valid, and that with the changes each joint is fixed, has limits, or follows another."""
    links, joints = named(robot, "link"), named(robot, "joint")
    for joint in joints.values():
        if joint.get("type") == "fixed":
            bare(joint)
    for kind, elements in (("link", links), ("joint", joints)):
        for name, element in elements.items():
            check_numbers(element, f"{kind} '{name}'")
    apply_changes(joints, changes)
    for name, joint in joints.items():
        check_joint(name, joint)
