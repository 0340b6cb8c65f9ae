"""The parts of a view, for any drawing backend: shapes, labels, stages, and the legend of their symbols."""

from collections.abc import Sequence
from dataclasses import dataclass

from sgnlp.base import palette
from sgnlp.base.arrays import Array, IntArray
from sgnlp.base.palette import Colour
from sgnlp.show.sheets import Sheet

HAND, SURFACE, CLOUD, TABLE, AXES, FRAMES = "hand", "surface", "cloud", "table", "axes", "frame axes"
CONTACTS, NORMALS, CONES, SPRINGS, SPHERES = "contacts", "normals", "friction cones", "springs", "collision spheres"
OBJECT, FORCES, STARTS = "object", "forces", "wrist starts"
ARM, OBSTACLES, AVOID, TOUCH = "arm", "obstacles", "regions to avoid", "regions to touch"
LAYERS = (
    *(HAND, SURFACE, OBJECT, CLOUD, CONTACTS, NORMALS, CONES, SPRINGS, FORCES, SPHERES, FRAMES, STARTS),
    *(ARM, OBSTACLES, AVOID, TOUCH, TABLE, AXES),
)
"""Layers, which can be switched on and off."""
AXIS = 0.05
"""Length of the drawn axes [m]."""
NEWTON = 0.008
"""Drawn length of a force for each newton [m/N]."""


@dataclass(frozen=True)
class Entry:
    """A line of the legend: a glyph in a colour, and its meaning; a `graded` one is coloured by its values."""

    layer: str
    glyph: str
    colour: Colour
    text: str
    graded: bool = False


BALL, CUBE, DIAMOND, PATCH, LINE, FAN, COIL, POINT = "●■◆▬━▲≈·"
LEGEND = (
    Entry(HAND, PATCH, palette.STONE, "hand, its pads in the fingers' colours"),
    Entry(CLOUD, POINT, palette.INK, "measured points"),
    Entry(SURFACE, PATCH, palette.SKY, "fitted surface, coloured by its deviation ± σ [mm]", graded=True),
    Entry(OBJECT, PATCH, palette.SKY, "object"),
    Entry(CONTACTS, BALL, palette.GREY, "contact on the surface"),
    Entry(NORMALS, LINE, palette.GREY, "outward normal at the contact"),
    Entry(CONES, FAN, palette.GREY, "friction cone of the force on the object"),
    Entry(SPRINGS, COIL, palette.GREY, "spring, from the pad's centre to its target"),
    Entry(SPRINGS, DIAMOND, palette.GREY, "pad's centre at the stage that is shown"),
    Entry(SPRINGS, CUBE, palette.GREY, "target of the spring"),
    Entry(FORCES, LINE, palette.GREY, f"force on the object, {1e3 * NEWTON:g} mm for each newton"),
    Entry(SPHERES, BALL, palette.STONE, "collision sphere"),
    *(Entry(FRAMES, LINE, colour, f"{axis} of the root link and of the tips") for axis, colour in palette.AXES.items()),
    Entry(STARTS, LINE, palette.INK, "top of the object at a wrist start, and the way up"),
    Entry(ARM, PATCH, palette.STONE, "arm"),
    Entry(OBSTACLES, PATCH, palette.STONE, "obstacle"),
    Entry(AVOID, PATCH, palette.RED, "region that fingers stay off"),
    Entry(TOUCH, PATCH, palette.GREEN, "region that fingers touch"),
    Entry(TABLE, PATCH, palette.PALE, "table"),
    Entry(AXES, LINE, palette.INK, f"directions of the world frame, {100 * AXIS:.0f} cm long"),
)
"""Every symbol that a view may have; a grey one here is drawn in the colour of its finger."""


@dataclass(frozen=True, eq=False)
class Shape:
    """Vertices, and cells that join them: triangles (F, 3), segments (E, 2) or points (P, 1).

    `values` (U,) [mm] of the vertices give their colours.
    """

    layer: str
    vertices: Array  # (U, 3) [m]
    cells: IntArray
    colour: Colour
    opacity: float = 1.0
    width: float = 2.0  # of a segment or point [pixel]
    values: Array | None = None
    moves: bool = False  # with the object


@dataclass(frozen=True)
class Label:
    """A text for a place (3,) [m]. It is drawn away from all geometry, with a line to its place."""

    text: str
    place: tuple[float, ...]
    colour: Colour = palette.INK
    here: bool = False
    """Whether the text is at the place itself."""


def named(texts: Sequence[str], places: Array) -> list[Label]:
    """A label for each finger, at places (m, 3) [m], in its colour."""
    pairs = zip(texts, places.tolist(), strict=True)
    return [Label(text, tuple(place), palette.finger(i)) for i, (text, place) in enumerate(pairs)]


@dataclass(frozen=True, eq=False)
class Stage:
    """A state of the grasping motion: a point x of the object is at R x + t."""

    name: str
    rotation: Array  # (3, 3)
    translation: Array  # (3,) [m]
    shapes: tuple[Shape, ...]


@dataclass(frozen=True, eq=False)
class Frame:
    """A moment of the whole motion [s]: poses (L, 4, 4) of the hand's links, and the pose of the object."""

    time: float
    links: Array
    stage: Stage


@dataclass(frozen=True, eq=False)
class View:
    """One grasp: poses (L, 4, 4) of the hand's links, its own shapes, its stages, numbers and motion."""

    title: str
    links: Array
    shapes: tuple[Shape, ...]
    stages: tuple[Stage, ...]
    labels: tuple[Label, ...]
    sheets: tuple[Sheet, ...]
    frames: tuple[Frame, ...] = ()


@dataclass(frozen=True, eq=False)
class Scene:
    """A whole scene: links in their own frames, the shapes that all grasps share, and the grasps, best first."""

    name: str
    links: tuple[Shape, ...]
    shapes: tuple[Shape, ...]
    views: tuple[View, ...]
    notes: tuple[str, ...]
    hidden: tuple[str, ...] = (SPHERES,)
    """Layers that are off at first, and in no picture."""
    kind: str = "Grasp"
    """What a view shows."""
    fingers: tuple[str, ...] = ()
    """Names of the fingers, for the legend of their colours."""

    @property
    def layers(self) -> tuple[str, ...]:
        """The layers that have a shape in any view, in the order of `LAYERS`."""
        own = [view.shapes + sum((stage.shapes for stage in view.stages), ()) for view in self.views]
        found = {shape.layer for shapes in (self.links, self.shapes, *own) for shape in shapes}
        return tuple(layer for layer in LAYERS if layer in found)

    @property
    def legend(self) -> tuple[Entry, ...]:
        """The lines of the legend that the scene has symbols of."""
        return tuple(entry for entry in LEGEND if entry.layer in self.layers)
