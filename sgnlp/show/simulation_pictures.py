"""A simulated grasp as a scene for `png`: the end of each phase, with the object."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from sgnlp.base import palette
from sgnlp.hand.hand import Hand
from sgnlp.hand.meshes import link_poses
from sgnlp.perception import shape as solids
from sgnlp.planning.surroundings import Surroundings
from sgnlp.show.scene import TARGET, arm_links, links, springs
from sgnlp.show.scene_around import around
from sgnlp.show.scene_parts import FORCES, NEWTON, OBJECT, SPRINGS, Label, Scene, Shape, Stage, View, named
from sgnlp.show.scene_shapes import axes, segments, solid, table
from sgnlp.simulation import Body, Command, Outcome, SimulationSettings, Trace
from sgnlp.simulation.prepared import Prepared
from sgnlp.simulation.world import World, world

PHASES = ("approach", "pregrasp", "close", "lift", "hold")
"""The phases whose end has a picture."""
OBJECT_OPACITY, HAND_OPACITY, FORCE_WIDTH = 0.4, 0.5, 8.0
"""Opacities of object and hand, so that springs that end in the object are visible; width of a force [pixel]."""


def scene(
    told: Prepared,
    body: Body,
    settings: SimulationSettings,
    outcome: Outcome,
    name: str,
    obstacles: Sequence[solids.Shape] = (),
) -> Scene:
    """A view of the end of each of the `PHASES` that was reached, titled with load and ending."""
    hand, trace = told.hand, outcome.trace
    where = world(body, hand, told.command, settings, obstacles, told.route)
    thing = Shape(OBJECT, body.vertices, body.faces, palette.SKY, opacity=OBJECT_OPACITY, moves=True)
    middle = (body.vertices.min(axis=0) + body.vertices.max(axis=0)) / 2
    lines, letters = axes(body.vertices, middle, body.table_height)
    shapes = (table(middle, body.table_height), thing, *around(Surroundings(tuple(obstacles)), middle), *lines)
    state = f"{settings.mass:g} kg, friction {settings.friction:g}, in the end: {outcome.ending}"
    views = tuple(_view(trace, row, told.command, hand, where, state, letters) for row in ends(trace).values())
    names = tuple(finger.name for finger in hand.fingers)
    shown = links(hand, HAND_OPACITY) + (arm_links(hand) if where.arm else ())
    return Scene(name, shown, shapes, views, (), kind="End of", fingers=names)


def ends(trace: Trace) -> dict[str, int]:
    """The last sample of each of the `PHASES` that was reached."""
    rows = {phase: np.flatnonzero(trace.phase == phase) for phase in PHASES}
    return {phase: int(found[-1]) for phase, found in rows.items() if len(found)}


def _view(trace: Trace, row: int, command: Command, hand: Hand, where: World, state: str, letters: list[Label]) -> View:
    """The view of one sample of the trace; the targets move with the wrist."""
    q, tips, wrist = trace.qpos[row], trace.tips[row], trace.wrist[row]
    then, now = (pin.XYZQUATToSE3(np.asarray(pose, float)) for pose in (command.wrist, wrist))
    went = now * then.inverse()
    targets = command.targets @ went.rotation.T + went.translation
    shapes = springs(tips, targets, command.gains)
    for i, (tip, target, force) in enumerate(zip(tips, targets, trace.forces[row], strict=True)):
        shapes.append(solid(SPRINGS, target, TARGET, palette.finger(i), "cube"))
        shapes.append(segments(FORCES, np.stack([tip, tip + NEWTON * force]), palette.finger(i), FORCE_WIDTH))
    place = q[where.object_place]
    stage = Stage(state, Rotation.from_quat(place[3:], scalar_first=True).as_matrix(), place[:3], tuple(shapes))
    poses = link_poses(hand, wrist, q[where.hand_joints[: len(hand.joint_names)]])
    if where.arm:
        poses = np.concatenate([poses, link_poses(where.arm, where.arm.base, q[where.carrier])])
    labels = (*named([finger.name for finger in hand.fingers], tips), *letters)
    return View(f"{trace.phase[row]}, {trace.time[row]:.1f} s", poses, (), (stage,), labels, ())
