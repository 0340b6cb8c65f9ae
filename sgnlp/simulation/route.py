"""The path of the arm, or of a floating wrist: its coordinates at any time of the approach and of the lift."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError
from sgnlp.control.command import Command
from sgnlp.hand.hand import Hand
from sgnlp.planning.motion.trajectory import APPROACH, LIFT, SQUEEZE, Trajectory
from sgnlp.planning.motion.way import Way

Moving = Trajectory | Way
SAME = 1e-6
"""Largest distance of the approach's end from the pregrasp, for rounding [m, and components of a quaternion]."""


@dataclass(frozen=True, eq=False)
class Leg:
    """K samples of d coordinates from rest to rest: the joints of an arm, or the position of a floating wrist."""

    times: Array  # (K,) [s] from 0
    coordinates: Array  # (K, d) [rad or m]

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return float(self.times[-1])

    @property
    def end(self) -> Array:
        """Where it ends (d,)."""
        return np.asarray(self.coordinates[-1])

    @cached_property
    def _spline(self) -> Any:
        # imported here: it takes a third of a second, which other commands need not wait for
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.times, self.coordinates, bc_type="clamped")

    def at(self, time: float) -> tuple[Array, Array]:
        """Coordinates (d,) and their speeds (d,) at a time [s]; at rest before it begins and after it ends."""
        if not 0 < time < self.seconds:
            return self.coordinates[0 if time <= 0 else -1], np.zeros(self.coordinates.shape[1])
        return np.asarray(self._spline(time)), np.asarray(self._spline(time, 1))


@dataclass(frozen=True, eq=False)
class Route:
    """From the stand-off to the pregrasp, and up."""

    approach: Leg
    lift: Leg


def route(made: Moving, command: Command, hand: Hand) -> Route:
    """The route of a motion of this grasp.

    Its coordinates are the joints of the hand's arm or, without an arm, the wrist's displacement from the pregrasp
    (3,) [m].

    Raises:
        InputError: the motion is that of another grasp or arm, or the wrist turns without an arm.
    """
    a = 0 if hand.arm is None else len(hand.arm.joint_names)
    if made.arm.shape[1] != a:
        raise InputError(f"the motion moves {made.arm.shape[1]} joints of an arm, and there are {a}")
    pregrasp, pressed = (int(np.flatnonzero(made.phase == name)[-1]) for name in (APPROACH, SQUEEZE))
    if np.abs(made.wrist[pregrasp] - command.wrist).max() > SAME:
        raise InputError("the motion is that of another grasp: its approach does not end at the pregrasp")
    if a == 0 and np.abs(made.wrist[:, 3:] - made.wrist[0, 3:]).max() > SAME:
        raise InputError("the motion turns the wrist, which only a hand on an arm does")
    coordinates = made.arm if a else made.wrist[:, :3] - made.wrist[pregrasp, :3]
    approach, lift = made.phase == APPROACH, made.phase == LIFT
    lift[pressed] = True
    return Route(_leg(made.times, coordinates, approach), _leg(made.times, coordinates, lift))


def _leg(times: Array, coordinates: Array, at: BoolArray) -> Leg:
    return Leg(times[at] - times[at][0], coordinates[at])
