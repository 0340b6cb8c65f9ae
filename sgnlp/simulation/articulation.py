"""The hand as a MuJoCo model, from its URDF."""

import xml.etree.ElementTree as ElementTree
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.hand.arm import Arm
from sgnlp.hand.hand import Hand
from sgnlp.hand.hand_file import Finger
from sgnlp.hand.meshes import link_meshes, mesh_files
from sgnlp.simulation.scene import HIDDEN, SHOWN, impedance, touchable
from sgnlp.simulation.settings import SimulationSettings

OPTIONS = 'strippath="false" fusestatic="false" discardvisual="false" balanceinertia="true"'
"""Options of MuJoCo's URDF compiler."""
WORLD = "world"
"""MuJoCo's name of the fixed world: a link of this name is renamed."""
STL_HEAD, STL_FACE, MOST_FACES = 84, 50, 200_000
"""Bytes of a binary STL before its faces and of each face, and the most faces that MuJoCo reads."""
HULL_VERTICES = 64
"""Most vertices of a link's convex hull."""
TIP_SCALE = 0.99
"""A tip's mesh is shrunk by this factor about its link's origin, so that only the pad touches."""
LEAST_MASS, LEAST_INERTIA = 1e-3, 1e-7
"""Mass [kg] and inertia [kg m²] of a link without them in the URDF."""
JOINT_IMPEDANCE = 0.999
"""Impedance, as `contact_impedance`, of the joints' dry friction and of the coupling of mimic joints: a joint at rest
creeps by less than 1 mrad/s."""


def articulation(hand: Hand, settings: SimulationSettings) -> Any:
    """A `mujoco.MjSpec` of the hand, its root link fixed, gravity compensated.

    The links collide as the convex hulls of their visual geometry. Collision geometry is used only for links without
    visual geometry, since collision boxes reach past the pads. Each tip has the pad of the hand's file, a sphere. Each
    joint has the effort of the hand's file, a mimic joint that of the joint that it follows.
    """
    spec = read(hand)
    spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS, LEAST_INERTIA
    for link in spec.bodies[1:]:
        link.gravcomp = 1.0
        _solidify(link, settings)
    for finger in hand.fingers:
        _cushion(spec, finger, settings)
    efforts = [*hand.effort, *(hand.effort[mimic.joint] for mimic in hand.mimics)]
    torques = dict(zip(hand.moving_joints, map(float, efforts), strict=True))
    for joint in spec.joints:
        _gear(joint, torques[joint.name], settings)
    _couple(spec, hand, settings)
    _exclude(spec)
    return spec


def pad(finger: str) -> str:
    """Name of a finger's pad, a geom."""
    return f"pad/{finger}"


def centre(finger: str) -> str:
    """Name of the centre of a finger's pad, a site."""
    return f"tip/{finger}"


def read(hand: Hand | Arm) -> Any:
    """A `mujoco.MjSpec` of the URDF, with an asset for each file and scale, shrunk for those of the tips."""
    import mujoco

    robot = ElementTree.fromstring(hand.description)
    robot.insert(0, ElementTree.fromstring(f"<mujoco><compiler {OPTIONS}/></mujoco>"))
    for part in robot.iter():
        for attribute in ("name", "link"):
            if part.tag in ("link", "parent", "child") and part.get(attribute) == WORLD:
                part.set(attribute, f"{WORLD}_")
    tips = {finger.frame for finger in hand.fingers} if isinstance(hand, Hand) else set()
    assets: dict[tuple[str, tuple[float, ...], bool], str] = {}
    for link in robot.findall("link"):
        for mesh in link.iter("mesh"):
            scale = tuple(float(word) for word in mesh.get("scale", "1 1 1").split())
            key = mesh.get("filename", ""), scale, link.get("name") in tips
            mesh.set("filename", f"{assets.setdefault(key, f'mesh{len(assets)}')}.stl")
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))
    meshes = dict(zip(mesh_files(hand), link_meshes(hand)[0], strict=True)) if assets else {}
    for (file, scale, tip), name in assets.items():
        asset = spec.mesh(name)
        if _binary_stl(Path(file)):
            asset.file = file
        else:
            asset.file, asset.scale = "", np.ones(3)
            asset.uservert, asset.userface = meshes[file, scale].vertices.ravel(), meshes[file, scale].faces.ravel()
        asset.maxhullvert = HULL_VERTICES
        asset.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        if tip:
            asset.scale = TIP_SCALE * asset.scale
    return spec


def _binary_stl(file: Path) -> bool:
    """Whether MuJoCo reads this mesh itself: it has readers for fewer formats than our views of the hand."""
    with file.open("rb") as stream:
        head = stream.read(STL_HEAD)
    count = int.from_bytes(head[-4:], "little")
    return file.stat().st_size == STL_HEAD + STL_FACE * count and 0 < count <= MOST_FACES


def _solidify(link: Any, settings: SimulationSettings) -> None:
    """Give a link collision and inertia from its visual geometry.

    Its mass is spread over that: the URDF's inertias are placeholders, and some are physically impossible.
    """
    solid = list(link.geoms)
    link.explicitinertial = not solid
    for geom in solid:
        geom.mass, geom.group = link.mass / len(solid), SHOWN
        touchable(geom, settings)


def _cushion(spec: Any, finger: Finger, settings: SimulationSettings) -> None:
    """Put the pad on a finger's tip, whose own mesh is shrunk."""
    import mujoco

    tip, kind = spec.body(finger.frame), mujoco.mjtGeom.mjGEOM_SPHERE
    for geom in tip.geoms:
        if not geom.meshname:
            geom.size = TIP_SCALE * np.array(geom.size)
    place = {"pos": finger.offset, "size": [finger.radius, 0, 0]}
    touchable(tip.add_geom(name=pad(finger.name), type=kind, mass=0, group=HIDDEN, **place), settings)
    tip.add_site(name=centre(finger.name), pos=finger.offset, group=HIDDEN)


def _couple(spec: Any, hand: Hand, settings: SimulationSettings) -> None:
    """Tie each mimic joint to the one that it follows; MuJoCo's own coupling for mimic tags is softer."""
    import mujoco

    for made in list(spec.equalities):
        spec.delete(made)
    for mimic in hand.mimics:
        tie = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT)
        tie.name1, tie.name2 = mimic.name, hand.joint_names[mimic.joint]
        tie.data[:2] = mimic.offset, mimic.multiplier
        tie.solref, tie.solimp = [settings.contact_time, 1.0], impedance(JOINT_IMPEDANCE)


def _gear(joint: Any, effort: float, settings: SimulationSettings) -> None:
    """Damping, dry friction, rotor and torque limit of a joint, in place of the URDF's."""
    joint.damping[0] = settings.joint_damping
    joint.armature = settings.joint_armature
    joint.frictionloss = settings.joint_friction
    joint.solref_friction = [settings.contact_time, 1.0]
    joint.solimp_friction = impedance(JOINT_IMPEDANCE)
    joint.actfrcrange = [-effort, effort]


def _exclude(spec: Any) -> None:
    """Exclude contacts between links of one finger, and of the root link with the first two of a finger.

    Joint limits keep these apart, but their hulls overlap at the joints.
    """
    root = spec.bodies[1].name
    for first, second in combinations(spec.bodies[1:], 2):
        line = _line(second)
        if first.name in line and (first.name != root or len(line) <= 3):
            spec.add_exclude(bodyname1=first.name, bodyname2=second.name)


def _line(link: Any) -> list[str]:
    """Names of a link and of its ancestors down to the root link."""
    return [link.name, *(_line(link.parent) if link.parent.name != WORLD else [])]
