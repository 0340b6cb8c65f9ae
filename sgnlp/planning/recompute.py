"""The grasp of a solution recomputed in NumPy: Pinocchio's kinematics, the Cholesky posterior and an SVD.

It smooths nothing. It shares with the expressions that the solver saw only the algebra of `sgnlp.program.assembly`.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.kinematics import frames, joint_torques, link_names, link_origins
from sgnlp.planning.arm_recompute import carried
from sgnlp.planning.problem import Problem
from sgnlp.program.assembly import Numeric, Parts, assemble
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp
from sgnlp.program.variables import Posture


def equilibrium(p: Array, o: Array, k: Array, mass: float, com: Array) -> tuple[Array, Array, float]:
    """R (3, 3), t (3) [m] and stiffness ρ [N m] at equilibrium, by an SVD; inputs as in `sgnlp.program.equilibrium`.

    Contacts p (m, 3) [m], targets o (m, 3) [m], gains k (m) [N/m], mass [kg], centre of mass com (3) [m].
    """
    p_mean, o_mean = k @ p / k.sum(), k @ o / k.sum()
    load = np.array([0.0, 0.0, mass * GRAVITY])
    B = (k[:, None] * (o - o_mean)).T @ (p - p_mean) - np.outer(load, com - p_mean)
    U, s, Vt = np.linalg.svd(B)
    sign = np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    R = U @ np.diag([1.0, 1.0, sign]) @ Vt
    s1, s2, s3 = s * [1.0, 1.0, sign]
    rho = (s1 + s2) * (s2 + s3) * (s1 + s3) / max((s1 + s2 + s3) ** 2, np.finfo(float).tiny)
    return R, o_mean - R @ p_mean - load / k.sum(), float(rho)


def recompute(problem: Problem, at: Posture) -> tuple[Grasp, Array]:
    """The exact grasp and the translation t (3) [m] of its equilibrium, which is always the true minimiser.

    The arrays of the grasp can be read only: a term of the user's own that writes into one would change the result.
    """
    hand, gpis, contact = problem.hand, problem.gpis, problem.settings.contact
    wrist, joints = at.wrist, at.joints
    a, s = frames(hand, wrist, joints)
    origins, root = link_origins(hand, wrist, joints), pin.XYZQUATToSE3(np.asarray(wrist, float))
    o, k = at.targets, at.gains
    p = o + at.c[:, None] * (a - o)
    touching, tips, spheres = joints, p, s  # at first contact, if it is not planned
    if problem.settings.closing.planned and at.joints_contact is not None:
        touching = at.joints_contact
        tips, spheres = frames(hand, wrist, touching)
    R, t, rho = equilibrium(p, o, k, contact.mass, problem.com)
    parts = Parts(
        wrist_position=root.translation,
        wrist_rotation=root.rotation,
        links=dict(zip(link_names(hand), origins, strict=True)),
        joints=joints,
        joints_contact=touching,
        arm=carried(problem, at, s),
        tips=a,
        tip_errors=np.zeros_like(a),
        reach_errors=tips - p,
        spheres=s,
        spheres_contact=spheres,
        torques=lambda forces: joint_torques(hand, wrist, touching, forces),
        targets=o,
        gains=k,
        contacts=p,
        contacts_eq=p @ R.T + t,
        rotation=R,
        translation=t,
        stiffness=rho,
        sphere_distances=gpis.distance(s),
        link_distances_contact=gpis.distance(np.delete(spheres, hand.tip_spheres, axis=0)),
        obstacle_distances=_obstacle_distances(problem, root.rotation, s, spheres),
        **_at_fingers(problem, a, o, p),
    )
    numbers = SimpleNamespace(**problem.numbers())
    return _kept(assemble(parts, hand, numbers, contact.samples, contact.density, Numeric())), t


def _kept(value: Any) -> Any:
    """The value with its arrays, also those of mappings and dataclasses in it, as views that can be read only."""
    if isinstance(value, np.ndarray):
        view = value.view()
        view.flags.writeable = False
        return view
    if isinstance(value, Mapping):
        return {name: _kept(part) for name, part in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{f.name: _kept(getattr(value, f.name)) for f in fields(value)})
    return value


def _at_fingers(problem: Problem, a: Array, o: Array, p: Array) -> dict[str, Array]:
    """The fields of `Parts` that depend on surface and regions, at tips a, targets o and contacts p (m, 3) [m]."""
    gpis, contact, fields = problem.gpis, problem.settings.contact, problem.fields
    along = np.linspace(0.0, 1.0, contact.samples)[None, :, None]  # from the pregrasp tip to the target
    path = (along * o[:, None] + (1 - along) * a[:, None]).reshape(-1, 3)
    normals = gpis.normal(p)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    feet = p - (problem.hand.tip_radii * contact.pad)[:, None] * normals
    return {
        "normals": normals,
        "gaps": gpis.distance(feet),
        "contact_deviations": gpis.distance_deviation(p),
        "path_distances": gpis.distance(path),
        "path_deviations": gpis.distance_deviation(path),
        "target_means": gpis.mean(o),
        "avoid_distances": fields.avoid.distance(feet) if problem.around.avoid else np.zeros(0),
        "touch_distances": fields.touch.distance(feet) if problem.around.touch else np.zeros(0),
    }


def _obstacle_distances(problem: Problem, rotation: Array, spheres: Array, spheres_contact: Array) -> Array:
    """Exact distances ((3 + A) S,) [m] of the spheres from obstacles, at the postures of `program.around`."""
    around, motion, fields = problem.around, problem.settings.motion, problem.fields
    if not around.obstacles:
        return np.zeros(0)
    ahead = motion.standoff * rotation @ problem.hand.palm
    approach = [spheres - share * ahead for share in np.arange(1, around.approach + 1) / around.approach]
    lifted = spheres_contact + np.array([0.0, 0.0, motion.lift])
    still = [fields.near.distance(points) for points in (spheres, spheres_contact)]
    return np.concatenate([*still, *(fields.way.distance(points) for points in (*approach, lifted))])


def rotation_angle(R: Any) -> float:
    """Angle of a rotation matrix [rad], accurate near 0: 2 asin(|R - I|_F / √8)."""
    return float(2 * np.arcsin(min(np.linalg.norm(R - np.eye(3)) / np.sqrt(8.0), 1.0)))
