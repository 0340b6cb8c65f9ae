"""Forward kinematics as CasADi expressions, and the same in numeric Pinocchio.

The configuration is `q = q_seed ⊕ v`: a seed (wrist pose and joint angles) moved by a tangent vector v of R^(6+n),
as Pinocchio's free flyer does it. There is no Euler angle and no quaternion constraint, and the derivatives with
respect to v are exact and finite everywhere, at v = 0 too.
"""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.hand.model import places
from sgnlp.hand.placement_functions import motion_subspace
from sgnlp.hand.placements import Backend, Chain, constant, placements

TIPS_OFF = 5e-3
"""[m], by which the tips of a planned grasp may be off those of its hand: a left and a right hand differ by more."""
SERIES_TERMS = 16
"""Number of terms of the power series in θ². For |θ| ≤ 4 the remainder of value and two derivatives is below 1e-16."""


@dataclass(frozen=True)
class Frames:
    """Symbolic world positions of a hand with m fingers, S spheres, L links and J joints, including mimic joints.

    A joint moves its links along its axis, or about it through its pivot. The axes have length 1, except for mimic
    joints, whose axes have the length of the multiplier.
    """

    tips: ca.SX  # (m, 3) [m]
    spheres: ca.SX  # (S, 3) [m]
    position: ca.SX  # (3,) [m], origin of the root link
    rotation: ca.SX  # (3, 3), orientation of the root link
    origins: ca.SX  # (L, 3) [m], origins of the frames of `link_names`
    along: ca.SX  # (J, 3)
    about: ca.SX  # (J, 3)
    pivots: ca.SX  # (J, 3) [m]


def forward(hand: Hand, wrist: ca.SX, joints: ca.SX, v: ca.SX, using: Backend | None = None) -> Frames:
    """Positions of the fingertips and spheres at `(wrist, joints) ⊕ v`.

    `wrist` (7,) is the seed pose x y z qx qy qz qw of the root link with a unit quaternion, `joints` (n,) the seed
    angles, `v` (6+n,) the tangent: linear and angular part in the seed's body frame [m, rad], then the joints [rad].
    The backend is the hand's own unless `using` names another; raises `InputError` if that does not run here.
    """
    rotation, position = _integrate_pose(wrist, v[:6])
    chain = placements(hand.model, joints + v[6:], using or hand.kinematics)

    def world(on_links: list[tuple[str, Array]]) -> ca.SX:
        return moved(rotation, position, points(hand.model, chain, on_links))

    tips = world([(finger.frame, finger.offset) for finger in hand.fingers])
    spheres = world([(sphere.link, sphere.centre) for sphere in hand.spheres])
    origins = world([(link, np.zeros(3)) for link in link_names(hand)])
    along, about, pivots = axes(hand.model, chain)
    placed = [tips, spheres, position, rotation, along @ rotation.T, about @ rotation.T]
    tips, spheres, position, rotation, along, about = ca.cse([*placed])
    return Frames(tips, spheres, position, rotation, origins, along, about, moved(rotation, position, pivots))


def points(model: pin.Model, chain: Chain, on_links: list[tuple[str, Array]]) -> ca.SX:
    """Positions (K, 3) [m] of points fixed to links in the frame of the model's root, from its `placements`."""
    rows = [_point(model, chain, link, point).T for link, point in on_links]
    return ca.vertcat(*rows) if rows else ca.SX(0, 3)


def axes(model: pin.Model, chain: Chain) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Along, about and the pivots (J, 3) of all joints as in `Frames`, in the frame of the model's root."""
    along, about, pivots = ca.SX(0, 3), ca.SX(0, 3), ca.SX(0, 3)
    for joint in range(1, model.njoints):
        linear, angular = np.split(motion_subspace(model, joint), 2)
        rotation, pivot = chain[joint]
        along = ca.vertcat(along, ca.mtimes(rotation, constant(linear)).T)
        about = ca.vertcat(about, ca.mtimes(rotation, constant(angular)).T)
        pivots = ca.vertcat(pivots, pivot.T)
    return along, about, pivots


def moved(rotation: ca.SX, position: ca.SX, at: ca.SX) -> ca.SX:
    """Positions (K, 3) [m] moved by a rotation (3, 3) and then by a position (3,) [m]."""
    return ca.mtimes(at, rotation.T) + ca.repmat(position.T, at.shape[0], 1)


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


def tips_off(hand: Hand, wrist: Array, joints: Array, planned: Array) -> float:
    """The largest distance [m] of planned tips (m, 3) from those of a hand; see `TIPS_OFF`."""
    return float(np.linalg.norm(planned - tips(hand, wrist, joints), axis=1).max())


def frames(hand: Hand, wrist: Array, joints: Array) -> tuple[Array, Array]:
    """World positions of the tips (m, 3) and spheres (S, 3) [m] by numeric Pinocchio, independent of `forward`."""
    ends = [(finger.frame, finger.offset) for finger in hand.fingers]
    found = places(hand.model, wrist, joints, [*ends, *((sphere.link, sphere.centre) for sphere in hand.spheres)])
    return found[: len(ends)], found[len(ends) :]


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
    """The position (3,) of a point fixed to a link."""
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
