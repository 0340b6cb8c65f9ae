"""Parametric bodies as watertight triangle meshes: each is a loft, a skin over closed rings of points.

Metres. The bodies stand on z = 0; faces turn counter-clockwise seen from outside.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SEGMENTS = 64  # points of a round ring
QUARTER = 7  # points of a quarter circle on a rounded edge


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed triangle mesh."""

    vertices: FloatArray  # (V, 3) [m]
    faces: IntArray  # (F, 3)

    def placed(self, yaw_deg: float) -> "Mesh":
        """The body turned about z, the centre of its box on the z axis, its lowest point at z = 0."""
        cosine, sine = np.cos(np.deg2rad(yaw_deg)), np.sin(np.deg2rad(yaw_deg))
        vertices = self.vertices @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        return Mesh(vertices - [*(low + high)[:2] / 2, low[2]], self.faces)


def bridge(first: IntArray, second: IntArray) -> IntArray:
    """Triangles (2n, 3) between two closed loops (n,) of vertices that turn about the way to the second."""
    a, b = first, second
    c, d = np.roll(a, -1), np.roll(b, -1)
    return np.concatenate([np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)])


def fan(loop: IntArray, apex: int) -> IntArray:
    """Triangles (n, 3) from a closed loop (n,) of vertices to an apex; the loop turns about the way to it."""
    return np.stack([loop, np.roll(loop, -1), np.full_like(loop, apex)], axis=1)


def loft(start: ArrayLike, rings: FloatArray, end: ArrayLike) -> Mesh:
    """The body over rings (k, n, 3), each turning about the way to the next, and an apex at both ends."""
    count, points = rings.shape[:2]
    loops = np.arange(count * points).reshape(count, points)
    faces = [fan(loops[0][::-1], count * points), fan(loops[-1], count * points + 1)]
    faces += [bridge(first, second) for first, second in pairwise(loops)]
    return Mesh(np.concatenate([rings.reshape(-1, 3), [start, end]]), np.concatenate(faces))


def lathe(profile: ArrayLike, points: int = SEGMENTS) -> Mesh:
    """The body of revolution of a profile (k, 2) of radii and heights that begins and ends on the z axis."""
    radius, height = np.asarray(profile, np.float64).T
    angle = 2 * np.pi * np.arange(points) / points
    ring = np.stack([np.cos(angle), np.sin(angle), np.ones(points)], axis=1)
    rings = ring * np.stack([radius, radius, height], axis=1)[1:-1, None]
    return loft([0, 0, height[0]], rings, [0, 0, height[-1]])


