"""The camera of a view, and the places of its labels.

A camera is a matrix with three rows: right, up and towards the viewer. It looks at the centre of a ball around hand and
object, from a distance at which the ball fills `FILL` of the view. The rows of labels below the ball are in view too.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.show.scene_parts import HAND, SURFACE, TABLE, Scene, Shape

AZIMUTH, ELEVATION = -55.0, 22.0
"""Azimuth and elevation of the first view [deg]: from the front at an angle, and from above."""
FIELD = 45.0
"""Vertical field of view [deg], which is fixed in Plotly."""
FILL = 0.85
"""Share of the view's shorter side that the ball around hand and object fills."""
ROWS, GAP, ROW = 2, 0.07, 0.065
"""Number of rows of labels; distance of the first row below hand and object, and between rows, over their height."""


def axes_of_view(azimuth: float = AZIMUTH, elevation: float = ELEVATION) -> Array:
    """Rows right, up and towards the viewer (3, 3) of a camera at these angles [deg]."""
    a, e = np.radians(azimuth), np.radians(elevation)
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def placed(scene: Scene, rank: int, stage: int) -> list[Shape]:
    """The shapes of a grasp at a stage, in the world frame."""
    view = scene.views[rank]
    at = view.stages[stage]
    shapes = [_moved(link, T[:3, :3], T[:3, 3]) for link, T in zip(scene.links, view.links, strict=True)]
    for shape in (*scene.shapes, *view.shapes, *at.shapes):
        shapes.append(_moved(shape, at.rotation, at.translation) if shape.moves else shape)
    return shapes


def _moved(shape: Shape, rotation: Array, translation: Array) -> Shape:
    return replace(shape, vertices=shape.vertices @ rotation.T + translation)


def seen(shapes: Iterable[Shape]) -> Array:
    """The vertices (N, 3) of hand and object, without the table; of all shapes if there is neither."""
    shapes = list(shapes)
    chosen = [s.vertices for s in shapes if s.layer in (HAND, SURFACE)] or [
        s.vertices for s in shapes if s.layer != TABLE
    ]
    return np.concatenate(chosen)


def ball(points: Array) -> tuple[Array, float]:
    """Centre (3,) and radius [m] of a ball around points (N, 3); the centre is the middle of their bounding box."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def beside(shown: Array, places: Array) -> Array:
    """Where labels of places (m, 2) stand: in rows below everything shown (N, 2), from left to right as their places.

    Returns the middle (m, 2) of the upper edge of each label.
    """
    low, high = shown.min(axis=0), shown.max(axis=0)
    count, height = len(places), float((high - low).max())
    found = np.zeros((count, 2))
    for column, i in enumerate(np.argsort(places[:, 0], kind="stable")):
        found[i, 0] = low[0] + (column + 0.5) / count * (high[0] - low[0])
        found[i, 1] = low[1] - height * (GAP + ROW * (column % ROWS))
    return found
