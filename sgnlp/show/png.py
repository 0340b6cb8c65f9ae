"""A scene as pictures: triangles, segments and points in one list, painted from back to front by Matplotlib.

It needs neither screen nor OpenGL, and the same scene gives the same picture. Three cells are views from three sides,
the fourth is the legend. A narrow page puts them below each other.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base import palette
from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.show.camera import AZIMUTH, GAP, ROW, ROWS, axes_of_view, beside, placed
from sgnlp.show.scene_parts import (
    ARM,
    BALL,
    CLOUD,
    COIL,
    CUBE,
    DIAMOND,
    FAN,
    LINE,
    OBSTACLES,
    PATCH,
    POINT,
    TABLE,
    Entry,
    Label,
    Scene,
    Shape,
)

AZIMUTHS, ELEVATION = (AZIMUTH, AZIMUTH + 90, AZIMUTH + 180), 20.0
"""Azimuths of three cameras, and the elevation of all [deg]."""
SIZE, DPI, FONT = 4.6, 130, 9.5
"""Size of a cell [inch], dots per inch, and size of the letters [point]."""
ROOM = 0.04
"""Margin around what is shown, over its size."""
LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
AMBIENT = 0.6
DOT = 4e-4
"""Half the side of a point [m]; a segment is a quarter of this wide for each pixel of its width."""
FAINT = 0.25
"""Opacity of the cloud's points, so that the surface under them is visible."""
MERGED = 0.002
"""A mesh is drawn with its vertices merged in cells of this edge [m], three pixels of a hand, if half a cell is larger
than its mean triangle."""
MAP = "viridis"
"""Colour map of the deviation; its order is clear to colour-blind readers too."""
WIDE = (TABLE, OBSTACLES, ARM)
"""Layers that may extend beyond the picture."""
MARKERS = {BALL: "o", CUBE: "s", DIAMOND: "D", FAN: "^", POINT: "."}
"""Matplotlib's markers for the glyphs of the legend that are one point."""


@dataclass(frozen=True)
class Picture:
    """PNG cells of equal size, the views and then the legend, with a text that says what they show."""

    title: str
    cells: tuple[bytes, ...]


def drawable(*others: str) -> None:
    """Raise `InputError` unless Matplotlib and the `others` are installed; called before any work."""
    missing = [name for name in ("matplotlib", *others) if find_spec(name) is None]
    if missing:
        raise InputError(f"pictures need {' and '.join(missing)}: pip install 'sgnlp[view]'")


def picture(scene: Scene, rank: int = 0, stage: int = 1) -> bytes:
    """A PNG of a grasp at one of its stages, from three sides, with the legend; see `cells`."""
    return joined(cells(scene, rank, stage))


def cells(scene: Scene, rank: int = 0, stage: int = 1) -> Picture:
    """A grasp at one of its stages, from three sides, and the legend; raises as `drawable`."""
    drawable()
    from matplotlib import colormaps, rc_context
    from matplotlib.colors import Normalize

    view = scene.views[rank]
    shapes = [_merged(shape) for shape in placed(scene, rank, stage) if shape.layer not in scene.hidden]
    values = [shape.values for shape in shapes if shape.values is not None]
    scale = Normalize(*(np.concatenate(values).min(), np.concatenate(values).max()) if values else (0, 1))
    with rc_context({"font.size": FONT}):
        made = [_view(shapes, view.labels, azimuth, lambda v: colormaps[MAP](scale(v))) for azimuth in AZIMUTHS]
        made.append(_legend(scene, scale if values else None))
    return Picture(f"{scene.name}, {scene.kind.lower()} {view.title}, {view.stages[stage].name}", tuple(made))


def joined(shown: Picture) -> bytes:
    """The cells of a picture in two columns below its title, as one PNG."""
    from matplotlib.figure import Figure

    images = [_decoded(cell) for cell in shown.cells]
    rows = [np.hstack(images[i : i + 2]) for i in range(0, len(images), 2)]
    width = rows[0].shape[1] / DPI
    strip = Figure(figsize=(width, 0.4), facecolor="white")
    strip.text(0.5, 0.5, shown.title, ha="center", va="center", fontsize=FONT + 2)
    return _encoded(np.vstack([_decoded(_png(strip)), *rows]))


def _decoded(png: bytes) -> NDArray[np.uint8]:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def _encoded(pixels: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", optimize=True)
    return file.getvalue()


def _normals(shape: Shape) -> Array:
    """Normals of triangles (F, 3), twice their areas long."""
    corners = shape.vertices[shape.cells]  # (F, 3, 3)
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _merged(shape: Shape) -> Shape:
    """A mesh without the triangles that are too small to see: drawing a million takes a minute."""
    if (
        shape.values is not None
        or shape.cells.shape[1] < 3
        or np.linalg.norm(_normals(shape), axis=1).mean() > MERGED**2
    ):
        return shape
    index = np.floor(shape.vertices / MERGED).astype(int)
    _, first, where = np.unique(index, axis=0, return_index=True, return_inverse=True)
    cells = where.ravel()[shape.cells]
    cells = np.unique(np.sort(cells[(cells != np.roll(cells, 1, axis=1)).all(axis=1)], axis=1), axis=0)
    return replace(shape, vertices=shape.vertices[first], cells=cells)


def _png(figure: Any) -> bytes:
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=DPI)
    return file.getvalue()


