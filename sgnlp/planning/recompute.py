"""The grasp of a solution recomputed in NumPy: Pinocchio's kinematics, the Cholesky posterior and an SVD.

Nothing here shares code with the expressions that the solver saw, and nothing is smoothed.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.hand.kinematics import frames, joint_torques
from sgnlp.planning.problem import Problem
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp

Array = NDArray[np.float64]


def equilibrium(p: Array, o: Array, k: Array, mass: float, com: Array) -> tuple[Array, Array, float]:
    """R (3, 3), t (3) [m] and stiffness ρ [N m] of contacts p (m, 3), targets o (m, 3), gains k (m), by an SVD."""
    p_mean, o_mean = k @ p / k.sum(), k @ o / k.sum()
    load = np.array([0.0, 0.0, mass * GRAVITY])
    B = (k[:, None] * (o - o_mean)).T @ (p - p_mean) - np.outer(load, com - p_mean)
    U, s, Vt = np.linalg.svd(B)
    sign = np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    R = U @ np.diag([1.0, 1.0, sign]) @ Vt
    s1, s2, s3 = s * [1.0, 1.0, sign]
    rho = (s1 + s2) * (s2 + s3) * (s1 + s3) / max((s1 + s2 + s3) ** 2, np.finfo(float).tiny)
    return R, o_mean - R @ p_mean - load / k.sum(), float(rho)


def recompute(problem: Problem, wrist: Array, joints: Array, targets: Array, gains: Array) -> tuple[Grasp, Array]:
    """The exact grasp and the translation t (3) [m] of its equilibrium, which is always the true minimiser."""
    hand, gpis, contact = problem.hand, problem.gpis, problem.settings.contact
    a, s = frames(hand, wrist, joints)
    o, k, K = targets, gains, contact.samples
    p = o + contact.c * (a - o)
    R, t, rho = equilibrium(p, o, k, contact.mass, problem.com)
    p_eq = p @ R.T + t
    tip_radii = np.array([finger.radius for finger in hand.fingers])
    pad = tip_radii * contact.pad
    radii = np.array([sphere.radius for sphere in hand.spheres])
    forces, forces_eq, load = (
        k[:, None] * (o - p),
        k[:, None] * (o - p_eq),
        np.array([0.0, 0.0, contact.mass * GRAVITY]),
    )
    clearances = gpis.distance(s) - radii
    along = np.linspace(0.0, 1.0, K)[None, :, None]  # from the pregrasp tip to the target
    path = (along * o[:, None] + (1 - along) * a[:, None]).reshape(-1, 3)
    normals = gpis.normal(p)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    first, second = np.array(hand.pairs, dtype=int).reshape(-1, 2).T
    grasp = Grasp(
        joints=joints,
        reference=hand.reference,
        tips=a,
        targets=o,
        gains=k,
        contacts=p,
        contacts_eq=p_eq,
        contacts_desired=problem.com + problem.displacement + (p - problem.com) @ problem.turn.T,
        rotation=R,
        rotation_desired=problem.turn,
        stiffness=rho,
        forces=forces,
        forces_eq=forces_eq,
        torques=joint_torques(hand, wrist, joints, forces),
        torques_eq=joint_torques(hand, wrist, joints, forces_eq),
        effort=hand.effort,
        wrench=_wrench(forces, p - problem.com, load),
        wrench_eq=_wrench(forces_eq, p_eq - (R @ problem.com + t), load),
        tip_errors=np.zeros_like(a),
        normals=normals,
        normals_eq=normals @ R.T,
        gaps=gpis.distance(p - pad[:, None] * normals),
        contact_deviations=gpis.distance_deviation(p),
        path_gaps=gpis.distance(path) - np.repeat(pad, K),
        path_deviations=gpis.distance_deviation(path),
        target_means=gpis.mean(o),
        spheres=s,
        radii=radii,
        object_clearances=np.delete(clearances, hand.tip_spheres),
        pad_clearances=clearances[list(hand.tip_spheres)],
        table_clearances=np.delete(s[:, 2] - radii, hand.tip_spheres) - problem.table_height,
        pad_heights=a[:, 2] - tip_radii - problem.table_height,
        pair_clearances=np.linalg.norm(s[first] - s[second], axis=1) - radii[first] - radii[second],
        ball_clearances=gpis.radius - np.linalg.norm(a - gpis.centre, axis=1),
        contact_heights=p[:, 2] - pad - problem.table_height,
        contact_heights_eq=p_eq[:, 2] - pad - problem.table_height,
        path_samples=K,
        density_share=contact.density == "share",
        friction=contact.friction,
        force_min=problem.settings.limits.force_min,
    )
    return grasp, t


def _wrench(forces: Array, arms: Array, load: Array) -> Array:
    """Net force and torque (2, 3) on the object of forces (m, 3) at arms (m, 3) and its load (3)."""
    return np.stack([forces.sum(axis=0) - load, np.cross(arms, forces).sum(axis=0)])


def rotation_angle(R: Any) -> float:
    """Angle of a rotation matrix [rad], accurate near 0: 2 asin(|R - I|_F / √8)."""
    return float(2 * np.arcsin(min(np.linalg.norm(R - np.eye(3)) / np.sqrt(8.0), 1.0)))
