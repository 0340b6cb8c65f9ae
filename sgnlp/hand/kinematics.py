"""Forward kinematics as CasADi expressions and, beside it, the same in numeric Pinocchio.

The configuration is `q = q_seed ⊕ v`: a seed (wrist pose and joint angles) moved by a tangent vector v of R^(6+n),
as Pinocchio's free flyer does it. There is no Euler angle and no quaternion constraint, and the derivatives with
respect to v are exact and finite everywhere, at v = 0 too.
"""

import math
from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError, unknown
from sgnlp.hand.hand import Hand
from sgnlp.hand.model import places

Backend = Literal["pinocchio.casadi", "model walk"]
Chain = list[tuple[ca.SX, ca.SX]]
"""Rotation (3, 3) and position (3,) [m] in the world of the universe and every joint."""

SERIES_TERMS = 16
"""Terms of the power series in θ². The remainder is under 1e-16 for |θ| ≤ 4 in the value and two derivatives."""


@dataclass(frozen=True)
class Frames:
    """Symbolic positions in the world of a hand with m fingers, S spheres and L links."""

    tips: ca.SX  # (m, 3) [m]
    spheres: ca.SX  # (S, 3) [m]
    position: ca.SX  # (3,) [m], origin of the root link
    rotation: ca.SX  # (3, 3), orientation of the root link
    origins: ca.SX  # (L, 3) [m], origins of the frames of `link_names`


def backends() -> tuple[Backend, ...]:
    """The symbolic backends that run here, the preferred one first."""
    try:
        import pinocchio.casadi  # noqa: F401
    except ImportError:  # the wheel on PyPI is built without it
        return ("model walk",)
    return ("pinocchio.casadi", "model walk")


def backend() -> Backend:
    """The symbolic backend that `forward` uses by default."""
    return backends()[0]


def forward(hand: Hand, wrist: ca.SX, joints: ca.SX, v: ca.SX, using: Backend | None = None) -> Frames:
    """Positions of the fingertips and spheres at `(wrist, joints) ⊕ v`.

    `wrist` (7,) is the seed pose x y z qx qy qz qw of the root link with a unit quaternion, `joints` (n,) the seed
    angles, `v` (6+n,) the tangent: linear and angular part in the seed's body frame [m, rad], then the joints [rad].
    Raises `InputError` for a backend that does not run here.
    """
    rotation, position = _integrate_pose(wrist, v[:6])
    chain = placements(hand.model, rotation, position, joints + v[6:], using)
    tips = points(hand.model, chain, [(finger.frame, finger.offset) for finger in hand.fingers])
    spheres = points(hand.model, chain, [(sphere.link, sphere.centre) for sphere in hand.spheres])
    origins = points(hand.model, chain, [(link, np.zeros(3)) for link in link_names(hand)])
    tips, spheres, position, rotation = ca.cse([tips, spheres, position, rotation])
    return Frames(tips, spheres, position, rotation, origins)


def placements(
    model: pin.Model, rotation: ca.SX, position: ca.SX, angles: ca.SX, using: Backend | None = None
) -> Chain:
    """World placements of the universe and all joints, for the root link's rotation (3, 3) and position (3,) [m].

    Raises `InputError` for a backend that does not run here.
    """
    using = using or backend()
    if using not in backends():
        raise unknown("kinematics backend", using, backends())
    walk = {"pinocchio.casadi": _pinocchio_placements, "model walk": _walk_placements}[using]
    return walk(model, rotation, position, angles)


def points(model: pin.Model, chain: Chain, on_links: list[tuple[str, Array]]) -> ca.SX:
    """World positions (K, 3) [m] of points fixed to links, from the `placements` of the joints."""
    rows = [_point(model, chain, link, point).T for link, point in on_links]
    return ca.vertcat(*rows) if rows else ca.SX(0, 3)


def integrate(hand: Hand, wrist: Array, joints: Array, v: Array) -> tuple[Array, Array]:
    """The wrist pose (7,) and joint angles (n,) of `(wrist, joints) ⊕ v`, by numeric Pinocchio."""
    return pin.liegroups.SE3().integrate(np.asarray(wrist, float), np.asarray(v[:6], float)), joints + v[6:]


def link_names(hand: Hand) -> tuple[str, ...]:
    """The L links of a hand, in Pinocchio's order; the root link first."""
    return tuple(frame.name for frame in hand.model.frames if frame.type == pin.FrameType.BODY)


def link_origins(hand: Hand, wrist: Array, joints: Array) -> Array:
    """Origins (L, 3) [m] of the frames of `link_names` in the world, by numeric Pinocchio."""
    return places(hand.model, wrist, joints, [(link, np.zeros(3)) for link in link_names(hand)])


def tips(hand: Hand, wrist: Array, joints: Array) -> Array:
    """World positions of the tips (m, 3) [m] by numeric Pinocchio."""
    return places(hand.model, wrist, joints, [(finger.frame, finger.offset) for finger in hand.fingers])


def frames(hand: Hand, wrist: Array, joints: Array) -> tuple[Array, Array]:
    """World positions of the tips (m, 3) and spheres (S, 3) [m] by numeric Pinocchio, independent of `forward`."""
    spheres = [(sphere.link, sphere.centre) for sphere in hand.spheres]
    return tips(hand, wrist, joints), places(hand.model, wrist, joints, spheres)


def joint_torques(hand: Hand, wrist: Array, joints: Array, forces: Array) -> Array:
    """Joint torques Σ J_iᵀ f_i (n,) [N m] that exert forces (m, 3) [N] at the tips, by numeric Pinocchio."""
    return np.asarray(tip_jacobian(hand, wrist, joints).T @ np.ravel(forces))


