"""The arm as a MuJoCo model, from its URDF, and the servos of its joints."""

from typing import Any

import numpy as np

from sgnlp.hand.arm import Arm
from sgnlp.simulation.articulation import LEAST_INERTIA, LEAST_MASS, read
from sgnlp.simulation.scene import SHOWN, touchable
from sgnlp.simulation.settings import SimulationSettings

ARM = "arm/"
"""Prefix of all names from the arm's URDF."""
ARM_BIT = 2
"""MuJoCo's contact type of an arm's links: they touch all other bodies, but not each other, since the hulls of
neighbouring links overlap."""
NEXT_TO_HAND = 2
"""Number of joints before the flange whose links do not touch the hand: their hulls overlap with it."""


def arm_articulation(arm: Arm, settings: SimulationSettings) -> Any:
    """A `mujoco.MjSpec` of the arm, its root link fixed, each link with the mass and inertia of the URDF.

    The links collide as the convex hulls of their visual geometry. The servos compensate the weight of arm and hand, as
    in a real arm, and the total torque of a joint stays within its effort.
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
    """Put the arm at its base into a scene; returns the frame that the hand's root link is attached to."""
    x, y, z, qx, qy, qz, qw = arm.base
    base = spec.worldbody.add_frame(pos=[x, y, z], quat=[qw, qx, qy, qz])
    spec.attach(arm_articulation(arm, settings), frame=base, prefix=ARM)
    x, y, z, qx, qy, qz, qw = arm.mount
    return spec.body(ARM + arm.flange).add_frame(pos=[x, y, z], quat=[qw, qx, qy, qz])


def separate(spec: Any, arm: Arm, hand_links: list[str]) -> None:
    """Exclude contacts between the hand and the arm's links next to it."""
    near, link, joints = [], spec.body(ARM + arm.flange), 0
    while joints < NEXT_TO_HAND and link.name.startswith(ARM):
        near.append(link.name)
        joints, link = joints + len(link.joints), link.parent
    for one in near:
        for other in hand_links:
            spec.add_exclude(bodyname1=one, bodyname2=other)


def add_servos(spec: Any, arm: Arm) -> None:
    """Add a position servo for each joint; `tune` sets its gains."""
    import mujoco

    for name in arm.joint_names:
        servo = spec.add_actuator(name=ARM + name)
        servo.trntype, servo.target, servo.gear[0] = mujoco.mjtTrn.mjTRN_JOINT, ARM + name, 1.0
        servo.gaintype, servo.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE


def tune(model: Any, arm: Arm, qpos: np.ndarray, settings: SimulationSettings) -> None:
    """Set the servos' stiffness and critical damping for the diagonal of the inertia matrix at a configuration.

    Stiffness τ_j/g and damping 2 √(τ_j M_jj/g), with the effort τ_j, the setting `arm_give` g and the inertia M_jj.
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
