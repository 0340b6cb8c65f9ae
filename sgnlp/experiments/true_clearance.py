"""Distances of the true meshes of a hand and its arm from obstacles; the planner uses only spheres."""

from collections.abc import Iterator, Sequence

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.geometry import surface_points
from sgnlp.hand.hand import Hand
from sgnlp.hand.meshes import link_meshes, link_poses
from sgnlp.perception.shape import Shape
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution
from sgnlp.surface.shape_field import ShapeField

FACE_POINTS = 1000
"""Number of random points on the faces of a mesh, besides its vertices."""
STEPS = 5
"""Number of places on the straight way at which the hand is examined, with both ends."""


def true_clearance(problem: Problem, solution: Solution, shapes: Sequence[Shape]) -> float:
    """The least distance [m] of every link's mesh to the shapes, along approach, closing and lift."""
    field, hand, arm = ShapeField(shapes), problem.hand, problem.hand.arm
    gaps = [field.distance(_skin(hand, wrist, joints)).min() for wrist, joints in _postures(problem, solution)]
    if arm is not None and solution.arm is not None:
        gaps += [field.distance(_skin(arm, arm.base, q)).min() for q in solution.arm]
    return float(min(gaps))


def _postures(problem: Problem, solution: Solution) -> Iterator[tuple[Array, Array]]:
    """Wrist poses (7,) and joints (n,) on the way."""
    motion, place = problem.settings.motion, pin.XYZQUATToSE3(solution.wrist)
    back, up = -motion.standoff * place.rotation @ problem.hand.palm, np.array([0.0, 0.0, motion.lift])
    for share in np.linspace(0.0, 1.0, STEPS):
        yield _moved(solution.wrist, share * back), solution.joints
        yield _moved(solution.wrist, share * up), solution.joints_contact


def _moved(wrist: Array, by: Array) -> Array:
    return np.concatenate([wrist[:3] + by, wrist[3:]])


def _skin(body: Hand | Arm, base: Array, joints: Array) -> Array:
    """Points (K, 3) [m] of all meshes of a hand or an arm in the world."""
    meshes, poses = link_meshes(body)[0], link_poses(body, base, joints)
    points = [surface_points(mesh, FACE_POINTS) for mesh in meshes]
    return np.vstack([P @ T[:3, :3].T + T[:3, 3] for P, T in zip(points, poses, strict=True)])
