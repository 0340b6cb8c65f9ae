"""Kinematics and statics of an arm: numerically by Pinocchio, and as CasADi expressions.

Twists and Jacobians are those of the hand's root link at its origin, along the axes of the world, linear part first.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.kinematics import axes, moved, points
from sgnlp.hand.model import places
from sgnlp.hand.placements import Backend, Chain, backend, constant, placements

DAMPING = 1e-4
"""ε [m or rad, per radian] of `log_manipulability`: smaller singular values of the Jacobian count as ε."""
TWIST = 6

Placement = tuple[ca.SX, ca.SX]
"""Rotation (3, 3) and position (3,) [m]."""


def wrist_pose(arm: Arm, q: Array) -> Array:
    """The pose (7,), x y z qx qy qz qw, of the hand's root link in the world, for joints q (a,) [rad or m]."""
    return np.asarray(pin.SE3ToXYZQUAT(wrist_and_jacobian(arm, q, arm.model.createData())[0]))


def arm_spheres(arm: Arm, q: Array) -> Array:
    """World positions (S, 3) [m] of the spheres."""
    return places(arm.model, arm.base, q, [(sphere.link, sphere.centre) for sphere in arm.spheres])


def wrist_jacobian(arm: Arm, q: Array) -> Array:
    """∂(twist of the hand's root link)/∂q̇ (6, a)."""
    return wrist_and_jacobian(arm, q, arm.model.createData())[1]


def wrist_and_jacobian(arm: Arm, q: Array, data: pin.Data) -> tuple[pin.SE3, Array]:
    """Pose and Jacobian (6, a) of the hand's root link, with `data` of the arm's model to work in."""
    frame = arm.model.getFrameId(arm.flange, pin.FrameType.BODY)
    inner = pin.computeFrameJacobian(arm.model, data, np.asarray(q, float), frame, pin.LOCAL_WORLD_ALIGNED)
    base, mount = pin.XYZQUATToSE3(arm.base), pin.XYZQUATToSE3(arm.mount)
    rotation, flange = base.rotation, data.oMf[frame]
    lever = flange.rotation @ mount.translation
    linear = inner[:3] - pin.skew(lever) @ inner[3:]
    return base * flange * mount, np.vstack([rotation @ linear, rotation @ inner[3:]])


def manipulability(arm: Arm, q: Array) -> float:
    """√det(J Jᵀ), 0 at a singularity; √det(Jᵀ J) for an arm with fewer than six joints, whose J has lower rank."""
    return float(np.sqrt(max(np.linalg.det(_gram(wrist_jacobian(arm, q))), 0.0)))


def gravity_torques(arm: Arm, q: Array, mass: float, com_in_wrist: Array) -> Array:
    """Joint torques (a,) [N m] that hold the arm and a point mass [kg] at rest.

    They include the links' masses from the URDF, and `mass` at `com_in_wrist` (3,) [m] in the frame of the hand's root
    link: the masses of hand and object at their common centre.
    """
    model = arm.model.copy()
    pose, J = wrist_and_jacobian(arm, q, model.createData())
    gravity = np.array(model.gravity.linear)  # the world's z, expressed in the root link's axes
    model.gravity.linear = pin.XYZQUATToSE3(arm.base).rotation.T @ gravity
    links = pin.computeGeneralizedGravity(model, model.createData(), np.asarray(q, float))
    lever = pose.rotation @ np.asarray(com_in_wrist, float)
    return np.asarray(links - (J[:3] - pin.skew(lever) @ J[3:]).T @ (mass * gravity))


@dataclass(frozen=True)
class ArmFrames:
    """Symbolic positions in the world of an arm with S spheres and a joints; its axes are as in `kinematics.Frames`."""

    rotation: ca.SX  # (3, 3), orientation of the hand's root link
    position: ca.SX  # (3,) [m], its origin
    spheres: ca.SX  # (S, 3) [m]
    along: ca.SX  # (a, 3)
    about: ca.SX  # (a, 3)
    pivots: ca.SX  # (a, 3) [m]


def arm_forward(arm: Arm, q: ca.SX, base: Placement | None = None, using: Backend | None = None) -> ArmFrames:
    """The frames at joints q (a,), with the arm's base at its own place or at another one, `base`.

    The backend is the best unless `using` names one; raises `InputError` for one that does not run here.
    """
    own = pin.XYZQUATToSE3(arm.base)
    turn, shift = base or (constant(own.rotation), constant(own.translation))
    chain = placements(arm.model, q, using or backend(arm.model))
    spheres = points(arm.model, chain, [(sphere.link, sphere.centre) for sphere in arm.spheres])
    rotation, position = _wrist(arm, chain)
    along, about, pivots = axes(arm.model, chain)
    placed = [turn @ rotation, turn @ position + shift, moved(turn, shift, spheres)]
    return ArmFrames(*ca.cse([*placed, along @ turn.T, about @ turn.T, moved(turn, shift, pivots)]))


def log_manipulability(arm: Arm, q: ca.SX, using: Backend | None = None) -> ca.SX:
    """log √det(J Jᵀ + ε² I), ε = `DAMPING`: that of `manipulability` away from singularities, smooth at them too.

    The determinant is the product of the pivots of an L D Lᵀ factorisation. The first joint moves the whole arm
    rigidly, so the result depends neither on it nor on the base.
    """
    q = ca.vertcat(0, q[1:])
    chain = placements(arm.model, q, using or backend(arm.model))
    gram = _gram(_symbolic_jacobian(arm, chain))
    return sum(map(ca.log, _pivots(gram + DAMPING**2 * ca.SX.eye(gram.shape[0]))), ca.SX(0)) / 2


def _gram(J: Any) -> Any:
    """J Jᵀ, or Jᵀ J where that is the smaller one, of a Jacobian in NumPy or CasADi."""
    return J @ J.T if J.shape[1] >= TWIST else J.T @ J


def _wrist(arm: Arm, chain: Chain) -> tuple[ca.SX, ca.SX]:
    """Rotation and position of the hand's root link, from the placements of the joints."""
    frame = arm.model.frames[arm.model.getFrameId(arm.flange, pin.FrameType.BODY)]
    on_joint = frame.placement * pin.XYZQUATToSE3(arm.mount)
    rotation, position = chain[frame.parentJoint]
    return (
        ca.mtimes(rotation, constant(on_joint.rotation)),
        position + ca.mtimes(rotation, constant(on_joint.translation)),
    )


def _symbolic_jacobian(arm: Arm, chain: Chain) -> ca.SX:
    """The Jacobian (6, a), column by column: z × (p - pᵢ) and z of a revolute joint, z and 0 of a prismatic one."""
    along, about, pivots = axes(arm.model, chain)
    lever = ca.repmat(_wrist(arm, chain)[1].T, pivots.shape[0], 1) - pivots
    return ca.horzcat(along + ca.cross(about, lever, 2), about).T


def _pivots(matrix: ca.SX) -> list[ca.SX]:
    """The pivots of L D Lᵀ, by outer products; their product is the determinant."""
    pivots = []
    for _ in range(matrix.shape[0]):
        pivots.append(matrix[0, 0])
        column = matrix[1:, 0]
        matrix = matrix[1:, 1:] - ca.mtimes(column, column.T) / pivots[-1]
    return pivots
