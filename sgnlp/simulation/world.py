"""The whole model: the hand on a wrist that can rise, the table and the object."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.control.command import Command
from sgnlp.hand.hand import Hand
from sgnlp.simulation.articulation import articulation, centre, pad
from sgnlp.simulation.body import Body
from sgnlp.simulation.scene import OBJECT, TABLE, add_object, compiled, empty_scene
from sgnlp.simulation.settings import SimulationSettings

Array = NDArray[np.float64]

HAND = "hand/"
"""Prefix of all that comes from the URDF."""
WRIST, LIFT = "wrist", "lift"
ARM_INERTIA = 1e6
"""Inertia behind the wrist [kg]: a position-controlled arm does not give way; 10 N move this by 5 µm in 1 s."""


@dataclass(frozen=True, eq=False)
class World:
    """A compiled model, and where in it hand and object are; n joints of their own, j that move, m fingers."""

    model: Any  # mujoco.MjModel
    hand_joints: NDArray[np.intp]  # (j,) places in qpos, in the order of the hand's moving_joints
    hand_speeds: NDArray[np.intp]  # (j,) places in qvel
    effort: Array  # (n,) [N m]
    root: int  # body of the hand's root link
    lift: int  # place of the wrist's rise in qvel
    tips: NDArray[np.intp]  # (m,) sites
    pad_links: NDArray[np.intp]  # (m,) bodies
    object_place: slice  # of the object's pose in qpos
    object_body: int
    object_geoms: frozenset[int]
    hand_geoms: frozenset[int]
    table: int  # geom

    def link(self, geom: int) -> str:
        """Name of the hand's link that a geom belongs to."""
        return str(self.model.body(self.model.geom_bodyid[geom]).name.removeprefix(HAND))

    def wrist(self, data: Any) -> Array:
        """Pose (7,) of the hand's root link, x y z [m] qx qy qz qw."""
        w, *xyz = data.xquat[self.root]
        return np.array([*data.xpos[self.root], *xyz, w])

    def own_joints(self, data: Any) -> tuple[Array, Array]:
        """Angles and speeds (n,) of the hand's own joints [rad], [rad/s]."""
        n = len(self.effort)
        return data.qpos[self.hand_joints[:n]], data.qvel[self.hand_speeds[:n]]


def object_alone(body: Body, settings: SimulationSettings) -> Any:
    """The model of the object over the table, without a hand."""
    spec = empty_scene(body, settings)
    add_object(spec, body, settings)
    return compiled(spec)


def world(body: Body, hand: Hand, command: Command, settings: SimulationSettings) -> World:
    """The compiled model with all in its place."""
    return _located(compiled(assembled(body, hand, command, settings)), hand)


def assembled(body: Body, hand: Hand, command: Command, settings: SimulationSettings) -> Any:
    """A `mujoco.MjSpec` with the hand's root link at the command's wrist pose, and a motor in each joint of its own.

    The control of a motor is a torque [N m]. They are in the order of the hand's `joint_names`.
    """
    import mujoco

    spec = empty_scene(body, settings)
    wrist = spec.worldbody.add_body(name=WRIST)
    wrist.add_joint(name=LIFT, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], armature=ARM_INERTIA)
    x, y, z, qx, qy, qz, qw = command.wrist
    frame = wrist.add_frame(pos=[x, y, z], quat=[qw, qx, qy, qz])
    spec.attach(articulation(hand, settings), frame=frame, prefix=HAND)
    for name in hand.joint_names:
        _add_motor(spec, HAND + name)
    add_object(spec, body, settings)
    return spec


def _add_motor(spec: Any, joint: str) -> None:
    import mujoco

    motor = spec.add_actuator(name=joint)
    motor.trntype, motor.target, motor.gear[0] = mujoco.mjtTrn.mjTRN_JOINT, joint, 1.0
    motor.gaintype, motor.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_NONE
    motor.gainprm[0] = 1.0


def _located(model: Any, hand: Hand) -> World:
    """The places of all that is read and written."""
    pads = [model.geom(HAND + pad(finger.name)).id for finger in hand.fingers]
    thing, table, place = model.body(OBJECT).id, model.geom(TABLE).id, int(model.joint(OBJECT).qposadr[0])
    joints = [model.joint(HAND + name) for name in hand.moving_joints]
    solid = [g for g in range(model.ngeom) if model.geom_contype[g]]
    return World(
        model=model,
        hand_joints=np.array([int(joint.qposadr[0]) for joint in joints]),
        hand_speeds=np.array([int(joint.dofadr[0]) for joint in joints]),
        effort=hand.effort,
        root=model.body(HAND + hand.root).id,
        lift=int(model.joint(LIFT).dofadr[0]),
        tips=np.array([model.site(HAND + centre(finger.name)).id for finger in hand.fingers]),
        pad_links=model.geom_bodyid[pads],
        object_place=slice(place, place + 7),
        object_body=thing,
        object_geoms=frozenset(g for g in solid if model.geom_bodyid[g] == thing),
        hand_geoms=frozenset(g for g in solid if model.geom_bodyid[g] != thing and g != table),
        table=table,
    )
