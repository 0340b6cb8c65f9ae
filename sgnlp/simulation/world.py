"""The whole model: the hand on an arm or on a floating wrist, the table, the object and the obstacles."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.arrays import Array
from sgnlp.control.command import Command
from sgnlp.hand.arm import Arm
from sgnlp.hand.hand import Hand
from sgnlp.perception.shape import Shape
from sgnlp.simulation.arm_articulation import ARM, add_servos, carry, separate
from sgnlp.simulation.articulation import articulation, centre, pad
from sgnlp.simulation.body import Body
from sgnlp.simulation.obstacles import OBSTACLE, add_obstacles
from sgnlp.simulation.route import Route
from sgnlp.simulation.scene import OBJECT, TABLE, add_object, compiled, empty_scene
from sgnlp.simulation.settings import SimulationSettings

HAND = "hand/"
"""Prefix of all names from the hand's URDF."""
WRIST, LIFT = "wrist", "lift"
ALONG = ("along x", "along y")
"""Joints of a floating wrist along a route, besides its rise."""
ARM_INERTIA = 1e6
"""Inertia of a floating wrist [kg], so that it does not give way: 10 N move it by 5 µm in 1 s."""


@dataclass(frozen=True, eq=False)
class World:
    """A compiled model, with the indices of hand and object; n own joints of the hand, j moving joints, m fingers."""

    model: Any  # mujoco.MjModel
    hand_joints: NDArray[np.intp]  # (j,) places in qpos, in the order of the hand's moving_joints
    hand_speeds: NDArray[np.intp]  # (j,) places in qvel
    effort: Array  # (n,) [N m]
    root: int  # body of the hand's root link
    arm: Arm | None  # what carries the hand
    carrier: NDArray[np.intp]  # (d,) places in qpos of an arm's joints, or of what a wrist that floats has
    carrier_speeds: NDArray[np.intp]  # (d,) places in qvel
    tips: NDArray[np.intp]  # (m,) sites
    pad_links: NDArray[np.intp]  # (m,) bodies
    object_place: slice  # of the object's pose in qpos
    object_body: int
    object_geoms: frozenset[int]
    hand_geoms: frozenset[int]
    arm_geoms: frozenset[int]
    obstacles: dict[int, str]  # name of the obstacle by its geom
    table: int  # geom

    def link(self, geom: int) -> str:
        """Name of the link of hand or arm that a geom belongs to."""
        return str(self.model.body(self.model.geom_bodyid[geom]).name.removeprefix(HAND).removeprefix(ARM))

    def wrist(self, data: Any) -> Array:
        """Pose (7,) of the hand's root link, x y z [m] qx qy qz qw."""
        w, *xyz = data.xquat[self.root]
        return np.array([*data.xpos[self.root], *xyz, w])

    def own_joints(self, data: Any) -> tuple[Array, Array]:
        """Angles and speeds (n,) of the hand's own joints [rad], [rad/s]."""
        n = len(self.effort)
        return data.qpos[self.hand_joints[:n]], data.qvel[self.hand_speeds[:n]]


def object_alone(body: Body, settings: SimulationSettings, obstacles: Sequence[Shape] = ()) -> Any:
    """The model of the object over the table, without a hand."""
    spec = empty_scene(body, settings)
    add_object(spec, body, settings)
    add_obstacles(spec, obstacles, body, settings)
    return compiled(spec)


def world(
    body: Body,
    hand: Hand,
    command: Command,
    settings: SimulationSettings,
    obstacles: Sequence[Shape] = (),
    route: Route | None = None,
) -> World:
    """The compiled model with everything in its place. The hand's arm is in it only if there is a route."""
    spec = assembled(body, hand, command, settings, obstacles, route)
    return _located(compiled(spec), hand, obstacles, route)


