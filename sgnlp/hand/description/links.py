"""The links of a description: their visual geometry, inertia, and mesh files."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pinocchio as pin

from sgnlp.base.errors import InputError
from sgnlp.hand.description.numbers import INERTIA
from sgnlp.hand.description.paths import mesh_file
from sgnlp.hand.description.poses import words

Element = ElementTree.Element


def dress(name: str, link: Element, folder: Path) -> None:
    """Keep a link's visual geometry, else use its collision geometry; complete its paths and its inertia."""
    for inertial in link.findall("inertial"):
        for tag, values in (("mass", {"value": 1}), ("inertia", INERTIA)):
            part = inertial.find(tag)
            part = ElementTree.SubElement(inertial, tag) if part is None else part
            for key in values:
                part.set(key, part.get(key, "0"))  # the simulation chooses a mass if there is none
    solids = link.findall("collision")
    if link.find("visual") is None:
        for solid in solids:
            solid.tag = "visual"
    else:
        for solid in solids:
            link.remove(solid)
    for visual in link.findall("visual"):
        _split(link, visual)
        geometry = visual.find("geometry")
        if geometry is None or len(geometry) == 0:
            raise InputError(f"link '{name}' has a <visual> or <collision> with no shape in its <geometry>; remove it")
    for mesh in link.iter("mesh"):
        mesh.set("filename", str(mesh_file(mesh.get("filename", ""), folder, f"link '{name}'")))


def _split(link: Element, visual: Element) -> None:
    """Replace a capsule, which Pinocchio does not read, by a cylinder and two spheres."""
    geometry = visual.find("geometry")
    capsule = None if geometry is None else geometry.find("capsule")
    if geometry is None or capsule is None:
        return
    radius, length = capsule.get("radius", ""), float(capsule.get("length", ""))
    geometry.remove(capsule)
    ElementTree.SubElement(geometry, "cylinder", radius=radius, length=repr(length))
    origin = {} if (found := visual.find("origin")) is None else found.attrib
    centre, angles = (np.array(origin.get(key, "0 0 0").split(), float) for key in ("xyz", "rpy"))
    for end in (-0.5 * length, 0.5 * length):
        cap = ElementTree.SubElement(link, "visual")
        ElementTree.SubElement(cap, "origin", xyz=words(*(centre + end * pin.rpy.rpyToMatrix(angles)[:, 2])))
        ElementTree.SubElement(ElementTree.SubElement(cap, "geometry"), "sphere", radius=radius)
        cap.extend(visual.findall("material"))


def strip(robot: Element) -> None:
    """Remove all but links, joints and materials: a reader would refuse a file with an undefined material."""
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
