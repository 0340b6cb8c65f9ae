"""What a view of planned grasps shows, as vertices, simplices and numbers, for any backend that draws them.

The object's motion has stages: the pregrasp, the first contact, and steps to the equilibrium. With p̄ the middle of the
contacts, it turns by exp(s log R) about p̄ while p̄ moves by s (R p̄ + t - p̄), s from 0 to 1. The hand stays at the
pregrasp.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sgnlp.errors import InputError
from sgnlp.gpis import Gpis
from sgnlp.grasps import Grasps
from sgnlp.hand import Hand
from sgnlp.handmeshes import link_meshes, link_poses
from sgnlp.kinematics import frames
from sgnlp.meshes import unit_sphere
from sgnlp.problem import Problem

Array = NDArray[np.float64]
Colour = tuple[float, float, float]

HAND, SURFACE, CLOUD, TABLE = "hand", "surface", "cloud", "table"
CONTACTS, NORMALS, CONES, SPRINGS, SPHERES = "contacts", "normals", "friction cones", "springs", "collision spheres"
FRAMES = "frame axes"
LAYERS = (HAND, SURFACE, CLOUD, CONTACTS, NORMALS, CONES, SPRINGS, SPHERES, FRAMES, TABLE)
"""What can be switched on and off."""
GREY, PALE, BLACK, GREEN = (0.35, 0.37, 0.4), (0.85, 0.83, 0.8), (0.1, 0.1, 0.1), (0.1, 0.55, 0.25)
ORANGE, PURPLE, BLUE = (0.95, 0.5, 0.05), (0.55, 0.2, 0.65), (0.2, 0.45, 0.85)
HAND_OPACITY = 0.6
"""The springs are seen through the hand."""
GRID, MARGIN = 40, 0.015
"""Cells along the longest side of the surface's grid, and what it reaches beyond the points [m]."""
SHOWN_SHARE = 0.95
"""Share of the deviations that the colours span: where the gradient vanishes, σ/|∇μ| has no bound."""
CHUNK = 2048
"""Query points of the surface at a time."""
TABLE_HALF, TABLE_CELLS = 0.18, 18
"""Half edge of the table that is drawn [m], and its squares along an edge."""
DOT, TARGET, ARROW = 0.003, 0.005, 0.03
"""Radius of a contact and of a target, length of a normal and cone [m]."""
COIL_TURNS, COIL_POINTS, COIL_RADIUS = 9, 12, 0.004
"""Turns of a spring, points of a turn, radius [m]."""
GAIN_WIDTH = 60.0
"""Gain of a spring that is drawn one pixel wide [N/m]."""
STEPS = 5
"""Stages from first contact to equilibrium."""
BALL = unit_sphere(80)


@dataclass(frozen=True, eq=False)
class Shape:
    """Vertices joined to triangles (F, 3), segments (E, 2) or points (P, 1); `values` (U,) [mm] are for colours."""

    layer: str
    vertices: Array  # (U, 3) [m]
    cells: NDArray[np.int64]
    colour: Colour
    opacity: float = 1.0
    width: float = 2.0  # of a segment or point [pixel]
    values: Array | None = None
    moves: bool = False  # with the object


@dataclass(frozen=True)
class Label:
    """A text at a place (3,) [m]."""

    text: str
    place: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Stage:
    """A state of the grasping motion: what moves with the object is at R x + t."""

    name: str
    rotation: Array  # (3, 3)
    translation: Array  # (3,) [m]
    shapes: tuple[Shape, ...]


