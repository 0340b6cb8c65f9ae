"""Grasps in the plane: the equilibrium in closed form, two-link fingers, and the least torque that a grasp needs.

The springs hold the object at its equilibrium pose with forces f_i at the contacts p_i. At another pose, with contacts
p_i(β), finger i pulls with f_i(β) = f_i + k_i (p_i - p_i(β)). So for a given motion all conditions on its way, the
friction cones and the joint torques Jᵀf, are linear in forces f and gains k. The least torque limit that allows this
motion is a linear program, and direct force closure is the motion 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from sgnlp.base.arrays import Array

# largest number of linear programs for a motion: each but the first adds a cut to the condition on the stiffness
CUTS = 20
TOLERANCE = 1e-6  # tolerance of the stiffness, relative to the required one


def cross(a: Array, b: Array) -> Array:
    """The third component of a x b, over the last axis (2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def turn(angle: float) -> Array:
    """Rotation matrix (2, 2)."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def equilibrium(P: Array, O: Array, k: Array) -> tuple[float, Array, float]:
    """The minimiser of Σ ½ k_i |R p_i + t - o_i|²: angle, t (2) [m], and the stiffness of its rotation [N m].

    Wahba's problem in the plane: with the k-weighted centroids p̄ and ō, a = Σ k (p - p̄)·(o - ō) and
    b = Σ k (p - p̄)x(o - ō), the angle is atan2(b, a) and the stiffness √(a² + b²). P, O (m, 2) [m], k (m) [N/m].
    """
    p, o = k @ P / k.sum(), k @ O / k.sum()
    a, b = k @ ((P - p) * (O - o)).sum(axis=1), k @ cross(P - p, O - o)
    angle = float(np.arctan2(b, a))
    return angle, o - turn(angle) @ p, float(np.hypot(a, b))


@dataclass(frozen=True)
class Finger:
    """Two links [m] that turn about `base` (2) [m]; `elbow` is the sign of the second joint's angle."""

    base: tuple[float, float]
    links: tuple[float, float]
    elbow: int

    def torques(self, tip: Array) -> Array | None:
        """Jᵀ (2, 2) [m] of the tip (2) [m], which maps a force to joint torques; None if the tip is out of reach."""
        (l1, l2), reach = self.links, tip - self.base
        cosine = (reach @ reach - l1**2 - l2**2) / (2 * l1 * l2)
        if abs(cosine) > 1:
            return None
        q2 = self.elbow * np.arccos(cosine)
        q1 = np.arctan2(reach[1], reach[0]) - np.arctan2(l2 * np.sin(q2), l1 + l2 * np.cos(q2))
        arms = np.stack([reach, reach - l1 * np.array([np.cos(q1), np.sin(q1)])])  # from each joint to the tip
        return np.stack([-arms[:, 1], arms[:, 0]], axis=1)


@dataclass(frozen=True)
class Stage:
    """A pose on the way: contacts (m, 2) [m], outward normals (m, 2), and Jᵀ (m, n, 2) [m] of each finger."""

    points: Array
    normals: Array
    torques: Array


@dataclass(frozen=True)
class Demands:
    """Friction, least normal force at the equilibrium [N], gains [N/m], least stiffness of the rotation [N m]."""

    friction: float
    force: float
    gains: tuple[float, float]
    stiffness: float


@dataclass(frozen=True)
class PlanarGrasp:
    """Forces at the equilibrium (m, 2) [N], gains (m) [N/m], and the torque [N m] that it needs."""

    forces: Array
    gains: Array
    torque: float


def least_torque(stages: Sequence[Stage], demands: Demands) -> PlanarGrasp | None:
    """The grasp of least torque on a way that ends in its equilibrium; None if no limit allows one.

    min τ over f, k, τ subject to Σ f = 0 and Σ p x f = 0; at the end the normal force; and at every stage the friction
    cones and |Jᵀ f| ≤ τ. The stiffness Σ k |p - p̄|² + Σ f·p is concave in (f, k), the least over all c of
    Σ k |p - c|² + Σ f·p, and so held by cuts at the centroids c of the solutions that lack it.
    """
    end = stages[-1].points
    m = len(end)
    A, b = _inequalities(stages, demands)
    balance = np.zeros((3, 3 * m + 1))
    balance[0, 0 : 2 * m : 2] = balance[1, 1 : 2 * m : 2] = 1
    balance[2, : 2 * m] = np.stack([-end[:, 1], end[:, 0]], axis=1).ravel()
    cost = np.r_[np.zeros(3 * m), 1.0]
    bounds = [(None, None)] * 2 * m + [demands.gains] * m + [(0, None)]
    c = end.mean(axis=0)
    for _ in range(CUTS):
        A = np.vstack([A, -np.r_[(end - c).ravel(), ((end - c) ** 2).sum(axis=1), 0.0]])
        b = np.r_[b, -demands.stiffness]
        found = linprog(cost, A, b, balance, np.zeros(3), bounds, method="highs")
        if found.x is None:
            return None
        f, k = found.x[: 2 * m].reshape(m, 2), found.x[2 * m : 3 * m]
        c = k @ end / k.sum()
        if k @ ((end - c) ** 2).sum(axis=1) + (f * end).sum() >= demands.stiffness * (1 - TOLERANCE):
            return PlanarGrasp(f, k, float(found.x[-1]))
    return None


def holds(grasp: PlanarGrasp, stages: Sequence[Stage], demands: Demands) -> bool:
    """Whether the springs, from the first stage on, end at the last and satisfy all demands, checked independently.

    The equilibrium is that of `equilibrium`, and the margin of a force that of the 3-D grasps, -f·n/|f| - 1/√(1 + μ²).
    """
    start, end, k = stages[0].points, stages[-1].points, grasp.gains
    targets = end + grasp.forces / k[:, None]
    angle, t, stiffness = equilibrium(start, targets, k)
    small = TOLERANCE * float(np.ptp(start))
    ends = np.abs(start @ turn(angle).T + t - end).max() <= small and stiffness >= demands.stiffness * (1 - TOLERANCE)
    for stage in stages:
        f = k[:, None] * (targets - stage.points)
        size = np.linalg.norm(f, axis=1)
        margins = -(f * stage.normals).sum(axis=1) / np.maximum(size, TOLERANCE) - 1 / np.hypot(1, demands.friction)
        torques = np.abs(np.einsum("mij,mj->mi", stage.torques, f))
        ends &= bool((margins[size > TOLERANCE] >= -TOLERANCE).all()) and torques.max() <= grasp.torque + TOLERANCE
    pressed = -(grasp.forces * stages[-1].normals).sum(axis=1).min()
    return bool(ends and pressed >= demands.force * (1 - TOLERANCE))


def _inequalities(stages: Sequence[Stage], demands: Demands) -> tuple[Array, Array]:
    """A x ≤ b of x = (f, k, τ) for cones and torques at every stage, and the normal force at the last."""
    end, m = stages[-1].points, len(stages[-1].points)
    rows = []
    for stage in stages:
        n, J = stage.normals, stage.torques
        tangents = np.stack([-n[:, 1], n[:, 0]], axis=1)
        cone = demands.friction * n[:, None] + np.stack([tangents, -tangents], axis=1)
        directions = np.concatenate([cone, J, -J], axis=1)  # (m, r, 2), each · f_i(β) ≤ 0 or τ
        A = np.zeros((m, directions.shape[1], 3 * m + 1))
        A[:, cone.shape[1] :, -1] = -1
        for i in range(m):
            A[i, :, 2 * i : 2 * i + 2] = directions[i]
            A[i, :, 2 * m + i] = directions[i] @ (end[i] - stage.points[i])
        rows.append(A.reshape(-1, 3 * m + 1))
    press = np.zeros((m, 3 * m + 1))
    for i, n in enumerate(stages[-1].normals):
        press[i, 2 * i : 2 * i + 2] = n
    rows.append(press)
    return np.concatenate(rows), np.repeat([0.0, -demands.force], [sum(map(len, rows)) - m, m])
