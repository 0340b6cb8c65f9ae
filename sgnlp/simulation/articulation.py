"""The hand as MuJoCo moves it, from its URDF."""

import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.hand import Hand
from sgnlp.handfile import Finger
from sgnlp.simulation.scene import HIDDEN, SHOWN, impedance, touchable
from sgnlp.simulation.settings import SimulationSettings

HULL_VERTICES = 64
"""Vertices of a link's convex hull at most."""
TIP_SCALE = 0.99
"""The shape of a tip is drawn back by this factor about its link's origin, so that the pad touches, not both."""
LEAST_MASS, LEAST_INERTIA = 1e-3, 1e-7
"""Of a link that the URDF gives none [kg], [kg m²]."""
JOINT_IMPEDANCE = 0.999
"""As `contact_impedance`, of the dry friction of joints, and of the coupling of mimic joints to those they follow: a
joint that should stand turns by less than 1 mrad/s."""


def articulation(hand: Hand, settings: SimulationSettings) -> Any:
    """A `mujoco.MjSpec` of the hand, its root link fixed, gravity compensated.

    The links collide as the convex hulls of the URDF's meshes: its boxes reach past the pads. A link without a mesh
    collides as the URDF says. Each tip has the pad of the hand's description, a sphere; each joint the effort, and
    what mimics another joint that of the other.
    """
    import mujoco

    spec = mujoco.MjSpec.from_string(_urdf(hand.urdf))
    spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS, LEAST_INERTIA
    for mesh in spec.meshes:
        mesh.maxhullvert = HULL_VERTICES
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    for link in spec.bodies[1:]:
        link.gravcomp = 1.0
        _solidify(spec, link, settings)
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


def _urdf(file: Path) -> str:
    """The URDF's text, with the paths of its meshes made absolute and MuJoCo's options for reading it."""

    def absolute(match: re.Match[str]) -> str:
        package, _, inner = match[1].partition("/")
        return str(next((folder for folder in file.parents if folder.name == package), file.parent) / inner)

    options = 'strippath="false" fusestatic="false" discardvisual="false" balanceinertia="true"'
    compiler = f'<mujoco><compiler meshdir="{file.parent}" {options}/></mujoco>'
    text = re.sub(r"package://([^\"']+)", absolute, file.read_text(encoding="utf-8"))
    return re.sub(r"(<robot\b[^>]*>)", lambda match: match[1] + compiler, text, count=1)


def _solidify(spec: Any, link: Any, settings: SimulationSettings) -> None:
    """Collide and weigh a link by its meshes, or by the URDF's collision geometry where there are none.

    Its mass is spread over them: the URDF's inertias are placeholders, some of no possible body.
    """
    meshes = [geom for geom in link.geoms if not geom.contype]  # MuJoCo reads visual geometry as not colliding
    solid = meshes or list(link.geoms)
    for geom in link.geoms:
        if geom not in solid:
            spec.delete(geom)
    link.explicitinertial = not solid
    for geom in solid:
        geom.mass, geom.group = link.mass / len(solid), SHOWN
        touchable(geom, settings)


def _cushion(spec: Any, finger: Finger, settings: SimulationSettings) -> None:
    """Put the pad on a finger's tip, whose own shape draws back from it."""
    import mujoco

    tip, kind = spec.body(finger.frame), mujoco.mjtGeom.mjGEOM_SPHERE
    for geom in tip.geoms:
        if geom.meshname:
            spec.mesh(geom.meshname).scale = np.full(3, TIP_SCALE)
        else:
            geom.size = TIP_SCALE * np.array(geom.size)
    place = {"pos": finger.offset, "size": [finger.radius, 0, 0]}
    touchable(tip.add_geom(name=pad(finger.name), type=kind, mass=0, group=HIDDEN, **place), settings)
    tip.add_site(name=centre(finger.name), pos=finger.offset, group=HIDDEN)


def _couple(spec: Any, hand: Hand, settings: SimulationSettings) -> None:
    """Tie each mimic joint to the one that it follows; what MuJoCo makes of the URDF's mimic tags is softer."""
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
    """No contact between links of one finger, nor of the root link with the first two of a finger.

    Joint limits keep these apart; their hulls overlap at the joints.
    """
    root = spec.bodies[1].name
    for first, second in combinations(spec.bodies[1:], 2):
        line = _line(second)
        if first.name in line and (first.name != root or len(line) <= 3):
            spec.add_exclude(bodyname1=first.name, bodyname2=second.name)


def _line(link: Any) -> list[str]:
    """Names of a link and of its ancestors down to the root link."""
    return [link.name, *(_line(link.parent) if link.parent.name != "world" else [])]
