"""What cameras see of bodies with known surfaces: points of a ball and of a cup that face them."""

import numpy as np
from numpy.typing import NDArray
from scenes import sphere_points

from sgnlp.perception.observation import Observation, observe

Array = NDArray[np.float64]

RADIUS = 0.04  # [m] of the ball
MIDDLE = np.array([0.0, 0.0, RADIUS])  # [m] of the ball, which rests on the table
BOX = np.array([0.06, 0.06, 0.09])  # [m] edges of the box
EYES = np.array([[0.5, 0.1, 0.35], [-0.4, 0.3, 0.4]])  # [m]


def ball_seen(eye: Array, count: int = 3000, seed: int = 0) -> Array:
    """Points (n, 3) [m] of the ball that a camera at `eye` (3,) sees, those near the table left out."""
    n = sphere_points(count, seed)
    points = MIDDLE + RADIUS * n
    return points[(((eye - points) * n).sum(axis=1) > 0) & (points[:, 2] > 0.003)]


def ball(eyes: Array = EYES, **options: object) -> Observation:
    """The ball seen by cameras at `eyes` (V, 3)."""
    seen = [ball_seen(eye, seed=number) for number, eye in enumerate(eyes)]
    view = np.repeat(np.arange(len(eyes)), [len(points) for points in seen])
    return observe(np.concatenate(seen), view=view, camera_positions=eyes, table_height=0.0, name="ball", **options)


def box_seen(eye: Array, count: int = 4000, seed: int = 0) -> Array:
    """Points (n, 3) [m] of a box on the table that face a camera at `eye` (3,), those near the table left out."""
    rng, points, normals = np.random.default_rng(seed), [], []
    for axis in range(3):
        for side in (-0.5, 0.5):
            face = rng.uniform(-0.5, 0.5, (count, 3))
            face[:, axis] = side
            points.append(face * BOX + [0, 0, BOX[2] / 2])
            normals.append(np.tile(2 * side * np.eye(3)[axis], (count, 1)))
    points, normals = np.concatenate(points), np.concatenate(normals)
    return points[(((eye - points) * normals).sum(axis=1) > 0) & (points[:, 2] > 0.003)]


def cup_seen(eye: Array, outer: float = 0.04, inner: float = 0.036, height: float = 0.08, count: int = 20000) -> Array:
    """Points (n, 3) [m] of a cup that a camera at `eye` (3,) sees through its mouth and from outside."""
    rng = np.random.default_rng(3)
    a, z = rng.uniform(0, 2 * np.pi, (2, count)), rng.uniform(0.003, height, (2, count))
    radial = np.stack([np.cos(a), np.sin(a), np.zeros_like(a)], axis=-1)  # (2, count, 3)
    disc = inner * np.sqrt(rng.random(count // 2))[:, None] * radial[0, : count // 2] + [0, 0, 0.004]
    up = np.tile([0.0, 0.0, 1.0], (count // 2, 1))
    walls = [r * radial[i] + z[i, :, None] * [0, 0, 1] for i, r in enumerate((outer, inner))]
    points, n = np.vstack([*walls, disc]), np.vstack([radial[0], -radial[1], up])
    facing = ((eye - points) * n).sum(axis=1) > 0
    ray = eye - points
    at_mouth = points + ray * ((height - points[:, 2]) / ray[:, 2])[:, None]
    through = np.linalg.norm(at_mouth[:, :2], axis=1) < inner
    outside = np.arange(len(points)) < count
    return points[facing & (outside | through)]