def tip_jacobian(hand: Hand, wrist: Array, joints: Array) -> Array:
    """∂a/∂joints (3 m, n) of the tips, row by row in the world, by numeric Pinocchio."""
    data = hand.model.createData()
    pin.computeJointJacobians(hand.model, data, np.asarray(joints, float))
    pin.updateFramePlacements(hand.model, data)
    rotation = pin.XYZQUATToSE3(np.asarray(wrist, float)).rotation
    rows = []
    for finger in hand.fingers:
        frame = _frame(hand, finger.frame)
        J = pin.getFrameJacobian(hand.model, data, frame, pin.LOCAL_WORLD_ALIGNED)  # of the frame's origin
        arm = data.oMf[frame].rotation @ finger.offset
        rows.append(rotation @ (J[:3] - pin.skew(arm) @ J[3:]))
    return np.vstack(rows)


def _frame(hand: Hand, link: str) -> int:
    return hand.model.getFrameId(link, pin.FrameType.BODY)


def _point(model: pin.Model, chain: Chain, link: str, point: Array) -> ca.SX:
    """The world position (3,) of a point fixed to a link."""
    frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
    rotation, position = chain[frame.parentJoint]
    return position + ca.mtimes(rotation, constant(frame.placement.act(np.array(point))))


def _integrate_pose(wrist: ca.SX, twist: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Rotation (3, 3) and position (3,) of the seed pose times exp6 of the twist (linear, angular)."""
    rotation = quaternion_matrix(wrist[3:])
    turn, shift = _exp6(twist[:3], twist[3:])
    return ca.mtimes(rotation, turn), wrist[:3] + ca.mtimes(rotation, shift)


def quaternion_matrix(q: ca.SX) -> ca.SX:
    """The rotation matrix of a unit quaternion x y z w."""
    x, y, z, w = ca.vertsplit(q)
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        ca.horzcat(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        ca.horzcat(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def _exp6(linear: ca.SX, angular: ca.SX) -> tuple[ca.SX, ca.SX]:
    """exp of a twist: `R = I + a[ω] + b[ω]²`, `p = v + b ω×v + c ω×(ω×v)`, θ = |ω|,

    with a = sin θ/θ, b = (1 - cos θ)/θ², c = (θ - sin θ)/θ³ as power series in θ²: smooth at zero, no branch.
    """
    square = ca.dot(angular, angular)
    b, c = _series(square, 2), _series(square, 3)
    a = 1 - square * c
    cross = ca.cross(angular, linear)
    turn = (1 - b * square) * ca.SX.eye(3) + a * ca.skew(angular) + b * ca.mtimes(angular, angular.T)
    return turn, linear + b * cross + c * ca.cross(angular, cross)


def _series(square: ca.SX, first: int) -> ca.SX:
    """`Σ_k (-θ²)^k / (first + 2k)!` in Horner form: first = 2 gives (1 - cos θ)/θ², 3 gives (θ - sin θ)/θ³."""
    value = ca.SX(0)
    for k in reversed(range(SERIES_TERMS)):
        value = 1 / math.factorial(first + 2 * k) - square * value
    return value


def _walk_placements(model: pin.Model, rotation: ca.SX, position: ca.SX, angles: ca.SX) -> Chain:
    """World placements of all joints by recursion over the model's tree: parent · placement · motion."""
    chain = [(rotation, position)]
    for joint in range(1, model.njoints):
        parent_rotation, parent_position = chain[model.parents[joint]]
        placement = model.jointPlacements[joint]
        turn, shift = _motion(model, joint, angles[model.idx_qs[joint]])
        turn = ca.mtimes(constant(placement.rotation), turn)
        shift = constant(placement.translation) + ca.mtimes(constant(placement.rotation), shift)
        chain.append(
            (ca.mtimes(parent_rotation, turn), parent_position + ca.mtimes(parent_rotation, ca.sparsify(shift)))
        )
    return chain


def _motion(model: pin.Model, joint: int, q: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Rotation and translation of a revolute or prismatic joint, from its motion subspace.

    q is its coordinate, or that of the joint which it mimics.
    """
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, np.zeros(model.nq))
    subspace = np.asarray(data.S).ravel()  # (6,) linear, angular
    if model.joints[joint].nq == 0:
        mimic = model.joints[joint].extract()
        subspace, q = subspace / mimic.scaling, mimic.scaling * q + mimic.offset
    linear, angular = subspace[:3], subspace[3:]
    if not angular.any():
        return ca.SX.eye(3), ca.sparsify(ca.SX(linear) * q)
    if linear.any():
        raise InputError(f"joint '{model.names[joint]}' is {model.joints[joint].shortname()}: not supported")
    outer = np.outer(angular, angular)
    turn = outer + ca.cos(q) * (np.eye(3) - outer) + ca.sin(q) * pin.skew(angular)  # Rodrigues
    return ca.sparsify(turn), ca.SX(3, 1)


def _pinocchio_placements(model: pin.Model, rotation: ca.SX, position: ca.SX, angles: ca.SX) -> Chain:
    """World placements of all joints by Pinocchio's own recursion on CasADi scalars."""
    import pinocchio.casadi as cpin

    symbolic = cpin.Model(model)
    data = symbolic.createData()
    cpin.forwardKinematics(symbolic, data, angles)
    inner = [(ca.sparsify(place.rotation), ca.sparsify(place.translation)) for place in data.oMi]
    return [(ca.mtimes(rotation, turn), position + ca.mtimes(rotation, shift)) for turn, shift in inner]


def constant(values: Array) -> ca.SX:
    """A constant whose zeros are structural, so that products with it cost nothing."""
    return ca.sparsify(ca.SX(np.asarray(values, float)))
