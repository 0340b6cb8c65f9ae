"""Contacts: which parts touch, how deep and how hard."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.motion.trajectory import APPROACH
from sgnlp.simulation.outcome import ARM, EARLY, OBSTACLE, PREGRASP, THING, Knock
from sgnlp.simulation.scene import TABLE
from sgnlp.simulation.world import World


@dataclass(frozen=True, eq=False)
class Touch:
    """A contact of the object with another geom."""

    geom: int  # the other one
    point: Array  # (3,) [m]
    normal: Array  # (3,) out of the object
    force: Array  # (3,) [N] on the object


def touches(world: World, data: Any) -> Iterator[Touch]:
    """The contacts of the object with a force."""
    import mujoco

    for i in range(data.ncon):
        contact = data.contact[i]
        first, second = contact.geom
        if contact.efc_address < 0 or (first in world.object_geoms) == (second in world.object_geoms):
            continue
        wrench = np.zeros(6)
        mujoco.mj_contactForce(world.model, data, i, wrench)
        frame = contact.frame.reshape(3, 3)  # rows: normal from the first geom to the second, two tangents
        force = frame.T @ wrench[:3]  # on the second
        own = second in world.object_geoms
        geom = int(first if own else second)
        yield Touch(geom, contact.pos.copy(), frame[0] * (-1 if own else 1), force if own else -force)


def penetrations(world: World, data: Any) -> dict[str, float]:
    """Deepest overlap [m] of the hand, or its arm, with object, table, obstacles and itself, by name; 0 if none."""
    deepest = {"object": 0.0, "table": 0.0, "self": 0.0, "obstacles": 0.0}
    for i in range(data.ncon):
        pair = set(data.contact[i].geom.tolist())
        robot = world.hand_geoms | world.arm_geoms
        if pair & robot:
            other = pair - robot
            kind = "self" if not other else "table" if world.table in other else "object"
            kind = "obstacles" if other & world.obstacles.keys() else kind
            deepest[kind] = max(deepest[kind], -float(data.contact[i].dist))
    return deepest


def knocks(world: World, data: Any, phase: str) -> tuple[Knock, ...]:
    """Unwanted touches: of anything with an obstacle, of the arm with anything, of the hand with the object on
    approach.

    For contacts between the same parts: the greatest depth and the sum of the normal forces.
    """
    import mujoco

    found: dict[tuple[str, str, str], Knock] = {}
    for i, told in _unwanted(world, data, phase):
        if data.contact[i].efc_address < 0:
            continue
        wrench = np.zeros(6)
        mujoco.mj_contactForce(world.model, data, i, wrench)
        before = found.get(told)
        depth = max(-float(data.contact[i].dist), before.depth if before else 0.0)
        force = abs(float(wrench[0])) + (before.force if before else 0.0)
        found[told] = Knock(phase, *told, depth=depth, force=force)
    return tuple(found.values())


def overlaps(world: World, data: Any) -> tuple[Knock, ...]:
    """The same without forces, for the pregrasp, where hand and arm are placed, not moved."""
    found: dict[tuple[str, str, str], float] = {}
    for i, told in _unwanted(world, data, PREGRASP):
        found[told] = max(found.get(told, 0.0), -float(data.contact[i].dist))
    return tuple(Knock(PREGRASP, *told, depth=depth, force=0.0) for told, depth in found.items() if depth > 0)


def _unwanted(world: World, data: Any, phase: str) -> Iterator[tuple[int, tuple[str, str, str]]]:
    """The indices of these contacts, each with its kind, the part, and what it touches."""
    if not world.obstacles and not world.arm_geoms and phase != APPROACH:
        return
    for i in range(data.ncon):
        one, other = data.contact[i].geom.tolist()
        told = _told(world, one, other, phase)
        if told is not None:
            yield i, told


def _told(world: World, one: int, other: int, phase: str) -> tuple[str, str, str] | None:
    """Kind, part and what it touches; None if the touch is not reported."""
    for part, hit in ((one, other), (other, one)):
        if hit in world.obstacles:
            return OBSTACLE, world.link(part), world.obstacles[hit]
        if part in world.arm_geoms:
            return ARM, world.link(part), world.link(hit) if hit in world.hand_geoms else _name(world, hit)
        if part in world.hand_geoms and hit in world.object_geoms and phase == APPROACH:
            return EARLY, world.link(part), THING
    return None


def _name(world: World, geom: int) -> str:
    return TABLE if geom == world.table else THING
