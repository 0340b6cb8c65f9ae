"""Joints that follow others: the <mimic> elements of a description, and the couplings of a hand's file."""

import xml.etree.ElementTree as ElementTree

from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import unknown_name
from sgnlp.hand.model import read_model

Element = ElementTree.Element
Law = tuple[str, float, float]
"""The joint that another follows, multiplier and offset."""


def resolve_mimics(robot: Element) -> None:
    """Let each mimic joint follow one that has its own coordinate and comes before it in Pinocchio's order.

    q₁ = a q₂ + b of q₂ = c q₃ + d is a c q₃ + a d + b. If a joint e comes before the joint l that it follows at
    k l + b, then l follows e at (e − b)/k, and so do all others that follow l.

    Raises:
        InputError: joints follow each other in a circle, or follow a fixed or missing joint.
    """
    joints = {joint.get("name", ""): joint for joint in robot.findall("joint")}
    laws = _resolved(joints)
    order = read_model(ElementTree.tostring(robot, encoding="unicode"), mimic=False).names if laws else ()
    place = {name: i for i, name in enumerate(order)}
    for leader in {law[0] for law in laws.values()}:
        group = [leader, *(name for name, law in laws.items() if law[0] == leader)]
        first = min(group, key=place.__getitem__)
        if first != leader:
            _lead(laws, group, first)
    for name, joint in joints.items():
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
        if name in laws:
            other, multiplier, offset = laws[name]
            ElementTree.SubElement(joint, "mimic", joint=other, multiplier=repr(multiplier), offset=repr(offset))


def _lead(laws: dict[str, Law], group: list[str], first: str) -> None:
    """Let all joints of a group follow `first` instead of the group's present leader."""
    leader, (_, k, b) = group[0], laws.pop(first)
    laws[leader] = leader, 1.0, 0.0
    for name in group:
        if name != first:
            _, multiplier, offset = laws[name]
            laws[name] = first, multiplier / k, offset - multiplier * b / k


def _resolved(joints: dict[str, Element]) -> dict[str, Law]:
    """For each mimic joint, its law relative to the joint at the end of the chain, which has its own coordinate."""
    mimics = {name: found for name, joint in joints.items() if (found := joint.find("mimic")) is not None}
    resolved: dict[str, Law] = {}
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
    return resolved