def around(path: FloatArray, radius: ArrayLike, binormal: list[float], angle: FloatArray) -> FloatArray:
    """Circles (k, n, 3) about a path (k, 3) in the plane across `binormal`, a point for each angle (n,)."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.cross(binormal, tangent)[:, None]
    offset = np.cos(angle)[:, None] * normal + np.sin(angle)[:, None] * np.asarray(binormal)
    return path[:, None] + np.broadcast_to(radius, len(path))[:, None, None] * offset


def rectangle(length: float, width: float, radius: float) -> FloatArray:
    """A rectangle (n, 2) about the origin whose corners have a radius; n = 4 if that is zero."""
    quarter = np.linspace(0, np.pi / 2, QUARTER if radius > 0 else 1)
    angle = quarter + np.pi / 2 * np.arange(4)[:, None]
    centre = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * ([length / 2 - radius, width / 2 - radius])
    return (centre[:, None] + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)).reshape(-1, 2)


def box(length: float, width: float, height: float, corner: float = 0.0, edge: float = 0.0) -> Mesh:
    """A box whose upright edges have the radius `corner`, the others a smaller one, `edge`; or both zero."""
    tilt = np.linspace(0, np.pi / 2, QUARTER) if edge > 0 else np.array([np.pi / 2])
    inset, rise = edge * (1 - np.sin(tilt)), edge * (1 - np.cos(tilt))
    levels = [*zip(inset, rise, strict=True), *zip(inset[::-1], height - rise[::-1], strict=True)]
    outlines = [(rectangle(length - 2 * i, width - 2 * i, corner - i), z) for i, z in levels]
    rings = [np.column_stack([outline, np.full(len(outline), z)]) for outline, z in outlines]
    return loft([0, 0, 0], np.stack(rings), [0, 0, height])


def pyramid(side: float, height: float) -> Mesh:
    """A square pyramid."""
    ring = np.column_stack([rectangle(side, side, 0.0), np.zeros(4)])
    return loft([0, 0, 0], ring[None], [0, 0, height])


def ball(radius: float) -> Mesh:
    """A sphere."""
    angle = np.linspace(0, np.pi, SEGMENTS // 2 + 1)
    profile = np.stack([radius * np.sin(angle), radius * (1 - np.cos(angle))], axis=1)
    return lathe(profile)


def can(radius: float, height: float, bevel: float) -> Mesh:
    """An upright cylinder whose rims are bevelled."""
    rim = [(radius - bevel, 0), (radius, bevel), (radius, height - bevel), (radius - bevel, height)]
    return lathe([(0, 0), *rim, (0, height)])


def bottle(radius: float, neck: float, height: float) -> Mesh:
    """A bottle: a cylinder for 55 % of the height, a smooth shoulder to 80 %, a neck above."""
    rise = np.linspace(0, 1, 2 * QUARTER)
    shoulder = neck + (radius - neck) * (1 + np.cos(np.pi * rise)) / 2
    outline = np.stack([shoulder, height * (0.55 + 0.25 * rise)], axis=1)
    return lathe([(0, 0), (0.92 * radius, 0), (radius, 0.03 * height), *outline, (neck, height), (0, height)])


def banana(bend: float, radius: float, half_angle_deg: float) -> Mesh:
    """A tube lying along an arc of radius `bend` that tapers towards both ends."""
    along = np.linspace(-1, 1, SEGMENTS + 1)
    arc = np.deg2rad(half_angle_deg) * along
    path = bend * np.stack([np.sin(arc), -np.cos(arc), np.zeros_like(arc)], axis=1)
    taper = radius * (1 - along**4) ** 0.75
    angle = 2 * np.pi * np.arange(SEGMENTS // 2) / (SEGMENTS // 2)
    rings = around(path, taper, [0, 0, 1], angle)
    return loft(path[0], rings[1:-1], path[-1])


def mug(radius: float, height: float, wall: float, reach: float) -> Mesh:
    """A cup and its handle, a bow in the plane y = 0: a tube that joins the rims of two holes in the wall."""
    points, rows, hole = 96, 32, 4  # grid of the outer wall; a hole is a square of 4 x 4 of its cells
    outer = [(radius, z) for z in np.linspace(0, height, rows)]
    cup = lathe([(0, 0), *outer, (radius - wall, height), (radius - wall, wall), (0, wall)], points)
    grid = np.roll(np.arange(rows * points).reshape(rows, points), hole // 2, axis=1)[:, : hole + 1]
    low, high = grid[rows // 5 :][: hole + 1], grid[::-1][rows // 5 :][: hole + 1]  # mirror images in height
    row = np.r_[[0] * hole, 0:hole, [hole] * hole, hole:0:-1]  # around a hole; the column is a quarter ahead
    low_rim, high_rim = low[row, np.roll(row, -hole)], high[row, np.roll(row, -hole)]

    centre = cup.vertices[low].mean(axis=(0, 1))
    _, across, up = (cup.vertices[low_rim] - centre).T
    bow = np.linspace(-np.pi / 2, np.pi / 2, points // 3)
    drop = height / 2 - centre[2]
    path = np.stack([radius + reach * np.cos(bow), 0 * bow, height / 2 + drop * np.sin(bow)], axis=1)
    rings = around(path, across.max(), [0, -1, 0], np.arctan2(-across, up))[1:-1]
    loops = len(cup.vertices) + np.arange(rings[..., 0].size).reshape(rings.shape[:2])

    tube = [bridge(first, second) for first, second in pairwise([low_rim, *loops, high_rim])]
    wall_faces = ~(np.isin(cup.faces, low).all(axis=1) | np.isin(cup.faces, high).all(axis=1))
    used, faces = np.unique(np.concatenate([cup.faces[wall_faces], *tube]), return_inverse=True)
    return Mesh(np.concatenate([cup.vertices, rings.reshape(-1, 3)])[used], faces.reshape(-1, 3))
