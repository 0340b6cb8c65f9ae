"""A grasp in the form that a robot needs."""

from dataclasses import dataclass
from math import inf
from numbers import Integral, Real
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.brief import brief
from sgnlp.base.checked import plain, require_fields
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import TIPS_OFF, tips_off
from sgnlp.hand.model import check_unit

NEEDED = ("wrist", "joints", "tips", "targets", "gains")
ARRAYS = (*NEEDED, "joints_contact", "joints_squeeze", "contacts_eq", "forces_eq", "rotation_eq", "translation_eq")
"""The fields of a command that are arrays; all but the needed ones may be None."""
FARTHEST = 1.0
"""[m] No finger pulls to a target farther from its tip than this."""


@dataclass(frozen=True, eq=False)
class Command:
    """Pregrasp, targets and gains of m fingers in the world frame, and the outcome that the plan expects.

    Lists of numbers are taken for arrays. A command with `joint_names` was planned, and fits the planned hand alone.

    Raises:
        InputError: an array does not hold numbers.
    """

    __repr__ = brief

    wrist: Array  # (7,) pose of the root link, x y z [m] qx qy qz qw
    joints: Array  # (n,) [rad], in the order of the hand's joint_names
    tips: Array  # (m, 3) [m], tip centres at the pregrasp, where the setpoints of the springs begin
    targets: Array  # (m, 3) [m], where they end
    gains: Array  # (m,) [N/m]
    joints_contact: Array | None = None  # (n,) [rad] at first contact; None: nothing holds the posture
    joints_squeeze: Array | None = None  # (n,) [rad], where position control ends
    closing_seconds: float = 1.0  # [s], duration of the setpoints' motion; 0: they jump
    # [N m/rad], stiffness of the spring to `joints_contact`, in joint motions that do not move a tip
    posture: float = 0.0
    joint_stiffness: float = 1.0  # [N m/rad] under position control
    contacts_eq: Array | None = None  # (m, 3) [m] tips at the equilibrium
    forces_eq: Array | None = None  # (m, 3) [N], on the object
    rotation_eq: Array | None = None  # (3, 3), motion of the object to the equilibrium
    translation_eq: Array | None = None  # (3,) [m]
    joint_names: tuple[str, ...] | None = None  # (n,) of the hand that the grasp was planned for; None: not known

    def __post_init__(self) -> None:
        """Make the arrays of lists."""
        object.__setattr__(self, "joint_names", plain(self.joint_names))
        require_fields(self, "the grasp", ("joint_names",))
        for name in ARRAYS:
            value = getattr(self, name)
            if value is None and name not in NEEDED:
                continue
            try:
                object.__setattr__(self, name, np.asarray(value, float))
            except (TypeError, ValueError):
                raise InputError(f"the grasp's {name} must be an array of numbers, not {value!r}") from None


def command(grasps: Any, index: int = 0) -> Command:
    """The command of the grasp with rank `index` (0 is the best) of `sgnlp.Grasps`.

    Raises:
        InputError: there is no grasp of this rank, or `grasps` is something else, such as a plan.
    """
    if not hasattr(grasps, "tips_pregrasp"):
        raise InputError("command takes sgnlp.load_grasps(folder) or plan.arrays()")
    count = len(grasps.wrist)
    if not isinstance(index, Integral) or index not in range(count):
        ranks = f", of ranks 0 to {count - 1}" if count else ""
        raise InputError(f"there is no grasp of rank {index}: the result has {count} grasp{'s' * (count != 1)}{ranks}")
    closing = Settings.restored(grasps.meta["settings"]).closing
    names = ("wrist", "joints", "targets", "gains", "contacts_eq", "forces_eq", "rotation_eq", "translation_eq")
    return Command(
        **{name: getattr(grasps, name)[index] for name in (*names, "joints_contact", "joints_squeeze")},
        tips=grasps.tips_pregrasp[index],
        closing_seconds=closing.seconds,
        posture=closing.posture,
        joint_stiffness=closing.joint_stiffness,
        joint_names=tuple(map(str, grasps.joint_names)),
    )


def check(command: Command, hand: Hand) -> None:
    """Raise `InputError` naming the first part of a command that does not fit the hand or makes no sense."""
    n, m = len(hand.joint_names), len(hand.fingers)
    shapes = {"wrist": (7,), "joints": (n,), "tips": (m, 3), "targets": (m, 3), "gains": (m,)}
    planned = {"joints_contact": (n,), "joints_squeeze": (n,)}
    shapes |= {name: shape for name, shape in planned.items() if getattr(command, name) is not None}
    for name, shape in shapes.items():
        array = getattr(command, name)
        if array.shape != shape or not np.isfinite(array).all():
            raise InputError(f"the grasp's {name} must be {shape} finite numbers for '{hand.name}', not {array.shape}")
    check_unit(command.wrist, "the grasp's wrist")
    away = float(np.linalg.norm(command.targets - command.tips, axis=1).max())
    if away > FARTHEST:
        said = f"a target is {away:.3g} m from its tip, more than {FARTHEST:g} m"
        raise InputError(f"the grasp's targets: {said}; are both in metres, in the world?")
    if np.min(command.gains) <= 0:
        raise InputError("the grasp's gains must be positive")
    for name in ("closing_seconds", "posture", "joint_stiffness"):
        value = getattr(command, name)
        if not (isinstance(value, Real) and 0 <= float(value) < inf):
            raise InputError(f"the grasp's {name} must be a finite number and not negative, not {value!r}")
    _check_planned(command, hand)


def _check_planned(command: Command, hand: Hand) -> None:
    """Raise `InputError` if the grasp was planned for another hand: by its joints' names, or by where its tips are.

    Both Allegro hands have the same names.
    """
    if command.joint_names is None:
        return
    if tuple(command.joint_names) != hand.joint_names:
        theirs, ours = (", ".join(names) for names in (command.joint_names, hand.joint_names))
        raise InputError(f"the grasp is of another hand than '{hand.name}': its joints are {theirs}; valid: {ours}")
    off = tips_off(hand, command.wrist, command.joints, command.tips)
    if off > TIPS_OFF:
        raise InputError(
            f"the grasp is of another hand than '{hand.name}': a tip is {1e3 * off:.0f} mm off; load the hand "
            'that was planned for, grasps.meta["hand"]'
        )
