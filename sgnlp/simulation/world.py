"""The model that MuJoCo steps: hand, table and object, built from the hand's URDF and the true mesh."""

import re
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.errors import InputError
from sgnlp.hand import Hand
from sgnlp.simulation.body import Body
from sgnlp.simulation.command import Command
from sgnlp.simulation.pieces import pieces
from sgnlp.simulation.settings import SimulationSettings

Array = NDArray[np.float64]

HAND = "hand/"
"""Prefix of everything that comes from the URDF."""
TABLE, OBJECT, WRIST, LIFT = "table", "object", "wrist", "lift"
ARM_INERTIA = 1e6
"""Inertia behind the wrist [kg]: a position-controlled arm does not give way; 10 N move this by 5 µm in 1 s."""
PATCH_SHARE = 3 * np.pi / 16
"""Largest torque of a Hertzian patch against twist over μ · force · radius of the patch (Johnson 1985, 7.4)."""
HULL_VERTICES = 64
"""Vertices of a link's convex hull at most."""
TIP_SCALE = 0.99
SOLVER_ITERATIONS, SOLVER_TOLERANCE = 200, 1e-16
"""Newton's method to rounding: at 1e-10 the residual shakes pads across the surface by 1 cm in 3 s, and a grasp takes
five times longer, for nothing ever rests."""
JOINT_FRICTION_IMPEDANCE = 0.999
"""As `contact_impedance`, of the dry friction of joints: a joint that should stand turns by less than 1 mrad/s."""


@dataclass(frozen=True, eq=False)
class World:
    """A compiled model and where in it hand and object are."""

    model: Any  # mujoco.MjModel
    hand_joints: NDArray[np.intp]  # (n,) place in qpos of each of the hand's joints
    tips: NDArray[np.intp]  # (m,) sites
    pads: NDArray[np.intp]  # (m,) geoms
    lift: int  # the wrist's slide in qvel
    pad_links: NDArray[np.intp]  # (m,) bodies
    object_place: slice  # of the object's pose in qpos
    object_body: int
    object_geoms: frozenset[int]
    hand_geoms: frozenset[int]
    table: int  # geom

    def link(self, geom: int) -> str:
        """Name of the hand's link that a geom belongs to."""
        return str(self.model.body(self.model.geom_bodyid[geom]).name.removeprefix(HAND))


def object_alone(body: Body, settings: SimulationSettings) -> Any:
    """The model of the object over the table, without a hand."""
    spec = _scene(body, settings)
    _add_object(spec, body, settings)
    return spec.compile()


def world(body: Body, hand: Hand, command: Command, settings: SimulationSettings) -> World:
    """The model with the hand's wrist at the command's pose; `visuals` adds the meshes that a picture shows."""
    import mujoco

    spec = _scene(body, settings)
    wrist = spec.worldbody.add_body(name=WRIST)
    wrist.add_joint(name=LIFT, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], armature=ARM_INERTIA)
    wrist.add_site(name=WRIST)
    x, y, z, qx, qy, qz, qw = command.wrist
    frame = wrist.add_frame(pos=[x, y, z], quat=[qw, qx, qy, qz])
    spec.attach(_hand(hand, settings), frame=frame, prefix=HAND)
    _add_springs(spec, hand, command)
    _add_object(spec, body, settings)
    return _located(_compiled(spec), hand)


def _scene(body: Body, settings: SimulationSettings) -> Any:
    """An empty scene with the table and the options of solver and contact."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    option = spec.option
    option.timestep = settings.timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = settings.friction_impedance
    option.iterations, option.tolerance = SOLVER_ITERATIONS, SOLVER_TOLERANCE
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # what diverges is told, not begun anew
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1280, 960
    table = spec.worldbody.add_geom(name=TABLE, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.5, 0.5, 0.01])
    table.pos = [0, 0, body.table_height]
    _touchable(table, settings)
    return spec


def _touchable(geom: Any, settings: SimulationSettings) -> None:
    """Contact of all with all alike: condim 4 is sliding in two directions and twist."""
    geom.contype = geom.conaffinity = 1
    geom.condim = 4
    geom.friction = [settings.friction, settings.friction * PATCH_SHARE * settings.pad_patch, 0.0]
    geom.solref = [settings.contact_time, 1.0]
    geom.solimp = _impedance(settings.contact_impedance)


def _impedance(value: float) -> list[float]:
    """MuJoCo's five numbers for an impedance that does not depend on the depth."""
    return [value, value, 0.001, 0.5, 2.0]


def _add_object(spec: Any, body: Body, settings: SimulationSettings) -> None:
    """The object free to move: the true mesh gives mass and inertia, convex pieces collide."""
    import mujoco

    thing = spec.worldbody.add_body(name=OBJECT)
    thing.add_freejoint(name=OBJECT)
    mesh = spec.add_mesh(name=OBJECT, uservert=body.vertices.ravel(), userface=body.faces.ravel())
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    kind = mujoco.mjtGeom.mjGEOM_MESH
    thing.add_geom(name=OBJECT, type=kind, meshname=OBJECT, mass=settings.mass, contype=0, conaffinity=0, group=1)
    for i, piece in enumerate(pieces(body, settings.piece_error)):
        name = f"{OBJECT}/{i}"
        spec.add_mesh(name=name, uservert=piece.ravel())
        _touchable(thing.add_geom(name=name, type=kind, meshname=name, mass=0, group=3), settings)


