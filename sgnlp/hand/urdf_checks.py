"""A hand's URDF, checked and written anew as the one text that Pinocchio and MuJoCo both read.

In it every mesh has its absolute path, a joint that mimics one that mimics another follows that other itself, and a
link has its visual geometry, or where it has none its collision geometry in that place. What neither of them needs is
left out.
"""

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Collection
from pathlib import Path

import numpy as np

from sgnlp.base.errors import InputError
from sgnlp.hand.paths import mesh_file
from sgnlp.hand.yaml_nodes import unknown_name

Element = ElementTree.Element

MOVING = ("revolute", "prismatic")
INERTIA = dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1)
NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "mimic": {"multiplier": 1, "offset": 1},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "box": {"size": 3},
    "mesh": {"scale": 3},
    "mass": {"value": 1},
    "inertia": INERTIA,
}
"""How many numbers the attributes of an element of a link or joint hold."""
SOLIDS = ("sphere", "cylinder", "capsule", "box")


def description(urdf: Path) -> str:
    """The text of a URDF for both readers.

    Raises:
        InputError: it is no URDF, it is xacro, or a link, joint, number or mesh of it is not valid.
    """
    robot = _robot(urdf)
    try:
        links, joints = _named(robot, "link"), _named(robot, "joint")
        for kind, elements in (("link", links), ("joint", joints)):
            for name, element in elements.items():
                _check_numbers(element, f"{kind} '{name}'")
        _check_tree(links, joints)
        for name, joint in joints.items():
            _check_joint(name, joint)
        _resolve_mimics(joints)
        for name, link in links.items():
            _dress(name, link, Path(os.path.abspath(urdf.parent)))
    except InputError as error:
        raise InputError(f"{urdf.name}: {error}") from None
    _strip(robot)
    return ElementTree.tostring(robot, encoding="unicode")


def _robot(urdf: Path) -> Element:
    """The root element; refused where it is none of a URDF, or xacro that nobody expanded."""
    expand = f"expand it (pip install xacro; xacro {urdf.name} -o expanded.urdf) and name the result in the hand's file"
    try:
        robot = ElementTree.parse(urdf).getroot()
    except OSError as error:
        raise InputError(f"{urdf.name} cannot be read: {error.strerror}") from None
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        if "unbound prefix" in str(error) and b"xacro:" in urdf.read_bytes():
            raise InputError(f"{urdf.name} is xacro; {expand}") from None
        if "invalid token" in str(error) and not _is_utf8(urdf):
            raise InputError(f"{urdf.name} is not UTF-8; save it so, or declare its encoding in <?xml ?>") from None
        raise InputError(f"{urdf.name} is no URDF that can be read: {' '.join(str(error).split())}") from None
    for element in robot.iter():
        texts = [element.tag, *element.attrib.values(), element.text or ""]
        left = next((text for text in texts if "xacro}" in text or "${" in text or "$(" in text), None)
        if left is not None:
            shown = f"<xacro:{left.rpartition('}')[2]}>" if "xacro}" in left else f"'{left.strip()}'"
            raise InputError(f"{urdf.name} is xacro, it has {shown}; {expand}")
    if robot.tag != "robot":
        raise InputError(f"{urdf.name} is no URDF that can be read: its root is <{robot.tag}>, not <robot>")
    return robot


def _is_utf8(file: Path) -> bool:
    try:
        file.read_bytes().decode()
    except UnicodeDecodeError:
        return False
    return True


def _named(robot: Element, kind: str) -> dict[str, Element]:
    """The links or joints by name."""
    found: dict[str, Element] = {}
    for element in robot.findall(kind):
        name = element.get("name", "")
        if not name:
            raise InputError(f"a {kind} has no name; give each one its own")
        if name in found:
            raise InputError(f"two {kind}s have the name '{name}'; give each one its own")
        found[name] = element
    if kind == "link" and not found:
        raise InputError("has no link; a hand has a root link and one a joint")
    return found


def _check_numbers(element: Element, owner: str) -> None:
    """All numbers of a link or joint are finite, sizes are positive, and no mass is negative."""
    for part in element.iter():
        for key, count in NUMBERS.get(part.tag, {}).items():
            text = part.get(key)
            if text is None:
                if part.tag in SOLIDS:
                    raise InputError(f"{owner}: <{part.tag}> has no {key}; give it one [m]")
                continue
            values = _floats(text)
            what = f"{owner}: {key} of <{part.tag}>"
            if values is None or len(values) != count or not np.isfinite(values).all():
                number = "a finite number" if count == 1 else f"{count} finite numbers with spaces between"
                raise InputError(f"{what} must be {number}, not '{text}'")
            if part.tag in SOLIDS and min(values) <= 0:
                raise InputError(f"{what} must be positive, not '{text}'")
            if (part.tag == "mesh" and 0 in values) or (part.tag == "axis" and not any(values)):
                raise InputError(f"{what} must not be 0, but is '{text}'")
            if part.tag == "mass" and values[0] < 0:
                raise InputError(f"{what} must not be negative, but is {text}")


def _floats(text: str) -> list[float] | None:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return None


