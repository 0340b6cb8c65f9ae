"""The variables of a nonlinear program: their order, their units, and their meaning in a grasp.

    x = (v (6 + n), o (3 m), k (m) | c (m), w (n), q (a), q_s (a), q_l (a) | the formulation's own) / units

The first block is in every program. The second has, if the hand at first contact is planned, c of each finger (if it is
free) and the joints at first contact, with the same wrist; and, if an arm carries the hand, the arm's joints at the
pregrasp, at the stand-off and with the object lifted.
"""

from dataclasses import dataclass, field

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import integrate
from sgnlp.program.carried import POSTURES, UNIT
from sgnlp.program.names import arm_names, contact_names, variable_names

UNITS = {"linear": 0.1, "angular": 1.0, "joint": 1.0, "target": 0.1, "gain": 100.0}
"""Units of the variables of every program [m, rad, rad, m, N/m], so that all are of order 1; at contact 1."""


@dataclass(frozen=True)
class Variables:
    """Variables of a program: their names, and the units of the scaled ones."""

    names: tuple[str, ...] = ()
    units: Array = field(default_factory=lambda: np.zeros(0))

    def __add__(self, other: "Variables") -> "Variables":
        return Variables(self.names + other.names, np.concatenate([self.units, other.units]))


@dataclass(frozen=True)
class AtContact:
    """Which variables of the hand at first contact a program has; an arm's variables are always included."""

    joints: bool = False
    c: bool = False

    def of(self, hand: Hand) -> Variables:
        """c of each finger and the joints of the hand, if they are variables, and the arm's, if there is one."""
        names, arm = contact_names(hand, self.c, self.joints), arm_names(hand)
        return Variables((*names, *arm), np.array([1.0] * len(names) + [UNIT] * len(arm)))


def variable_kinds(hand: Hand) -> list[str]:
    """The kind of each variable of every program, a key of `UNITS`: the order of x."""
    n, m = len(hand.joint_names), len(hand.fingers)
    return ["linear"] * 3 + ["angular"] * 3 + ["joint"] * n + ["target"] * (3 * m) + ["gain"] * m


def variable_units(hand: Hand) -> Array:
    """The unit of each variable that every program has."""
    return np.array([UNITS[kind] for kind in variable_kinds(hand)])


def common(hand: Hand) -> Variables:
    """The variables of every program."""
    return Variables(variable_names(hand), variable_units(hand))


@dataclass(frozen=True, eq=False)
class Posture:
    """The meaning of the variables: a pregrasp with its springs, and the hand at first contact if it is planned."""

    wrist: Array  # (7,) x y z [m] qx qy qz qw
    joints: Array  # (n,) [rad]
    targets: Array  # (m, 3) [m]
    gains: Array  # (m,) [N/m]
    c: Array  # (m,)
    joints_contact: Array | None = None  # (n,) [rad]
    arm: Array | None = None  # (3, a) [rad], of an arm at the pregrasp, at the stand-off and lifted


def posture(hand: Hand, at: AtContact, seed: tuple[Array, Array], x: Array, c: float) -> Posture:
    """The posture of scaled variables x (nx,) relative to a seed pose (wrist (7), joints (n)); `c` applies if c is
    fixed.

    The formulation's own variables are ignored.
    """
    n, m = len(hand.joint_names), len(hand.fingers)
    units = variable_units(hand)
    shared, added = x[: len(units)] * units, x[len(units) :]
    tangent, targets, gains = np.split(shared, [6 + n, 6 + n + 3 * m])
    own, added = (added[:m], added[m:]) if at.c else (np.full(m, c), added)
    wrist, joints = integrate(hand, *seed, tangent)
    contact, added = (added[:n], added[n:]) if at.joints else (None, added)
    a = len(hand.arm.joint_names) if hand.arm else 0
    arm = UNIT * added[: POSTURES * a].reshape(POSTURES, a) if a and len(added) else None
    return Posture(wrist, joints, targets.reshape(m, 3), gains, own, contact, arm)
