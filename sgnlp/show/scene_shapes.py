"""The shapes of a view: surface, table, contacts, cones, springs, collision spheres, axes."""

import numpy as np

from sgnlp.base import palette
from sgnlp.base.arrays import Array
from sgnlp.base.palette import Colour
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames
from sgnlp.perception.synthetic import meshes
from sgnlp.show.scene_parts import AXES, AXIS, CONES, SPHERES, SURFACE, TABLE, Label, Shape
from sgnlp.surface.gpis import Gpis
from sgnlp.surface.level_set import chunked, level_set

SURFACE_OPACITY = 0.45
"""Opacity of the surface, so that springs and targets behind it are visible."""
MARGIN = 0.015
"""Margin around the points within which the surface is drawn [m]."""
SHOWN_SHARE = 0.95
"""Share of the deviations that the colour scale spans: where the gradient vanishes, σ/|∇μ| is unbounded."""
TABLE_HALF, TABLE_CELLS = 0.18, 18
"""Half the edge of the drawn table [m], and its squares along an edge."""
ARROW = 0.03
"""Length of a normal and cone [m]."""
COIL_TURNS, COIL_POINTS, COIL_RADIUS = 9, 12, 0.004
"""Turns of a spring, points of a turn, radius [m]."""
AXIS_WIDTH, AXIS_GAP, AXIS_LIFT = 4.0, 0.008, 0.002
"""Width of an axis [pixel], distance of its letter beyond its end, and its height above the table [m]."""
SOLIDS = {
    "ball": meshes.unit_sphere(80),
    "cube": meshes.box([1.6, 1.6, 1.6]),
    "diamond": meshes.hull(1.4 * np.vstack([np.eye(3), -np.eye(3)])),
}
"""Solids of about the size of the unit ball, with different outlines."""


def surface(gpis: Gpis, box: Array) -> Shape:
    """The posterior's zero level set around a box (2, 3) [m], with the deviation σ/|∇μ| [mm] of its vertices."""
    vertices, faces = level_set(gpis.mean, box[0] - MARGIN, box[1] + MARGIN)
    deviation = 1e3 * chunked(gpis.distance_deviation, vertices)
    return Shape(
        SURFACE,
        vertices,
        faces,
        palette.SKY,
        opacity=SURFACE_OPACITY,
        values=np.minimum(deviation, np.quantile(deviation, SHOWN_SHARE)),
        moves=True,
    )


def table(middle: Array, height: float) -> Shape:
    """A square of the table's plane below a point (3,) [m]."""
    line = np.linspace(-TABLE_HALF, TABLE_HALF, TABLE_CELLS + 1)
    x, y = np.meshgrid(line + middle[0], line + middle[1], indexing="ij")
    vertices = np.stack([x, y, np.full_like(x, height)], axis=-1).reshape(-1, 3)
    n = TABLE_CELLS + 1
    corner = (np.arange(TABLE_CELLS)[:, None] * n + np.arange(TABLE_CELLS)).reshape(-1, 1)
    faces = np.concatenate([corner + np.array(square) for square in ([0, n, n + 1], [0, n + 1, 1])])
    return Shape(TABLE, vertices, faces, palette.PALE)


def coil(start: Array, end: Array) -> Array:
    """A helix (P, 3) from one point (3,) to another [m]."""
    s = np.linspace(0, 1, COIL_TURNS * COIL_POINTS + 1)[:, None]
    angle = 2 * np.pi * COIL_TURNS * s
    across, up = _across(end - start)
    radius = COIL_RADIUS * np.minimum(1, 10 * np.minimum(s, 1 - s))
    return start + s * (end - start) + radius * (np.cos(angle) * across + np.sin(angle) * up)


def cone(apex: Array, normal: Array, friction: float, colour: Colour) -> Shape:
    """The cone of forces on the object at a contact, drawn outside the object; its half angle is atan μ."""
    across, up = _across(normal)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)[:, None]
    rim = apex + ARROW * (normal + friction * (np.cos(angle) * across + np.sin(angle) * up)) / np.hypot(1, friction)
    i = np.arange(24)
    faces = np.stack([np.zeros(24, int), 1 + i, 1 + (i + 1) % 24], axis=1)
    return Shape(CONES, np.vstack([apex, rim]), faces, colour, opacity=0.3, moves=True)


def spheres(hand: Hand, wrist: Array, joints: Array, opacity: float = 0.35) -> list[Shape]:
    """The collision spheres at a pose of the hand."""
    centres = frames(hand, wrist, joints)[1]
    pairs = zip(centres, hand.spheres, strict=True)
    return [solid(SPHERES, centre, sphere.radius, palette.STONE, opacity=opacity) for centre, sphere in pairs]


def _across(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors perpendicular to a direction (3,) and to each other."""
    axis = direction / max(float(np.linalg.norm(direction)), np.finfo(float).tiny)
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def segments(layer: str, path: Array, colour: Colour, width: float, moves: bool = False) -> Shape:
    """A path (P, 3) [m] as segments."""
    i = np.arange(len(path) - 1)
    return Shape(layer, path, np.stack([i, i + 1], axis=1), colour, width=width, moves=moves)


def solid(
    layer: str,
    centre: Array,
    radius: float,
    colour: Colour,
    kind: str = "ball",
    opacity: float = 1.0,
    moves: bool = False,
) -> Shape:
    """One of `SOLIDS` about a centre (3,) [m]."""
    body = SOLIDS[kind]
    return Shape(layer, centre + radius * body.vertices, body.faces, colour, opacity=opacity, moves=moves)


def axes(points: Array, middle: Array, height: float) -> tuple[list[Shape], list[Label]]:
    """The world's directions on the table below `middle` (3,), beside points (N, 3) [m], and their letters."""
    beside = points.min(axis=0)[:2] - AXIS
    corner = np.array([*np.maximum(beside, middle[:2] - TABLE_HALF + AXIS_GAP), height + AXIS_LIFT])
    ends = corner + AXIS * np.eye(3)
    lines = [segments(AXES, np.stack([corner, end]), palette.INK, AXIS_WIDTH) for end in ends]
    places = (ends + AXIS_GAP * np.eye(3)).tolist()
    letters = [Label(name, tuple(place), here=True) for name, place in zip("xyz", places, strict=True)]
    return lines, letters
