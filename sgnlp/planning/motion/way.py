"""The samples of a grasp's motion, phase by phase.

    approach   wrist from x - l R a straight to the pregrasp x, fingers at the pregrasp: a palm's direction, l stand-off
    close      wrist still, fingers from the pregrasp to first contact, setpoints of the springs from tips to contacts
    squeeze    setpoints move on until they press: joints to `joints_squeeze`, springs to the targets
    lift       all setpoints up by the height of the lift

A finger touches after the share 1 - c of its way to the target. The largest 1 - c of the fingers is the close's share
of `closing.seconds`; the squeeze has the rest. Each phase goes from rest to rest (`timing`).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array, StrArray
from sgnlp.base.settings import Closing, Motion
from sgnlp.hand.arm import Arm
from sgnlp.hand.hand import Hand
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion.following import followed, path_seconds
from sgnlp.planning.motion.timing import seconds, shares, stated
from sgnlp.planning.motion.trajectory import APPROACH, CLOSE, LIFT, PHASES, SQUEEZE

UP = np.array([0.0, 0.0, 1.0])
GRID = 11
"""Number of poses on a path, with both ends, at which the arm's speed is computed."""


@dataclass(frozen=True, eq=False)
class Way:
    """T samples; `off` (T,) [m] is the distance of the arm's wrist from the path, 0 without an arm."""

    times: Array
    phase: StrArray
    wrist: Array
    joints: Array
    arm: Array
    setpoints: Array
    off: Array


class _Corner(NamedTuple):
    """The beginning or end of a phase: wrist (7,), joints (n,), setpoints (m, 3)."""

    wrist: Array
    joints: Array
    setpoints: Array


def way(hand: Hand, motion: Motion, closing: Closing, grasps: Grasps, rank: int) -> Way:
    """The samples of a grasp."""
    wrist = grasps.wrist[rank]
    back = -motion.standoff * (pin.XYZQUATToSE3(wrist).rotation @ hand.palm)
    up = motion.lift * UP
    pregrasp = _Corner(wrist, grasps.joints[rank], grasps.tips_pregrasp[rank])
    touch = _Corner(wrist, grasps.joints_contact[rank], grasps.contacts[rank])
    press = _Corner(wrist, grasps.joints_squeeze[rank], grasps.targets[rank])
    corners = (_shifted(pregrasp, back), pregrasp, touch, press, _shifted(press, up))
    close, squeeze = _closing_seconds(hand, motion, closing, grasps, rank)
    planned = grasps.arm[rank, 0]
    lasting = {
        APPROACH: _path_seconds(hand.arm, motion, planned, wrist, corners[0].wrist),
        CLOSE: close,
        SQUEEZE: squeeze,
        LIFT: _path_seconds(hand.arm, motion, planned, wrist, corners[-1].wrist),
    }
    parts: list[tuple[Array, ...]] = []
    phase: list[str] = []
    for name, begin, end in zip(PHASES, corners, corners[1:], strict=False):
        s = shares(lasting[name], motion.step)[0 if not parts else 1 :]  # where phases meet there is one sample
        wrists, joints, setpoints = (_between(low, high, s) for low, high in zip(begin, end, strict=True))
        parts.append((wrists, joints, setpoints, *_carried(hand.arm, planned, name, wrists)))
        phase += [name] * len(s)
    wrists, joints, setpoints, arm, off = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Way(motion.step * np.arange(float(len(phase))), np.array(phase), wrists, joints, arm, setpoints, off)


def _shifted(corner: _Corner, by: Array) -> _Corner:
    return _Corner(_moved(corner.wrist, by), corner.joints, corner.setpoints + by)


def _moved(wrist: Array, by: Array) -> Array:
    return wrist + np.concatenate([by, np.zeros(4)])


def _between(low: Array, high: Array, s: Array) -> Array:
    """low + s (high - low), exactly `high` at s = 1, and constant where both are equal."""
    s = s.reshape(-1, *(1,) * low.ndim)
    return np.where(low == high, low, (1 - s) * low + s * high)


def _closing_seconds(hand: Hand, motion: Motion, closing: Closing, grasps: Grasps, rank: int) -> tuple[float, float]:
    """Durations of the close and the squeeze [s]."""
    whole, share = closing.seconds, float(1 - grasps.c[rank].min())
    limits = motion.speed_share * stated(np.array(hand.model.velocityLimit))
    touch = grasps.joints_contact[rank]
    close = seconds(touch - grasps.joints[rank], limits, share * whole)
    return close, seconds(grasps.joints_squeeze[rank] - touch, limits, (1 - share) * whole)


def _path_seconds(arm: Arm | None, motion: Motion, planned: Array, pregrasp: Array, end: Array) -> float:
    """Duration of the wrist's way between its pose (7,) at the pregrasp and another with the same rotation [s]."""
    least = seconds(np.array([np.linalg.norm((end - pregrasp)[:3])]), np.array([motion.speed]))
    if arm is None:
        return least
    poses = _between(pregrasp, end, np.linspace(0.0, 1.0, GRID))
    return path_seconds(arm, followed(arm, planned, poses)[0], motion.speed_share, least)


def _carried(arm: Arm | None, planned: Array, phase: str, wrists: Array) -> tuple[Array, Array]:
    """The arm's joints (K, a) and errors (K,) for wrist poses (K, 7), from the pregrasp on, where they are as planned.

    The approach is followed backwards from its end.
    """
    if arm is None or phase in (CLOSE, SQUEEZE):
        return np.repeat(planned[None], len(wrists), axis=0), np.zeros(len(wrists))
    order = -1 if phase == APPROACH else 1
    joints, off = (found[::order] for found in followed(arm, planned, wrists[::order]))
    if phase == APPROACH:
        joints[-1] = planned
    return joints, off
