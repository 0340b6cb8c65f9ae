"""A grasp as the commands that a robot gets."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sgnlp.planning.grasps import Grasps

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Command:
    """Pregrasp, targets and gains of m fingers in the world frame, and what the plan expects to happen."""

    wrist: Array  # (7,) pose of the root link, x y z [m] qx qy qz qw
    joints: Array  # (n,) [rad], in the order of the hand's joint_names
    targets: Array  # (m, 3) [m]
    gains: Array  # (m,) [N/m]
    forces_eq: Array | None = None  # (m, 3) [N], on the object
    rotation_eq: Array | None = None  # (3, 3), motion of the object to the equilibrium
    translation_eq: Array | None = None  # (3,) [m]


def command(grasps: Grasps, index: int = 0) -> Command:
    """The grasp of that rank, 0 the best."""
    names = ("wrist", "joints", "targets", "gains", "forces_eq", "rotation_eq", "translation_eq")
    return Command(**{name: getattr(grasps, name)[index] for name in names})
