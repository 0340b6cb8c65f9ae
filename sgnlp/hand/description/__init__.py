"""A hand's or an arm's description, checked and written anew as the one text that Pinocchio and MuJoCo both read.

In it every mesh has its absolute path, a joint that mimics one that mimics another follows that other itself, and a
link has its visual geometry, or where it has none its collision geometry in that place. What neither of them needs is
left out.
"""

import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from sgnlp.base.errors import InputError
from sgnlp.hand.description.changes import UNCHANGED, Changes, apply_changes
from sgnlp.hand.description.joints import check_joint
from sgnlp.hand.description.links import dress, strip
from sgnlp.hand.description.mimics import resolve_mimics
from sgnlp.hand.description.numbers import check_numbers
from sgnlp.hand.description.tree import check_tree, cut, named
from sgnlp.hand.description.urdf import read_urdf

__all__ = ["UNCHANGED", "Changes", "description"]


def description(file: Path, root: str | None = None, changes: Changes = UNCHANGED) -> str:
    """The text of a URDF for both readers: what hangs below the link `root`, if None the file's own root link.

    Raises:
        InputError: it is no URDF, it is xacro, or a link, joint, number or mesh of it is not valid.
    """
    robot = read_urdf(file)
    try:
        check_tree(named(robot, "link"), named(robot, "joint"))
        cut(robot, root)
        links, joints = named(robot, "link"), named(robot, "joint")
        for kind, elements in (("link", links), ("joint", joints)):
            for name, element in elements.items():
                check_numbers(element, f"{kind} '{name}'")
        apply_changes(joints, changes)
        for name, joint in joints.items():
            check_joint(name, joint)
        resolve_mimics(joints)
        for name, link in links.items():
            dress(name, link, Path(os.path.abspath(file.parent)))
    except InputError as error:
        raise InputError(f"{file.name}: {error}") from None
    strip(robot)
    return ElementTree.tostring(robot, encoding="unicode")