def _view(shapes: Sequence[Shape], labels: Sequence[Label], azimuth: float, colours: Any) -> bytes:
    """One view, with its title."""
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    camera = axes_of_view(azimuth, ELEVATION)
    figure = Figure(figsize=(SIZE, SIZE), layout="constrained")
    ax = figure.subplots()
    drawn = [_polygons(shape, camera, colours) for shape in shapes]
    polygons, depth, faces = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
    order = np.argsort(depth, kind="stable")  # the table, seen from above, is behind everything
    edges = faces[order].copy()
    edges[edges[:, 3] < 1] = 0.0  # seams show between opaque triangles alone
    drawn_in_order = PolyCollection(polygons[order], facecolors=faces[order], edgecolors=edges, linewidths=0.3)
    ax.add_collection(drawn_in_order, autolim=False)
    plane = np.concatenate([p for shape, (p, _, _) in zip(shapes, drawn, strict=True) if shape.layer not in WIDE])
    _fit(ax, plane)
    _name(ax, labels, plane.reshape(-1, 2), camera)
    ax.set_title(f"from azimuth {azimuth:.0f}°, {ELEVATION:.0f}° above", fontsize=FONT)
    return _png(figure)


def _fit(ax: Any, polygons: Array) -> None:
    """Set the axes to a square around polygons (F, 4, 2) and the labels below; layers of `WIDE` may be cut off."""
    low, high = polygons.min(axis=(0, 1)), polygons.max(axis=(0, 1))
    size = float((high - low).max())
    low = low - np.array([0.0, (GAP + ROW * ROWS) * size])
    middle, half = (low + high) / 2, (0.5 + ROOM) * float((high - low).max())
    ax.set(xlim=middle[0] + half * np.array([-1, 1]), ylim=middle[1] + half * np.array([-1, 1]), aspect="equal")
    ax.set_axis_off()


def _name(ax: Any, labels: Sequence[Label], shown: Array, camera: Array) -> None:
    """Draw the labels: below everything shown (N, 2) with a line to their place, or at the place itself."""
    places = np.reshape([label.place for label in labels], (-1, 3)) @ camera[:2].T  # (m, 2)
    away = [i for i, label in enumerate(labels) if not label.here]
    for i, at in zip(away, beside(shown, places[away]), strict=True):
        colour = labels[i].colour
        line = {"arrowstyle": "-", "linewidth": 1.0, "color": colour, "shrinkA": 0, "shrinkB": 0}
        box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": colour, "linewidth": 1.0}
        look = {"ha": "center", "va": "top", "arrowprops": line, "bbox": box}
        ax.annotate(labels[i].text, places[i], at, **look)
    for i, label in enumerate(labels):
        if label.here:
            ax.text(*places[i], label.text, ha="center", va="center", color=label.colour)


def _legend(scene: Scene, scale: Any) -> bytes:
    """Every symbol with its meaning, the fingers' colours, and the scale of the deviation."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    figure = Figure(figsize=(SIZE, SIZE))
    fingers = [Entry("", PATCH, palette.finger(i), name) for i, name in enumerate(scene.fingers)]
    entries = [entry for entry in scene.legend if entry.layer not in scene.hidden]
    handles = [_handle(entry, Line2D) for entry in (*fingers, *entries)]
    figure.legend(
        handles=handles, loc="upper left", frameon=False, title="Colour of a finger, and symbols", alignment="left"
    )
    if scale is not None:
        bar = figure.add_axes((0.08, 0.13, 0.84, 0.035))
        label = "± σ of the fitted surface [mm]"
        figure.colorbar(ScalarMappable(scale, MAP), cax=bar, orientation="horizontal", label=label)
    return _png(figure)


def _handle(entry: Entry, kind: Any) -> Any:
    """A line of Matplotlib's legend."""
    look: dict[str, Any] = {"color": entry.colour, "label": entry.text}
    if entry.glyph in MARKERS:
        return kind([], [], linestyle="", marker=MARKERS[entry.glyph], markersize=7, **look)
    if entry.glyph == COIL:
        return kind([], [], linestyle=":", linewidth=3, **look)
    return kind([], [], linewidth=3 if entry.glyph == LINE else 8, solid_capstyle="butt", **look)


def _polygons(shape: Shape, camera: Array, colours: Any) -> tuple[Array, Array, Array]:
    """The cells as quadrangles (F, 4, 2) on the picture's plane, their depth towards the viewer (F,), colours (F, 4).

    A triangle has its last corner twice: polygons of one size are drawn in a third of the time.
    """
    seen = shape.vertices @ camera.T  # (U, 3)
    corners = seen[shape.cells]  # (F, k, 3)
    depth = corners[:, :, 2].mean(axis=1) if shape.layer != TABLE else np.full(len(corners), -np.inf)
    rgba = np.tile([*shape.colour, FAINT if shape.layer == CLOUD else shape.opacity], (len(corners), 1))
    if shape.values is not None:
        rgba[:, :3] = colours(shape.values[shape.cells].mean(axis=1))[:, :3]
    plane = corners[:, :, :2]
    if plane.shape[1] == 3:
        normal = _normals(shape)
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