@dataclass(frozen=True)
class Sheet:
    """A table of texts, its first row the heads."""

    title: str
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, eq=False)
class View:
    """One grasp: poses (L, 4, 4) of the hand's links, what belongs to it alone, its stages and its numbers."""

    title: str
    links: Array
    shapes: tuple[Shape, ...]
    stages: tuple[Stage, ...]
    labels: tuple[Label, ...]
    sheets: tuple[Sheet, ...]


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything to be seen: links in their own frames, what all grasps share, and the grasps, best first."""

    name: str
    links: tuple[Shape, ...]
    shapes: tuple[Shape, ...]
    views: tuple[View, ...]
    notes: tuple[str, ...]
    hidden: tuple[str, ...] = (SPHERES,)
    """Layers that are off at first, and in no picture."""
    kind: str = "Grasp"
    """What a view shows."""


def scene(grasps: Grasps, hand: Hand, problem: Problem | None, points: Array, notes: Sequence[str] = ()) -> Scene:
    """The scene of grasps; without the `problem`, whose surface it shows, and with no points, of the grasps alone.

    Raises:
        InputError: there is no grasp to be shown, or scikit-image, which finds the surface, is not installed.
    """
    if not len(grasps):
        raise InputError("the result has no grasps to show")
    meta = grasps.meta
    middle = grasps.contacts[0].mean(axis=0)
    shapes = [table(middle, float(meta["table_height"]))]
    if len(points):
        shapes.append(Shape(CLOUD, points, np.arange(len(points))[:, None], BLACK, width=1.0, moves=True))
    if problem is not None:
        shapes.append(surface(problem.gpis, problem.box))
    links = tuple(
        Shape(HAND, mesh.vertices, mesh.faces, colour, opacity=HAND_OPACITY)
        for mesh, colour in zip(*link_meshes(hand), strict=True)
    )
    views = tuple(view(grasps, rank, hand, problem) for rank in range(len(grasps)))
    return Scene(str(meta["object"]), links, tuple(shapes), views, tuple(notes))


def surface(gpis: Gpis, box: Array) -> Shape:
    """The posterior's zero level set around a box (2, 3) [m], with the deviation σ/|∇μ| [mm] of its vertices."""
    try:
        from skimage.measure import marching_cubes
    except ImportError:
        raise InputError("the surface is found by scikit-image: pip install 'sgnlp[view]'") from None
    low, high = box[0] - MARGIN, box[1] + MARGIN
    step = float((high - low).max()) / GRID
    axes = [np.arange(a, b + step, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    mean = _chunked(gpis.mean, grid.reshape(-1, 3)).reshape(grid.shape[:3])
    if not mean.min() < 0 < mean.max():
        raise InputError("the surface model has no surface near the points")
    vertices, faces, _, _ = marching_cubes(mean, 0.0, spacing=(step,) * 3, gradient_direction="ascent")
    vertices = vertices + low
    deviation = 1e3 * _chunked(gpis.distance_deviation, vertices)
    return Shape(
        SURFACE,
        vertices,
        np.asarray(faces, int),
        BLUE,
        opacity=0.4,
        values=np.minimum(deviation, np.quantile(deviation, SHOWN_SHARE)),
        moves=True,
    )


def _chunked(function: Callable[[Array], Array], points: Array) -> Array:
    """A function of points (Q, 3), evaluated a chunk at a time: it holds (Q, N) arrays."""
    parts = [points[i : i + CHUNK] for i in range(0, len(points), CHUNK)]
    return np.concatenate([function(part) for part in parts])


def table(middle: Array, height: float) -> Shape:
    """A square of the table's plane below a point (3,) [m]."""
    line = np.linspace(-TABLE_HALF, TABLE_HALF, TABLE_CELLS + 1)
    x, y = np.meshgrid(line + middle[0], line + middle[1], indexing="ij")
    vertices = np.stack([x, y, np.full_like(x, height)], axis=-1).reshape(-1, 3)
    n = TABLE_CELLS + 1
    corner = (np.arange(TABLE_CELLS)[:, None] * n + np.arange(TABLE_CELLS)).reshape(-1, 1)
    faces = np.concatenate([corner + np.array(square) for square in ([0, n, n + 1], [0, n + 1, 1])])
    return Shape(TABLE, vertices, faces, PALE)


def view(grasps: Grasps, rank: int, hand: Hand, problem: Problem | None) -> View:
    """What belongs to one grasp."""
    g = {name: getattr(grasps, name)[rank] for name in ("wrist", "joints", "contact_points", "normals", "targets")}
    friction = float(grasps.meta["settings"]["contact"]["friction"])
    shapes = [*(_ball(CONTACTS, p, DOT, GREEN, moves=True) for p in g["contact_points"])]
    shapes += [*(_ball(SPRINGS, o, TARGET, ORANGE) for o in g["targets"])]
    for p, n in zip(g["contact_points"], g["normals"], strict=True):
        shapes.append(_segments(NORMALS, np.stack([p, p + ARROW * n]), GREEN, 4.0, moves=True))
        shapes.append(cone(p, n, friction))
    poses = link_poses(hand, g["wrist"], g["joints"])
    shapes += spheres(hand, g["wrist"], g["joints"])
    gains, names = grasps.gains[rank], grasps.finger_names
    labels = tuple(
        Label(f"{name} {k:.0f} N/m", (float(a[0]), float(a[1]), float(a[2])))
        for name, k, a in zip(names, gains, grasps.tips_pregrasp[rank], strict=True)
    )
    feasible = "feasible" if grasps.feasible[rank] else f"not feasible: {grasps.violated[rank]}"
    title = f"{rank}: start {grasps.start[rank]}, {feasible}"
    return View(title, poses, tuple(shapes), stages(grasps, rank), labels, sheets(grasps, rank, problem))


def stages(grasps: Grasps, rank: int) -> tuple[Stage, ...]:
    """Pregrasp, first contact, and `STEPS` steps to the equilibrium, with the springs of each."""
    p, R, t = grasps.contacts[rank], grasps.rotation_eq[rank], grasps.translation_eq[rank]
    middle, turn = p.mean(axis=0), Rotation.from_matrix(R).as_rotvec()
    shift = R @ middle + t - middle
    still = np.eye(3), np.zeros(3)
    made = [_stage("pregrasp", *still, grasps, rank, grasps.tips_pregrasp[rank])]
    for s in np.linspace(0, 1, STEPS + 1):
        rotation = Rotation.from_rotvec(s * turn).as_matrix()
        translation = middle + s * shift - rotation @ middle
        name = {0.0: "first contact", 1.0: "equilibrium"}.get(s, f"{s:.0%} of the way to the equilibrium")
        made.append(_stage(name, rotation, translation, grasps, rank, p @ rotation.T + translation))
    return tuple(made)


def _stage(name: str, rotation: Array, translation: Array, grasps: Grasps, rank: int, tips: Array) -> Stage:
    shapes = []
    for tip, target, gain in zip(tips, grasps.targets[rank], grasps.gains[rank], strict=True):
        shapes.append(_segments(SPRINGS, coil(tip, target), ORANGE, float(gain) / GAIN_WIDTH))
        shapes.append(_ball(SPRINGS, tip, DOT, PURPLE))
    return Stage(name, rotation, translation, tuple(shapes))


def coil(start: Array, end: Array) -> Array:
    """A helix (P, 3) [m] from point to point (3,)."""
    s = np.linspace(0, 1, COIL_TURNS * COIL_POINTS + 1)[:, None]
    angle = 2 * np.pi * COIL_TURNS * s
    across, up = _across(end - start)
    radius = COIL_RADIUS * np.minimum(1, 10 * np.minimum(s, 1 - s))
    return start + s * (end - start) + radius * (np.cos(angle) * across + np.sin(angle) * up)


def cone(apex: Array, normal: Array, friction: float) -> Shape:
    """The cone of forces on the object at a contact, drawn outside, whence they come: half angle atan μ."""
    across, up = _across(normal)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)[:, None]
    rim = apex + ARROW * (normal + friction * (np.cos(angle) * across + np.sin(angle) * up)) / np.hypot(1, friction)
    i = np.arange(24)
    faces = np.stack([np.zeros(24, int), 1 + i, 1 + (i + 1) % 24], axis=1)
    return Shape(CONES, np.vstack([apex, rim]), faces, GREEN, opacity=0.3, moves=True)


def spheres(hand: Hand, wrist: Array, joints: Array, opacity: float = 0.35) -> list[Shape]:
    """The collision spheres at a pose of the hand."""
    centres = frames(hand, wrist, joints)[1]
    pairs = zip(centres, hand.spheres, strict=True)
    return [_ball(SPHERES, centre, sphere.radius, PURPLE, opacity=opacity) for centre, sphere in pairs]


def sheets(grasps: Grasps, rank: int, problem: Problem | None) -> tuple[Sheet, ...]:
    """Fingers with their margins, and the energy term by term."""
    force = np.linalg.norm(grasps.forces_eq[rank], axis=1)
    columns = (grasps.gains[rank], force, grasps.margins_initial[rank], grasps.margins_equilibrium[rank])
    sigma = 1e3 * grasps.contact_deviation[rank]
    fingers = [("finger", "gain [N/m]", "force [N]", "margin t0", "margin eq", "±σ [mm]")]
    for name, k, f, first, last, s in zip(grasps.finger_names, *columns, sigma, strict=True):
        fingers.append((str(name), f"{k:.0f}", f"{f:.2f}", f"{first:.3f}", f"{last:.3f}", f"{s:.1f}"))
    values = grasps.energy_terms[rank]
    energy = [("term", "value", "weight", "share")]
    weights = problem.weights() if problem is not None else np.full(len(values), np.nan)
    for name, value, w in zip(grasps.term_names, values, weights, strict=True):
        energy.append((str(name), f"{value:.4g}", f"{w:g}", f"{w * value:.2f}"))
    energy.append(("total", "", "", f"{grasps.energy[rank]:.2f}"))
    return Sheet("Fingers", tuple(fingers)), Sheet("Energy, exact", tuple(energy))


def _across(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors across a direction (3,) and each other."""
    axis = direction / max(float(np.linalg.norm(direction)), np.finfo(float).tiny)
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def _segments(layer: str, path: Array, colour: Colour, width: float, moves: bool = False) -> Shape:
    """A path (P, 3) [m] as segments."""
    i = np.arange(len(path) - 1)
    return Shape(layer, path, np.stack([i, i + 1], axis=1), colour, width=width, moves=moves)


def _ball(layer: str, centre: Array, radius: float, colour: Colour, opacity: float = 1.0, moves: bool = False) -> Shape:
    return Shape(layer, centre + radius * BALL.vertices, BALL.faces, colour, opacity=opacity, moves=moves)
