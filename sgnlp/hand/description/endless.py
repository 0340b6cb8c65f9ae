"""Which joints of a description have no ends, so that a hand's file must give them limits."""

from pathlib import Path

from sgnlp.base.errors import InputError
from sgnlp.hand.description.joints import MOVING
from sgnlp.hand.description.mjcf import read_mjcf
from sgnlp.hand.description.tree import check_tree, cut, named
from sgnlp.hand.description.xml_file import read_xml


def endless(file: Path, root: str | None = None) -> dict[str, bool]:
    """The joints below the link `root` that are continuous or have no limits, and whether each of them turns.

    Raises:
        InputError: the file is neither a URDF nor an MJCF, or has no such link.
    """
    robot = read_xml(file)
    try:
        if robot.tag == "mujoco":
            robot = read_mjcf(file, root)
        else:
            check_tree(named(robot, "link"), named(robot, "joint"))
            cut(robot, root)
    except InputError as error:
        raise InputError(f"{file.name}: {error}") from None
    kinds = {name: (joint.get("type"), joint.find("limit")) for name, joint in named(robot, "joint").items()}
    return {
        name: kind != "prismatic"
        for name, (kind, limit) in kinds.items()
        if kind == "continuous" or (kind in MOVING and limit is None)
    }
