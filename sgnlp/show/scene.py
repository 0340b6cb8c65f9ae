"""Planned grasps as a scene: the parts of each view, and the stages of the grasping motion.

The object's motion has stages: the pregrasp, the first contact, and steps to the equilibrium. With p̄ the middle of the
contacts, it turns by exp(s log R) about p̄ while p̄ moves by s (R p̄ + t - p̄), s from 0 to 1. The hand stays at the
pregrasp.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from sgnlp.base import palette
from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.hand.hand import Hand
from sgnlp.hand.meshes import link_meshes, mesh_links
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion.trajectory import Trajectory
from sgnlp.planning.problem import Problem
from sgnlp.planning.surroundings import Surroundings
from sgnlp.show import sheets
from sgnlp.show.scene_around import around
from sgnlp.show.scene_motion import frames, poses
from sgnlp.show.scene_parts import ARM, CLOUD, CONTACTS, HAND, NORMALS, SPRINGS, Scene, Shape, Stage, View, named
from sgnlp.show.scene_shapes import ARROW, axes, coil, cone, segments, solid, spheres, surface, table

HAND_OPACITY = 0.35
"""Opacity of the hand, so that object, contacts and springs behind it are visible."""
DOT, TARGET = 0.003, 0.004
"""Radius of a contact and of a target [m]."""
GAIN_WIDTH = 60.0
"""Gain for each pixel of a spring's width [N/m]."""
STEPS = 5
"""Stages from first contact to equilibrium."""


def scene(
    grasps: Grasps,
    hand: Hand,
    problem: Problem | None,
    points: Array,
    notes: Sequence[str] = (),
    motion: Trajectory | None = None,
) -> Scene:
    """The scene of grasps. It shows the surface of the `problem`, and the points; without both, the grasps alone.

    `motion` is the motion of one of the grasps.

    Raises:
        InputError: there is no grasp to show, or scikit-image, which extracts the surface, is not installed.
    """
    if not len(grasps):
        raise InputError("the result has no grasps to show")
    meta = grasps.meta
    height = float(meta["table_height"])
    shapes = [table(grasps.contacts[0].mean(axis=0), height)]
    if len(points):
        shapes.append(Shape(CLOUD, points, np.arange(len(points))[:, None], palette.INK, width=1.0, moves=True))
    if problem is not None:
        shapes.append(surface(problem.gpis, problem.box))
    given = Surroundings.restored(meta.get("surroundings", {})) if problem is None else problem.surroundings
    shapes += around(given, grasps.contacts[0].mean(axis=0))
    views = [view(grasps, rank, hand, problem) for rank in range(len(grasps))]
    if motion is not None:
        rank = int(motion.meta["rank"])
        views[rank] = replace(views[rank], frames=frames(motion, grasps, hand))
    names = tuple(finger.name for finger in hand.fingers)
    return Scene(
        str(meta["object"]), (*links(hand), *arm_links(hand)), tuple(shapes), tuple(views), tuple(notes), fingers=names
    )


def links(hand: Hand, opacity: float = HAND_OPACITY) -> tuple[Shape, ...]:
    """The links' meshes in their own frames, dark ones lightened. A link with a pad has the colour of its finger.

    Raises:
        InputError: a mesh of the URDF is missing, or cannot be read.
    """
    colours = {finger.frame: palette.finger(i) for i, finger in enumerate(hand.fingers)}
    meshes = zip(*link_meshes(hand), mesh_links(hand), strict=True)
    return tuple(
        Shape(HAND, mesh.vertices, mesh.faces, colours.get(link, palette.lightened(colour)), opacity=opacity)
        for mesh, colour, link in meshes
    )


def arm_links(hand: Hand) -> tuple[Shape, ...]:
    """The meshes of the arm that carries the hand, likewise; empty without an arm."""
    if hand.arm is None:
        return ()
    return tuple(
        Shape(ARM, mesh.vertices, mesh.faces, palette.lightened(colour), opacity=HAND_OPACITY)
        for mesh, colour in zip(*link_meshes(hand.arm), strict=True)
    )


def view(grasps: Grasps, rank: int, hand: Hand, problem: Problem | None) -> View:
    """The view of one grasp."""
    g = {name: getattr(grasps, name)[rank] for name in ("wrist", "joints", "contact_points", "normals", "targets")}
    friction = float(grasps.meta["settings"]["contact"]["friction"])
    shapes = []
    for i, (p, n, o) in enumerate(zip(g["contact_points"], g["normals"], g["targets"], strict=True)):
        colour = palette.finger(i)
        shapes.append(solid(CONTACTS, p, DOT, colour, moves=True))
        shapes.append(solid(SPRINGS, o, TARGET, colour, "cube"))
        shapes.append(segments(NORMALS, np.stack([p, p + ARROW * n]), colour, 4.0, moves=True))
        shapes.append(cone(p, n, friction, colour))
    shapes += spheres(hand, g["wrist"], g["joints"])
    tips = grasps.tips_pregrasp[rank]
    height, middle = float(grasps.meta["table_height"]), grasps.contacts[0].mean(axis=0)
    lines, letters = axes(tips, middle, height)
    texts = [f"{name} {k:.0f} N/m" for name, k in zip(grasps.finger_names, grasps.gains[rank], strict=True)]
    feasible = "feasible" if grasps.feasible[rank] else f"not feasible: {grasps.violated[rank]}"
    return View(
        title=f"{rank}: start {grasps.start[rank]}, {feasible}",
        links=poses(hand, g["wrist"], g["joints"], grasps.arm[rank, 0]),
        shapes=(*shapes, *lines),
        stages=stages(grasps, rank),
        labels=(*named(texts, tips), *letters),
        sheets=(
            sheets.fingers(grasps, rank),
            sheets.energy(grasps, rank, None if problem is None else problem.weights()),
            sheets.wrist(grasps, rank, hand),
            sheets.joints(grasps, rank, hand),
        ),
    )


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
    return Stage(name, rotation, translation, tuple(springs(tips, grasps.targets[rank], grasps.gains[rank])))


def springs(tips: Array, targets: Array, gains: Array) -> list[Shape]:
    """Springs of gains (m,) [N/m] from tips to targets (m, 3) [m], with the tips."""
    shapes = []
    for i, (tip, target, gain) in enumerate(zip(tips, targets, gains, strict=True)):
        shapes.append(segments(SPRINGS, coil(tip, target), palette.finger(i), float(gain) / GAIN_WIDTH))
        shapes.append(solid(SPRINGS, tip, DOT, palette.finger(i), "diamond"))
    return shapes