def _hand(hand: Hand, settings: SimulationSettings) -> Any:
    """The hand from its URDF: geometry for collision as there, pads and efforts from the hand's description."""
    import mujoco

    spec = mujoco.MjSpec.from_string(_urdf(hand.urdf))
    for mesh in spec.meshes:
        mesh.maxhullvert = HULL_VERTICES
    for link in spec.bodies[1:]:
        link.gravcomp = 1.0
        solid = [g for g in link.geoms if not g.contype] or list(link.geoms)
        for geom in set(link.geoms) - set(solid):
            spec.delete(geom)
        _weigh(link, solid)
        for geom in solid:
            _touchable(geom, settings)
            geom.group = 1
    for finger in hand.fingers:
        tip = spec.body(finger.frame)
        _shrink(spec, tip)
        place = {"pos": finger.offset, "size": [finger.radius, 0, 0]}
        pad = tip.add_geom(name=f"pad/{finger.name}", type=mujoco.mjtGeom.mjGEOM_SPHERE, mass=0, group=3, **place)
        _touchable(pad, settings)
        tip.add_site(name=f"tip/{finger.name}", pos=finger.offset)
    effort = dict(zip(hand.joint_names, hand.effort, strict=True))
    for joint in spec.joints:
        joint.damping[0], joint.frictionloss = settings.joint_damping, settings.joint_friction
        joint.armature = settings.joint_armature
        joint.solimp_friction = _impedance(JOINT_FRICTION_IMPEDANCE)
        joint.solref_friction = [settings.contact_time, 1.0]
        joint.actfrcrange = [-effort[joint.name], effort[joint.name]]
    _exclude(spec)
    return spec


def _urdf(file: Path) -> str:
    """The URDF's text, with the paths of its meshes made absolute and MuJoCo's options for reading it."""

    def absolute(match: re.Match[str]) -> str:
        package, _, inner = match[1].partition("/")
        return str(next((p for p in file.parents if p.name == package), file.parent) / inner)

    options = 'strippath="false" fusestatic="false" discardvisual="false" balanceinertia="true"'
    compiler = f'<mujoco><compiler meshdir="{file.parent}" {options}/></mujoco>'
    text = re.sub(r"package://([^\"']+)", absolute, file.read_text())
    return re.sub(r"(<robot\b[^>]*>)", rf"\1{compiler}", text, count=1)


def _shrink(spec: Any, tip: Any) -> None:
    """Draw the tip's own meshes back behind the pad, about the link's origin, so that the dome touches but once."""
    for geom in tip.geoms:
        if geom.meshname:
            mesh = spec.mesh(geom.meshname)
            mesh.scale = TIP_SCALE * np.ones(3)


def _weigh(link: Any, solid: list[Any]) -> None:
    """The link's mass spread over its geometry: the URDF's inertias are placeholders, some of no possible body."""
    link.explicitinertial = not solid
    for geom in link.geoms:
        geom.mass = 0.0
    for geom in solid:
        geom.mass = link.mass / len(solid)


def _exclude(spec: Any) -> None:
    """Leave out contact between links of one finger, and of the palm with the first two links of a finger."""
    root = spec.bodies[1]
    for first, second in combinations(spec.bodies[1:], 2):
        line = _line(second)
        near = first is root and len(line) <= 3
        if first.name in line and (first is not root or near):
            spec.add_exclude(bodyname1=first.name, bodyname2=second.name)


def _line(link: Any) -> list[str]:
    """Names of a link and of its ancestors up to the root link."""
    return [link.name, *(_line(link.parent) if link.parent.name != "world" else [])]


def _add_springs(spec: Any, hand: Hand, command: Command) -> None:
    """τ = Jᵀ(k (o - p) - 2√k ṗ) per finger: three springs from the wrist's site, which rises with it, to each tip.

    As affine actuators, MuJoCo integrates the damping implicitly and limits the torque of each joint.
    """
    import mujoco

    for finger, k in zip(hand.fingers, command.gains, strict=True):
        for axis in range(3):
            spring = spec.add_actuator(name=f"{finger.name}/{'xyz'[axis]}")
            spring.trntype = mujoco.mjtTrn.mjTRN_SITE
            spring.target, spring.refsite = f"{HAND}tip/{finger.name}", WRIST
            spring.gear = np.eye(6)[axis]
            spring.gaintype, spring.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
            spring.gainprm[0] = k
            spring.biasprm[:3] = [0.0, -k, -2 * np.sqrt(k)]


def _compiled(spec: Any) -> Any:
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo refuses the model: {' '.join(str(error).split())}") from None


def _located(model: Any, hand: Hand) -> World:
    """The places of everything that the protocol reads and writes."""
    joints = [model.joint(f"{HAND}{name}") for name in hand.joint_names]
    pads = np.array([model.geom(f"{HAND}pad/{finger.name}").id for finger in hand.fingers])
    thing, table, place = model.body(OBJECT).id, model.geom(TABLE).id, int(model.joint(OBJECT).qposadr[0])
    solid = [g for g in range(model.ngeom) if model.geom_contype[g]]
    return World(
        model=model,
        hand_joints=np.array([int(joint.qposadr[0]) for joint in joints]),
        tips=np.array([model.site(f"{HAND}tip/{finger.name}").id for finger in hand.fingers]),
        pads=pads,
        lift=int(model.joint(LIFT).dofadr[0]),
        pad_links=model.geom_bodyid[pads],
        object_place=slice(place, place + 7),
        object_body=thing,
        object_geoms=frozenset(g for g in solid if model.geom_bodyid[g] == thing),
        hand_geoms=frozenset(g for g in solid if model.geom_bodyid[g] != thing and g != table),
        table=table,
    )
