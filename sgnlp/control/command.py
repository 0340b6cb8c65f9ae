"""A grasp in the form that a robot needs."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand


@dataclass(frozen=True, eq=False)
class Command:
    """Pregrasp, targets and gains of m fingers in the world frame, and the outcome that the plan expects."""

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


def command(grasps: Any, index: int = 0) -> Command:
    """The command of the grasp with rank `index` (0 is the best) of `sgnlp.Grasps`."""
    closing = Settings.restored(grasps.meta["settings"]).closing
    names = ("wrist", "joints", "targets", "gains", "contacts_eq", "forces_eq", "rotation_eq", "translation_eq")
    return Command(
        **{name: getattr(grasps, name)[index] for name in (*names, "joints_contact", "joints_squeeze")},
        tips=grasps.tips_pregrasp[index],
        closing_seconds=closing.seconds,
        posture=closing.posture,
        joint_stiffness=closing.joint_stiffness,
    )


def check(command: Command, hand: Hand) -> None:
    """Raise `InputError` naming the first array of a command that does not fit the hand or is not finite."""
    n, m = len(hand.joint_names), len(hand.fingers)
    shapes = {"wrist": (7,), "joints": (n,), "tips": (m, 3), "targets": (m, 3), "gains": (m,)}
    planned = {"joints_contact": (n,), "joints_squeeze": (n,)}
    shapes |= {name: shape for name, shape in planned.items() if getattr(command, name) is not None}
    for name, shape in shapes.items():
        array = np.asarray(getattr(command, name))
        if array.shape != shape or not np.isfinite(array).all():
            raise InputError(f"the grasp's {name} must be {shape} finite numbers for '{hand.name}', not {array.shape}")
    if np.min(command.gains) <= 0:
        raise InputError("the grasp's gains must be positive")
