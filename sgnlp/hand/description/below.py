"""The tree below a link of a description, as elements of a URDF."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from sgnlp.base.errors import InputError
from sgnlp.hand.description.mjcf import read_mjcf
from sgnlp.hand.description.tree import check_tree, cut, named
from sgnlp.hand.description.xml_file import read_xml


def below(file: Path, root: str | None) -> ElementTree.Element:
    """The links and joints from the link `root` on, of a URDF or of an MJCF, which MuJoCo reads.

    Raises:
        InputError: the file is neither, its links and joints are not a tree, or the link does not exist.
    """
    robot = read_xml(file)
    try:
        if robot.tag == "mujoco":
            return read_mjcf(file, root)
        check_tree(named(robot, "link"), named(robot, "joint"))
        cut(robot, root)
    except InputError as error:
        raise error.within(file.name) from None
    return robot
