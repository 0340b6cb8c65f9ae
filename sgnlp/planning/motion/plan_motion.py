"""From a planned grasp to its whole motion.

    approach   wrist from x - l R a straight to the pregrasp x, fingers at the pregrasp: a palm's direction, l stand-off
    close      wrist still, fingers from the pregrasp to first contact, setpoints of the springs from tips to contacts
    squeeze    setpoints on to where they press: joints to `joints_squeeze`, springs to the targets
    lift       all setpoints up by the height of the lift

The share 1 - c of its way to the target that a finger goes until it touches is the close's share of `closing.seconds`,
the largest of the fingers'; the squeeze has the rest. Each phase goes from rest to rest (`timing`).
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sgnlp.base.arrays import Array
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion import clearances
from sgnlp.planning.motion.timing import seconds, shares, stated
from sgnlp.planning.motion.trajectory import APPROACH, CLOSE, LIFT, PHASES, SQUEEZE, Trajectory
from sgnlp.planning.problem import Problem
from sgnlp.program.constraint import Check

UP = np.array([0.0, 0.0, 1.0])


def trajectory(problem: Problem, grasps: Grasps, points: Array, rank: int = 0) -> Trajectory:
    """The motion of the grasp of a rank among what the problem has around the object, with its checks.

    `points` (N, 3) [m] are those measured of the object: they are kept clear of obstacles on the lift.
    """
    way = _way(problem, grasps, rank)
    meta = {name: grasps.meta.get(name) for name in ("object", "hand", "input_digest")}
    made = Trajectory(
        times=way.times,
        phase=way.phase,
        wrist=way.wrist,
        joints=way.joints,
        arm=np.empty((len(way.times), 0)),
        setpoints=way.setpoints,
        gains=grasps.gains[rank],
        joint_names=grasps.joint_names,
        arm_joint_names=np.empty(0, "<U1"),
        finger_names=grasps.finger_names,
        checks=_checks(problem, way, grasps.joints_contact[rank], _at_equilibrium(grasps, rank, points)),
        meta=meta | {"rank": rank, "start": int(grasps.start[rank]), "frame": problem.settings.motion.frame},
    )
    return made


@dataclass(frozen=True, eq=False)
class _Way:
    """The samples of all phases."""

    times: Array
    phase: NDArray[np.str_]
    wrist: Array
    joints: Array
    setpoints: Array


def _way(problem: Problem, grasps: Grasps, rank: int) -> _Way:
    """Corner points of the phases, and the samples between them."""
    motion = problem.settings.motion
    wrist, back, up = grasps.wrist[rank], *_shifts(problem, grasps.wrist[rank])
    begin, top = _shifted(wrist, back), _shifted(wrist, up)
    tips, contacts, targets = grasps.tips_pregrasp[rank], grasps.contacts[rank], grasps.targets[rank]
    open_, touch, press = grasps.joints[rank], grasps.joints_contact[rank], grasps.joints_squeeze[rank]
    close, squeeze = _closing_seconds(problem, grasps, rank)
    corners = (
        (APPROACH, (begin, open_, tips + back), (wrist, open_, tips), seconds(_norm(back), np.array([motion.speed]))),
        (CLOSE, (wrist, open_, tips), (wrist, touch, contacts), close),
        (SQUEEZE, (wrist, touch, contacts), (wrist, press, targets), squeeze),
        (LIFT, (wrist, press, targets), (top, press, targets + up), seconds(_norm(up), np.array([motion.speed]))),
    )
    assert tuple(name for name, *_ in corners) == PHASES
    parts: list[list[Array]] = []
    phase: list[str] = []
    for name, low, high, duration in corners:
        s = shares(duration, motion.step)[0 if not parts else 1 :]  # where phases meet there is one sample
        phase += [name] * len(s)
        parts.append([_between(a, b, s) for a, b in zip(low, high, strict=True)])
    wrists, joints, setpoints = (np.concatenate(column) for column in zip(*parts, strict=True))
    return _Way(motion.step * np.arange(float(len(phase))), np.array(phase), wrists, joints, setpoints)


def _closing_seconds(problem: Problem, grasps: Grasps, rank: int) -> tuple[float, float]:
    """How long the close and the squeeze last [s]."""
    whole, share = problem.settings.closing.seconds, float(1 - grasps.c[rank].min())
    limits = problem.settings.motion.speed_share * stated(np.array(problem.hand.model.velocityLimit))
    touch = grasps.joints_contact[rank]
    close = seconds(touch - grasps.joints[rank], limits, share * whole)
    return close, seconds(grasps.joints_squeeze[rank] - touch, limits, (1 - share) * whole)


def _shifts(problem: Problem, wrist: Array) -> tuple[Array, Array]:
    """From the pregrasp to the stand-off, and from there up with the object, (3,) [m] each."""
    motion, R = problem.settings.motion, pin.XYZQUATToSE3(wrist).rotation
    return -motion.standoff * (R @ problem.hand.palm), motion.lift * UP


def _shifted(wrist: Array, by: Array) -> Array:
    return wrist + np.concatenate([by, np.zeros(4)])


def _norm(way: Array) -> Array:
    return np.array([np.linalg.norm(way)])


def _between(low: Array, high: Array, s: Array) -> Array:
    """low + s (high - low), exactly `high` at s = 1 and the same throughout where both are the same."""
    s = s.reshape(-1, *(1,) * low.ndim)
    return np.asarray((1 - s) * low + s * high) if (low != high).any() else np.repeat(low[None], len(s), axis=0)


def _at_equilibrium(grasps: Grasps, rank: int, points: Array) -> Array:
    """Points (N, 3) of the object where the squeeze has moved it."""
    return np.asarray(points @ grasps.rotation_eq[rank].T + grasps.translation_eq[rank])


def _checks(problem: Problem, way: _Way, touch: Array, load: Array) -> tuple[Check, ...]:
    """Every check. In the squeeze and the lift the fingers are where they touch: it is setpoints that go on."""
    hand, limits, fields = problem.hand, problem.settings.limits, problem.fields
    pads = list(hand.tip_spheres)
    links = [i for i in range(len(hand.spheres)) if i not in pads]
    none = np.zeros(len(hand.spheres))
    low = np.full(len(hand.spheres), limits.table_margin)
    low[pads] = limits.pad_margin
    found = []
    for name in (APPROACH, CLOSE, LIFT):
        at = way.phase == name
        joints = np.repeat(touch[None], at.sum(), axis=0) if name == LIFT else way.joints[at]
        hand_at = clearances.hand_samples(hand, name, way.times[at], way.wrist[at], joints)
        if name != LIFT:
            found.append(clearances.to_object(problem, hand_at if name == APPROACH else hand_at.of(links)))
        if fields.near.shapes:
            found.append(clearances.to_obstacles(hand_at, fields.near, limits.obstacle_margin))
        found.append(clearances.to_table(hand_at, problem.table_height, low if name == APPROACH else none))
        if name == CLOSE:
            found.append(clearances.to_itself(hand, hand_at))
        if name == LIFT and fields.near.shapes:
            rises = way.wrist[at, 2] - way.wrist[np.flatnonzero(at)[0] - 1, 2]
            found.append(clearances.load_to_shapes(name, way.times[at], load, rises, fields.near))
    return tuple(found)