def assembled(
    body: Body,
    hand: Hand,
    command: Command,
    settings: SimulationSettings,
    obstacles: Sequence[Shape] = (),
    route: Route | None = None,
) -> Any:
    """A `mujoco.MjSpec` with the hand on its arm or at the command's wrist pose, and a motor in each of its own joints.

    The control of a motor is a torque [N m]. The motors are in the order of the hand's `joint_names`. After them come
    the arm's servos, whose control is a joint position [rad or m].
    """
    spec, arm = empty_scene(body, settings), hand.arm if route else None
    frame = carry(spec, arm, settings) if arm else _floating(spec, command, route is not None)
    spec.attach(articulation(hand, settings), frame=frame, prefix=HAND)
    for name in hand.joint_names:
        _add_motor(spec, HAND + name)
    if arm:
        separate(spec, arm, [link.name for link in spec.bodies if link.name.startswith(HAND)])
        add_servos(spec, arm)
    add_object(spec, body, settings)
    add_obstacles(spec, obstacles, body, settings)
    return spec


def _floating(spec: Any, command: Command, moves: bool) -> Any:
    """A frame at the command's wrist pose that can rise and, if it `moves`, go sideways too."""
    import mujoco

    wrist = spec.worldbody.add_body(name=WRIST)
    for name, axis in zip((LIFT, *(ALONG if moves else ())), ([0, 0, 1], [1, 0, 0], [0, 1, 0]), strict=False):
        wrist.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis, armature=ARM_INERTIA)
    x, y, z, qx, qy, qz, qw = command.wrist
    return wrist.add_frame(pos=[x, y, z], quat=[qw, qx, qy, qz])


def _add_motor(spec: Any, joint: str) -> None:
    import mujoco

    motor = spec.add_actuator(name=joint)
    motor.trntype, motor.target, motor.gear[0] = mujoco.mjtTrn.mjTRN_JOINT, joint, 1.0
    motor.gaintype, motor.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_NONE
    motor.gainprm[0] = 1.0


def _located(model: Any, hand: Hand, obstacles: Sequence[Shape], route: Route | None) -> World:
    """The model with the indices of all that is read and written."""
    pads = [model.geom(HAND + pad(finger.name)).id for finger in hand.fingers]
    thing, table, place = model.body(OBJECT).id, model.geom(TABLE).id, int(model.joint(OBJECT).qposadr[0])
    joints, carriers = ([model.joint(name) for name in names] for names in _joints(hand, route))
    solid = [g for g in range(model.ngeom) if model.geom_contype[g]]
    of = {g: str(model.body(model.geom_bodyid[g]).name) for g in solid}
    return World(
        model=model,
        hand_joints=np.array([int(joint.qposadr[0]) for joint in joints]),
        hand_speeds=np.array([int(joint.dofadr[0]) for joint in joints]),
        effort=hand.effort,
        root=model.body(HAND + hand.root).id,
        arm=hand.arm if route else None,
        carrier=np.array([int(joint.qposadr[0]) for joint in carriers]),
        carrier_speeds=np.array([int(joint.dofadr[0]) for joint in carriers]),
        tips=np.array([model.site(HAND + centre(finger.name)).id for finger in hand.fingers]),
        pad_links=model.geom_bodyid[pads],
        object_place=slice(place, place + 7),
        object_body=thing,
        object_geoms=frozenset(g for g in solid if model.geom_bodyid[g] == thing),
        hand_geoms=frozenset(g for g in solid if of[g].startswith(HAND)),
        arm_geoms=frozenset(g for g in solid if of[g].startswith(ARM)),
        obstacles={model.geom(f"{OBSTACLE}{i}").id: shape.name for i, shape in enumerate(obstacles)},
        table=table,
    )


def _joints(hand: Hand, route: Route | None) -> tuple[list[str], list[str]]:
    """The names of the hand's joints, and those of its arm or floating wrist in the order of a route's coordinates."""
    own = [HAND + name for name in hand.moving_joints]
    if route is None:
        return own, [LIFT]
    return own, [*ALONG, LIFT] if hand.arm is None else [ARM + name for name in hand.arm.joint_names]
