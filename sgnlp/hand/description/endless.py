"""The joints of a description without limits, for which a hand's file must give limits."""

from pathlib import Path

from sgnlp.hand.description.below import below
from sgnlp.hand.description.joints import MOVING
from sgnlp.hand.description.tree import named


def endless(file: Path, root: str | None = None) -> dict[str, bool]:
    """The joints below the link `root` that are continuous or have no limits, and whether each is rotational.

    Raises:
        InputError: the file is neither a URDF nor an MJCF, or the link does not exist.
    """
    joints = named(below(file, root), "joint")
    return {
        name: joint.get("type") != "prismatic"
        for name, joint in joints.items()
        if joint.get("type") == "continuous" or (joint.get("type") in MOVING and joint.find("limit") is None)
    }
