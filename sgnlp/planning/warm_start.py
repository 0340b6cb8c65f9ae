"""Where a solver ended, as the beginning of a program that is a little different."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.planning.solvers.solver import Multipliers
from sgnlp.planning.starts import Start
from sgnlp.program.variables import UNITS
from sgnlp.surface.registration import PlanarMotion


@dataclass(frozen=True, eq=False)
class WarmStart:
    """The start that a solver began with, its last x (nx,) about that start's pose, and its multipliers."""

    start: Start
    x: Array
    multipliers: Multipliers | None

    def moved(self, hand: Hand, motion: PlanarMotion) -> "WarmStart":
        """The same grasp of an object that has moved, and the hand with it.

        The wrist's tangent stands in the wrist's own frame, so that of all x the targets alone are others. An arm
        begins where it was.
        """
        n, m, unit = len(hand.joint_names), len(hand.fingers), UNITS["target"]
        targets, x = slice(6 + n, 6 + n + 3 * m), self.x.copy()
        x[targets] = motion(unit * x[targets].reshape(m, 3)).ravel() / unit
        wrist, start = pin.XYZQUATToSE3(self.start.wrist), self.start
        moved = pin.SE3(motion.rotation @ wrist.rotation, motion(np.asarray(wrist.translation)))
        start = replace(start, wrist=np.asarray(pin.SE3ToXYZQUAT(moved)), targets=motion(start.targets))
        return WarmStart(start, x, self.multipliers)
