"""The outcome of a simulated grasp, phase by phase."""

from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal

import numpy as np

from sgnlp.base.arrays import Array, StrArray
from sgnlp.base.brief import brief

Ending = Literal["held", "slid", "dropped", "not lifted", "in collision", "diverged"]

PREGRASP = "pregrasp"
OBSTACLE, ARM, EARLY = "obstacle", "arm", "approach"
"""Kinds of a knock."""
THING = "object"
"""Name of the object in a knock."""


@dataclass(frozen=True)
class Pregrasp:
    """The planned pregrasp of hand and arm, with the object at rest on the table."""

    penetration_object: float  # [m] greatest depth of the hand in the object
    penetration_table: float  # [m]
    penetration_self: float  # [m]
    penetration_obstacles: float  # [m] greatest depth of hand or arm in an obstacle
    settle_shift: float  # [m] motion of the object's centre of mass from its given pose to rest
    settle_turn: float  # [rad]


@dataclass(frozen=True)
class Knock:
    """An unwanted touch of two parts: its greatest depth and force in a phase."""

    phase: str
    kind: str  # "obstacle"; "arm": the arm touched something else; "approach": the hand touched the object too early
    part: str  # link of hand or arm, or "object"
    hit: str  # name of an obstacle; "table", "object", or a link of the hand
    depth: float  # [m]
    force: float  # [N], normal; 0 at the pregrasp, where hand and arm are placed to measure how deep they are

    def collision(self, force: float) -> bool:
        """Whether a robot that stops at this force [N] would stop: hand or arm hit what it should stay clear of."""
        return self.force >= force and (self.kind == ARM or (self.kind == OBSTACLE and self.part != THING))


@dataclass(frozen=True)
class Carriage:
    """How well the arm, or a floating wrist, followed the motion."""

    approach_seconds: float  # [s]
    lift_seconds: float  # [s]
    approach_off: float  # [m] largest distance of the hand's root link from its commanded place, on the approach
    closing_off: float  # [m] the same while the fingers closed, at the pregrasp
    lift_off: float  # [m] the same on the lift and the hold
    torque_share: float  # largest torque of a joint of the arm over its effort, its weight included; 0 without an arm


@dataclass(frozen=True, eq=False)
class Closing:
    """Closing: the setpoints go to their ends, and the springs act until rest, the equilibrium; m fingers."""

    seconds: float  # [s] from the pregrasp until rest
    rested: bool
    """hand and object were at rest before the longest wait was over"""
    contact_times: Array  # (m,) [s] first touch of each pad, NaN if it never touches
    contact_spread: float  # [s] from the first pad's touch to the last one's, NaN if a pad never touches
    links: tuple[str, ...]
    """links other than pads that touch the object at any time"""
    premature: tuple[str, ...]
    """links other than pads that touch the object before the last pad does"""
    shift_before_contact: float  # [m] motion of the object's centre of mass until the last pad touches
    turn_before_contact: float  # [rad]
    rotation: Array  # (3, 3) motion of the object from its given pose to the equilibrium
    translation: Array  # (3,) [m]
    shift_error: float | None  # [m] distance of its centre of mass from the planned equilibrium; None without a plan
    turn_error: float | None  # [rad]
    forces: Array  # (m, 3) [N] of the pads on the object at the equilibrium
    force_errors: Array | None  # (m,) [N] |force - planned force|
    tip_errors: Array | None  # (m,) [m] distance of the tips from their planned places at the equilibrium
    pads_loaded: int
    """number of pads that press with 0.05 N or more at the equilibrium"""
    links_equilibrium: tuple[str, ...]
    """links other than pads that touch the object at the equilibrium"""
    links_force: float  # [N] normal forces of links other than pads at the equilibrium, summed
    slip: Array  # (m,) [m] path of each pad over the surface, rolling excluded
    torque_share: float  # largest torque of the actuators of a joint over its effort at the equilibrium
    torque_share_closing: float  # the same at any time of closing
    joints_limited: float  # share of the joints with a motor that are at their effort at the equilibrium
    joints_limited_closing: float  # the same at any time of closing


@dataclass(frozen=True, eq=False)
class Lift:
    """Lift and hold; m fingers."""

    rise: float  # [m] least rise of the object's centre of mass during the hold, from its rest on the table
    clearance: float  # [m] least height of the object's lowest point over the table during the hold
    slip: Array  # (m,) [m] path of each pad over the surface during lift and hold, rolling excluded
    creep: float | None  # [m/s] speed of the centre of mass over the second half of the hold; None without a hold


@dataclass(frozen=True)
class Push:
    """A push of the held object, and whether the grasp withstood it."""

    direction: str  # +x, -x, +y, -y, +z or -z
    held: bool
    """the object stayed clear of the table and no pad slid further than the limit"""
    shift: float  # [m] farthest displacement of the centre of mass
    slip: float  # [m] longest path of a pad over the surface, rolling excluded


@dataclass(frozen=True, eq=False)
class Trace:
    """Samples of the whole run for pictures and figures: T samples, m fingers."""

    time: Array  # (T,) [s] since the pregrasp; below 0 on the approach
    phase: StrArray  # (T,) pregrasp, or with a motion approach, then close, lift, hold, push +x ...
    qpos: Array  # (T, nq) MuJoCo's configuration
    tips: Array  # (T, m, 3) [m] centres of the pads
    forces: Array  # (T, m, 3) [N] of the pads on the object
    wrist: Array  # (T, 7) pose of the hand's root link, x y z [m] qx qy qz qw


@dataclass(frozen=True, eq=False)
class Outcome:
    """The judgement of one grasp. A phase that was not reached is None."""

    __repr__ = brief

    ending: Ending
    score: float
    """score of the paper: 1 lifted without sliding, 0.5 lifted but slid, 0 not lifted"""
    score_strict: float
    """the same score with the strict rise"""
    pregrasp: Pregrasp
    closing: Closing | None
    lift: Lift | None
    pushes: tuple[Push, ...]
    trace: Trace
    knocks: tuple[Knock, ...] = ()
    """unwanted touches: with an obstacle, of the arm, and with the object on the approach"""
    carriage: Carriage | None = None
    """None where no motion was carried out"""

    @property
    def obstacles_touched(self) -> tuple[str, ...]:
        """The names of the obstacles that hand, arm or object touched."""
        return tuple(sorted({knock.hit for knock in self.knocks if knock.kind == OBSTACLE}))

    @property
    def pushes_held(self) -> int:
        """Number of the six pushes that were withstood; 0 if the object was not held before them."""
        return sum(push.held for push in self.pushes)


def plain(value: Any) -> Any:
    """An outcome, or a part of one, as plain mappings, lists and numbers, without the trace."""
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value) if f.name != "trace"}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
