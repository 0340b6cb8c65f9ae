"""The surroundings of the object as shapes of a view: obstacles, regions to avoid and regions to touch."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from sgnlp.base import palette
from sgnlp.base.arrays import Array, IntArray
from sgnlp.base.palette import Colour
from sgnlp.perception import shape as solids
from sgnlp.perception.synthetic import meshes
from sgnlp.planning.surroundings import Surroundings
from sgnlp.show.scene_parts import AVOID, OBSTACLES, TOUCH, Shape
from sgnlp.show.scene_shapes import TABLE_HALF

SIDES, BALL_POINTS = 32, 200
"""Sides of a cylinder and vertices of a ball, as drawn."""
BOUNDLESS = 1.0
"""A box with at least this half extent [m] is drawn as the part of its face that is near the object."""


class _Look(NamedTuple):
    layer: str
    colour: Colour
    opacity: float


LOOKS: Mapping[str, _Look] = {
    "obstacles": _Look(OBSTACLES, palette.STONE, 0.4),
    "avoid": _Look(AVOID, palette.RED, 0.25),
    "touch": _Look(TOUCH, palette.GREEN, 0.25),
}


def around(surroundings: Surroundings, middle: Array) -> Iterator[Shape]:
    """The shapes of the surroundings of an object at `middle` (3,) [m]."""
    for kind, found in surroundings.kinds():
        layer, colour, opacity = LOOKS[kind]
        for each in found:
            vertices, faces = _mesh(each, middle)
            yield Shape(layer, each.centre + vertices @ each.rotation.T, faces, colour, opacity=opacity)


def _mesh(of: solids.Shape, middle: Array) -> tuple[Array, IntArray]:
    """Vertices (U, 3) in the solid's own frame, and faces; edges that its radius rounds are drawn sharp."""
    half = of.half + of.radius
    if of.circular:
        made = meshes.cylinder(half[0], 2 * half[2], SIDES)
    elif not of.half.any():
        ball = meshes.unit_sphere(BALL_POINTS)
        return of.radius * ball.vertices, ball.faces
    elif half.max() >= BOUNDLESS:
        return _face(half, of.local(middle[None])[0])
    else:
        made = meshes.box(2 * half)
    return made.vertices, made.faces


def _face(half: Array, middle: Array) -> tuple[Array, IntArray]:
    """A part of the box's face that is nearest to a point (3,) outside it, in the box's frame."""
    axis = int(np.argmax(np.abs(middle) - half))
    sizes, centre = np.minimum(half, TABLE_HALF), np.clip(middle, TABLE_HALF - half, half - TABLE_HALF)
    centre = np.where(half > TABLE_HALF, centre, 0.0)
    centre[axis], sizes[axis] = np.copysign(half[axis], middle[axis]), 0.0
    across, along = np.delete(np.eye(3), axis, axis=0) * sizes
    corners = np.array([-across - along, across - along, across + along, along - across])
    return centre + corners, np.array([[0, 1, 2], [0, 2, 3]])
