"""The parts of an arm's file `arm.yaml`, and the needed part of its URDF or MJCF. `urdf/README.md` has the keys."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from typing import Any

import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import any_mapping, frozen, mapping, numbers, positive, unknown_name
from sgnlp.hand import plausible
from sgnlp.hand.description.tree import end
from sgnlp.hand.hand_file import POSE_KEYS, mount

KEYS = ("name", "urdf", "root", "flange", "home", "base", "mount", "spheres", "pairs")
OPTIONAL = ("velocity", "effort")
"""Keys that replace values which a description may lack: an MJCF has no velocities."""
SPANS = {"velocity": plausible.VELOCITY, "effort": plausible.ARM_EFFORT}
"""What the numbers of these keys can be."""
DEFAULT = "default"
"""The key of the mount for every hand without its own."""


def chain(description: str, flange: str) -> str:
    """The description without links on the flange, and without links moved by joints off the way to it.

    A link stays if it is on the way from the root to the flange, or fixed to such a link other than the flange.

    Raises:
        InputError: the link does not exist, no joint moves it, or a joint on the way mimics another.
    """
    robot = ElementTree.fromstring(description)
    links = {link.get("name", ""): link for link in robot.findall("link")}
    joints = {end(joint, "child"): joint for joint in robot.findall("joint")}
    if flange not in links:
        raise unknown_name("flange", flange, links)
    way = [flange]
    while way[-1] in joints:
        way.append(end(joints[way[-1]], "parent"))
    _check_way([joints[link] for link in way[:-1]], flange)

    def stays(link: str) -> bool:
        if link in way:
            return True
        joint = joints[link]
        return joint.get("type") == "fixed" and end(joint, "parent") != flange and stays(end(joint, "parent"))

    for link in [link for link in links if not stays(link)]:
        robot.remove(links[link])
        robot.remove(joints[link])
    return ElementTree.tostring(robot, encoding="unicode")


def _check_way(way: Sequence[ElementTree.Element], flange: str) -> None:
    moving = [joint for joint in way if joint.get("type") != "fixed"]
    if not moving:
        raise InputError(f"no joint moves the flange '{flange}'; name the link that the hand is screwed to")
    for joint in moving:
        if joint.find("mimic") is not None:
            raise InputError(f"joint '{joint.get('name')}' of the arm mimics another; remove its <mimic>")


def limits(data: Mapping[str, Any], kind: str, described: Array, names: Sequence[str], model: pin.Model) -> Array:
    """The largest efforts or velocities (a,): a number for every joint in the file, else those of the description."""
    if kind in data:
        told = mapping(data[kind], kind, names)
        values, where = numbers([told[name] for name in names], (len(names),), kind), f"{kind} of joint"
    else:
        values, where = frozen(described), f"key '{kind}' is missing; {kind} in the description of joint"
    for name, value in zip(names, values, strict=True):
        positive(value, f"{where} '{name}'")
    try:
        plausible.check_joints(model, names, values, SPANS[kind], f"{kind} of joint")
    except InputError as error:
        if kind in data:
            raise
        raise InputError(f"{error}; or give those of all joints as '{kind}'") from None
    return values


def mounts(node: Any) -> dict[str, Array]:
    """The poses (7,) of the hands' root links in the flange's frame, by the name of the hand or by `DEFAULT`."""
    if any(key in POSE_KEYS for key in any_mapping(node, "mount")):
        return {DEFAULT: mount(node, "mount")}
    if DEFAULT not in node:
        raise InputError(f"mount: the key '{DEFAULT}' is missing; give position and euler_deg, or a pose a hand")
    return {name: mount(one, f"mount of '{name}'") for name, one in any_mapping(node, "mount").items()}
