"""Joints that follow others: <mimic> of a URDF and the couplings that a hand's file asks for."""

import xml.etree.ElementTree as ElementTree

from sgnlp.base.errors import InputError
from sgnlp.hand.yaml_nodes import unknown_name

Element = ElementTree.Element


def resolve_mimics(joints: dict[str, Element]) -> None:
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
