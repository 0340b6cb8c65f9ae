"""A scene as a picture: triangles, segments and points in one list, painted from back to front by Matplotlib.

It needs neither screen nor OpenGL, and the same scene gives the same picture.
"""

import io
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.errors import InputError
from sgnlp.scene3d import TABLE, Colour, Label, Scene, Shape

Array = NDArray[np.float64]

AZIMUTHS, ELEVATION = (-55.0, 35.0, 125.0), 20.0
"""Three cameras side by side, all from this far above [deg]."""
SIZE, DPI = 5.0, 130
"""Of a view [inch], and dots per inch."""
ROOM, SIDES = 0.08, np.array([-1.0, 1.0])
"""Room around what is shown, over its size."""
NAME_HEIGHTS = (0.96, 0.91)
"""Of labels beside each other, over the height of a view."""
LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
AMBIENT = 0.45
DOT = 6e-4
"""Half the side of a point [m]; a segment is this wide for each pixel of its width over 4."""


def picture(
    scene: Scene, rank: int = 0, stage: int = 1, legend: Sequence[tuple[str, Colour]] = (), titled: bool = False
) -> bytes:
    """A PNG of a grasp at one of its stages, from three sides; `titled` names them, `legend` says what colours mean.

    Raises:
        InputError: Matplotlib is not installed.
    """
    try:
        from matplotlib import colormaps
        from matplotlib.collections import PolyCollection
        from matplotlib.colors import Normalize
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError("pictures need Matplotlib: pip install 'sgnlp[view]'") from None
    shapes = [shape for shape in placed(scene, rank, stage) if shape.layer not in scene.hidden]
    values = [shape.values for shape in shapes if shape.values is not None]
    scale = Normalize(*(np.concatenate(values).min(), np.concatenate(values).max()) if values else (0, 1))
    figure = Figure(figsize=(SIZE * len(AZIMUTHS), SIZE), layout="constrained")
    axes = figure.subplots(1, len(AZIMUTHS))
    for ax, azimuth in zip(axes, AZIMUTHS, strict=True):
        camera = axes_of_view(azimuth, ELEVATION)
        drawn = [_polygons(shape, camera, lambda v: colormaps["viridis"](scale(v))) for shape in shapes]
        polygons, depth, colours = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
        order = np.argsort(depth)
        ax.add_collection(PolyCollection(polygons[order], facecolors=colours[order], linewidths=0))
        _fit(ax, np.concatenate([p for shape, (p, _, _) in zip(shapes, drawn, strict=True) if shape.layer != TABLE]))
        _name(ax, scene.views[rank].labels, camera)
        if titled:
            ax.set_title(f"from {azimuth:g}°, {ELEVATION:g}° above", fontsize=8)
    if legend:
        from matplotlib.lines import Line2D

        lines = [Line2D([], [], color=colour, linewidth=2, label=text) for text, colour in legend]
        figure.legend(handles=lines, loc="outside lower center", ncols=len(lines), fontsize=8, frameon=False)
    view = scene.views[rank]
    figure.suptitle(f"{scene.name}, {scene.kind.lower()} {view.title}, {view.stages[stage].name}", fontsize=10)
    if values:
        from matplotlib.cm import ScalarMappable

        figure.colorbar(ScalarMappable(scale, "viridis"), ax=axes, label="± σ of the surface [mm]", shrink=0.6)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=DPI)
    return file.getvalue()


def _fit(ax: Any, polygons: Array) -> None:
    """The square that holds polygons (F, 4, 2); what reaches beyond it, the table, is cut off."""
    low, high = polygons.min(axis=(0, 1)), polygons.max(axis=(0, 1))
    middle, half = (low + high) / 2, (0.5 + ROOM) * (high - low).max()
    ax.set(xlim=middle[0] + half * SIDES, ylim=middle[1] + half * SIDES, aspect="equal")
    ax.set_axis_off()


def _name(ax: Any, labels: Sequence[Label], camera: Array) -> None:
    """The labels along the upper edge, from left to right as their places are, each with a line to its place."""
    places = np.reshape([label.place for label in labels], (-1, 3)) @ camera[:2].T  # (m, 2)
    for column, i in enumerate(np.argsort(places[:, 0])):
        at = ((column + 0.5) / len(labels), NAME_HEIGHTS[column % 2])
        line = {"arrowstyle": "-", "linewidth": 0.5}
        look = {"textcoords": "axes fraction", "ha": "center", "fontsize": 8, "arrowprops": line}
        ax.annotate(labels[i].text, places[i], at, **look)


def placed(scene: Scene, rank: int, stage: int) -> list[Shape]:
    """The shapes of a grasp's stage in the world."""
    view = scene.views[rank]
    at = view.stages[stage]
    shapes = [_moved(link, T[:3, :3], T[:3, 3]) for link, T in zip(scene.links, view.links, strict=True)]
    for shape in (*scene.shapes, *view.shapes, *at.shapes):
        shapes.append(_moved(shape, at.rotation, at.translation) if shape.moves else shape)
    return shapes


def _moved(shape: Shape, rotation: Array, translation: Array) -> Shape:
    return replace(shape, vertices=shape.vertices @ rotation.T + translation)


def axes_of_view(azimuth: float, elevation: float) -> Array:
    """Rows right, up and towards the viewer (3, 3) of a camera at these angles [deg]."""
    a, e = np.radians(azimuth), np.radians(elevation)
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def _polygons(shape: Shape, camera: Array, colours: Any) -> tuple[Array, Array, Array]:
    """The cells as quadrangles (F, 4, 2) on the picture's plane, their depth towards the viewer (F,), colours (F, 4).

    A triangle has its last corner twice: polygons of one size are drawn in a third of the time.
    """
    seen = shape.vertices @ camera.T  # (U, 3)
    corners = seen[shape.cells]  # (F, k, 3)
    depth = corners[:, :, 2].mean(axis=1)
    rgba = np.tile([*shape.colour, shape.opacity], (len(corners), 1))
    if shape.values is not None:
        rgba[:, :3] = colours(shape.values[shape.cells].mean(axis=1))[:, :3]
    plane = corners[:, :, :2]
    if plane.shape[1] == 3:
        normal = np.cross(*np.moveaxis(shape.vertices[shape.cells][:, 1:] - shape.vertices[shape.cells][:, :1], 1, 0))
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
        rgba[:, :3] *= AMBIENT + (1 - AMBIENT) * np.abs(normal @ LIGHT)[:, None]
        return plane[:, [0, 1, 2, 2]], depth, rgba
    half = DOT * shape.width / (2 if plane.shape[1] == 1 else 4)
    if plane.shape[1] == 1:
        square = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        return plane + square, depth, rgba
    along = plane[:, 1] - plane[:, 0]
    side = np.stack([-along[:, 1], along[:, 0]], axis=1)
    side *= half / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), np.finfo(float).tiny)
    outline = [plane[:, 0] - side, plane[:, 1] - side, plane[:, 1] + side, plane[:, 0] + side]
    return np.stack(outline, axis=1), depth, rgba
