"""The bare tree of a description: which link hangs on which, as far as a search for the palm needs it."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from sgnlp.base.errors import InputError
from sgnlp.hand.description.mjcf import mjcf_bones
from sgnlp.hand.description.poses import add
from sgnlp.hand.description.tree import check_tree, end, named
from sgnlp.hand.description.xml_file import read_xml


def bones(file: Path) -> str:
    """A URDF of all links and joints, without geometry and numbers; joints that are not fixed turn by a radian.

    What only a part of a robot besides its hand has, such as a mesh that is not there, is no obstacle here.

    Raises:
        InputError: the file is neither a URDF nor an MJCF, or its links and joints are not a tree.
    """
    robot = read_xml(file)
    try:
        if robot.tag == "mujoco":
            return _tree(file.stem, *mjcf_bones(file))
        links, joints = named(robot, "link"), named(robot, "joint")
        check_tree(links, joints)
    except InputError as error:
        raise error.within(file.name) from None
    ends = {
        name: (end(joint, "parent"), end(joint, "child"), joint.get("type") != "fixed")
        for name, joint in joints.items()
    }
    return _tree(robot.get("name", ""), list(links), ends)


def _tree(name: str, links: list[str], joints: dict[str, tuple[str, str, bool]]) -> str:
    """A URDF of links, and of joints between a parent and a child, moving or not."""
    robot = ElementTree.Element("robot", name=name)
    for link in links:
        add(robot, "link", name=link)
    for joint, (parent, child, moves) in joints.items():
        made = add(robot, "joint", name=joint, type="revolute" if moves else "fixed")
        add(made, "parent", link=parent)
        add(made, "child", link=child)
        add(made, "limit", lower="-1", upper="1", effort="0", velocity="0")
    return ElementTree.tostring(robot, encoding="unicode")