def _check_tree(links: Collection[str], joints: dict[str, Element]) -> None:
    """The joints join all links to one tree."""
    above: dict[str, str] = {}
    for name, joint in joints.items():
        ends = []
        for end in ("parent", "child"):
            element = joint.find(end)
            link = "" if element is None else element.get("link", "")
            if not link:
                raise InputError(f"joint '{name}' has no {end}; add <{end} link=\"...\"/>")
            if link not in links:
                raise unknown_name(f"{end} of joint '{name}'", link, links)
            ends.append(link)
        if ends[1] in above:
            raise InputError(f"link '{ends[1]}' is the child of two joints, '{name}' the second; a hand is a tree")
        above[ends[1]] = ends[0]
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        names = ", ".join(f"'{root}'" for root in roots)
        raise InputError(f"has {len(roots)} root links, {names}; join them by fixed joints, or remove the others")
    for link in links:
        line = [link]
        while line[-1] in above:
            line.append(above[line[-1]])
            if line[-1] in line[:-1]:
                raise InputError(f"the joints above link '{line[-1]}' form a circle; a hand is a tree")


def _check_joint(name: str, joint: Element) -> None:
    """A joint is fixed, or moves between limits; the effort is the hand's file's, and nothing needs the velocity."""
    kind, limit = joint.get("type", ""), joint.find("limit")
    if kind == "fixed":
        for left in [*joint.findall("mimic"), *joint.findall("limit")]:
            joint.remove(left)
        return
    if kind == "continuous":
        ends = "give it a <limit> with lower and upper [rad]"
        if limit is not None and limit.get("upper") is not None:
            ends = f"its limits {limit.get('lower', '0')} to {limit.get('upper')} rad count then"
        raise InputError(f"joint '{name}' is continuous, without an end; write type=\"revolute\", and {ends}")
    if kind not in MOVING:
        instead = "make it fixed; the wrist's pose is planned beside the joints"
        raise InputError(
            f"joint '{name}' is {kind or 'of no type'}; only revolute, prismatic and fixed ones work: {instead}"
        )
    if limit is None:
        raise InputError(f"joint '{name}' has no <limit>; give it one with lower and upper, or make the joint fixed")
    for key in ("lower", "upper", "effort", "velocity"):
        limit.set(key, limit.get(key, "0"))  # the last two are not used
    low, high, *powers = (float(limit.get(key, "")) for key in ("lower", "upper", "effort", "velocity"))
    if min(powers) < 0:
        raise InputError(f"joint '{name}' has a negative effort or velocity in its <limit>; write 0 or more")
    if not low < high:
        change = "swap them" if low > high else "write lower and upper, or make the joint fixed"
        raise InputError(f"joint '{name}' has the limits [{low:g}, {high:g}]; lower must be below upper: {change}")


def _resolve_mimics(joints: dict[str, Element]) -> None:
    """Let each mimic joint follow one that moves by itself: q₁ = a q₂ + b of q₂ = c q₃ + d is a c q₃ + a d + b."""
    mimics = {name: found for name, joint in joints.items() if (found := joint.find("mimic")) is not None}
    resolved: dict[str, tuple[str, float, float]] = {}
    for name in mimics:
        line, multiplier, offset = [name], 1.0, 0.0
        while line[-1] in mimics:
            mimic, last = mimics[line[-1]], line[-1]
            other, factor = mimic.get("joint", ""), float(mimic.get("multiplier", "1"))
            if other not in joints:
                raise unknown_name(f"joint that '{last}' mimics", other, [j for j in joints if j not in mimics])
            if other == last:
                raise InputError(f"joint '{last}' mimics itself; remove its <mimic>, or name the joint that it follows")
            if other in line:
                first, *rest = [f"'{joint}'" for joint in [*line[line.index(other) :], other]]
                circle = ", which mimics ".join(rest)
                raise InputError(f"joint {first} mimics {circle}; let one of them move by itself, without <mimic>")
            if joints[other].get("type") == "fixed":
                raise InputError(f"joint '{last}' mimics '{other}', which is fixed; let it mimic one that moves")
            if factor == 0:
                raise InputError(f"joint '{last}' mimics with the multiplier 0; make it a fixed joint")
            multiplier, offset = multiplier * factor, multiplier * float(mimic.get("offset", "0")) + offset
            line.append(other)
        resolved[name] = line[-1], multiplier, offset
    for name, (other, multiplier, offset) in resolved.items():
        mimics[name].attrib.update(joint=other, multiplier=repr(multiplier), offset=repr(offset))


def _dress(name: str, link: Element, folder: Path) -> None:
    """Leave a link its visual geometry, else its collision geometry as such; complete its paths and its inertia."""
    for inertial in link.findall("inertial"):
        for tag, values in (("mass", {"value": 1}), ("inertia", INERTIA)):
            part = inertial.find(tag)
            part = ElementTree.SubElement(inertial, tag) if part is None else part
            for key in values:
                part.set(key, part.get(key, "0"))  # what is heavier than nothing is the simulation's to say
    solids = link.findall("collision")
    if link.find("visual") is None:
        for solid in solids:
            solid.tag = "visual"
    else:
        for solid in solids:
            link.remove(solid)
    for visual in link.findall("visual"):
        geometry = visual.find("geometry")
        if geometry is None or len(geometry) == 0:
            raise InputError(f"link '{name}' has a <visual> or <collision> with no shape in its <geometry>; remove it")
    for mesh in link.iter("mesh"):
        mesh.set("filename", str(mesh_file(mesh.get("filename", ""), folder, f"link '{name}'")))


def _strip(robot: Element) -> None:
    """Leave out what is neither link nor joint nor colour: an undefined material makes a reader refuse all."""
    for element in list(robot):
        if element.tag not in ("link", "joint", "material"):
            robot.remove(element)
    defined = {m.get("name") for m in robot.iter("material") if m.find("color") is not None}
    for parent in list(robot.iter()):
        for material in parent.findall("material"):
            for texture in material.findall("texture"):
                material.remove(texture)
            if material.get("name") not in defined:
                parent.remove(material)
