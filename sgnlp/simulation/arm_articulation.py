"""The arm as MuJoCo moves it, from its URDF, and the servos of its joints."""

from typing import Any

import numpy as np

from sgnlp.hand.arm import Arm
from sgnlp.simulation.articulation import LEAST_INERTIA, LEAST_MASS, read
from sgnlp.simulation.scene import SHOWN, touchable
from sgnlp.simulation.settings import SimulationSettings

ARM = "arm/"
"""Prefix of all that comes from the arm's URDF."""
ARM_BIT = 2
"""MuJoCo's type of contact of an arm's links: all others touch them, and they do not touch each other, since the hulls
of links that are near each other overlap."""
NEXT_TO_HAND = 2
"""So many joints before the flange the links are too near the hand to count as touching it: hulls overlap there."""


def arm_articulation(arm: Arm, settings: SimulationSettings) -> Any:
    """A `mujoco.MjSpec` of the arm, its root link fixed, each link with the mass and inertia of the URDF.

    The links collide as the convex hulls of what the URDF shows. The drives bear the weight of arm and hand, as those
    of a real arm do, and all that a joint does stays within its effort.
    """
    spec = read(arm)
    spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS, LEAST_INERTIA
    for link in spec.bodies[1:]:
        link.gravcomp = 1.0
        for geom in link.geoms:
            geom.mass, geom.group = 0.0, SHOWN
            touchable(geom, settings)
            geom.contype = ARM_BIT
    efforts = dict(zip(arm.joint_names, map(float, arm.effort), strict=True))
    for joint in spec.joints:
        joint.damping[0], joint.frictionloss, joint.armature = 0.0, 0.0, settings.arm_armature
        joint.actfrcrange, joint.actgravcomp = [-efforts[joint.name], efforts[joint.name]], True
    return spec


def carry(spec: Any, arm: Arm, settings: SimulationSettings) -> Any:
    """Put the arm at its base into a scene; the frame is where the root link of the hand goes."""
    x, y, z, qx, qy, qz, qw = arm.base
    base = spec.worldbody.add_frame(pos=[x, y, z], quat=[qw, qx, qy, qz])
    spec.attach(arm_articulation(arm, settings), frame=base, prefix=ARM)
    x, y, z, qx, qy, qz, qw = arm.mount
    return spec.body(ARM + arm.flange).add_frame(pos=[x, y, z], quat=[qw, qx, qy, qz])


def separate(spec: Any, arm: Arm, hand_links: list[str]) -> None:
    """No contact between the hand and the links of the arm that it is next to."""
    near, link, joints = [], spec.body(ARM + arm.flange), 0
    while joints < NEXT_TO_HAND and link.name.startswith(ARM):
        near.append(link.name)
        joints, link = joints + len(link.joints), link.parent
    for one in near:
        for other in hand_links:
            spec.add_exclude(bodyname1=one, bodyname2=other)


def add_servos(spec: Any, arm: Arm) -> None:
    """A position servo for each joint; `tune` gives it its gains."""
    import mujoco

    for name in arm.joint_names:
        servo = spec.add_actuator(name=ARM + name)
        servo.trntype, servo.target, servo.gear[0] = mujoco.mjtTrn.mjTRN_JOINT, ARM + name, 1.0
        servo.gaintype, servo.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE


def tune(model: Any, arm: Arm, qpos: np.ndarray, settings: SimulationSettings) -> None:
    """Give the servos stiffness and critical damping, for the inertia that each joint has alone at a configuration.

    With the effort τ, the give g of the settings and the inertia M_jj, τ_j/g and 2 √(τ_j M_jj/g).
    """
    import mujoco

    data, mass = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    for name, effort in zip(arm.joint_names, arm.effort, strict=True):
        servo, j = model.actuator(ARM + name).id, int(model.joint(ARM + name).dofadr[0])
        stiffness = float(effort) / settings.arm_give
        damping = 2 * np.sqrt(stiffness * mass[j, j])
        model.actuator_gainprm[servo, 0] = stiffness
        model.actuator_biasprm[servo, 1:3] = -stiffness, -damping
