"""The end of a solver as the start of a slightly different program."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.solver import Multipliers
from sgnlp.planning.starts import Start
from sgnlp.program.nlp import Nlp
from sgnlp.program.variables import UNITS
from sgnlp.surface.registration import PlanarMotion

VECTORS = ("tip", "axis")
"""Entities of constraints whose rows are vectors in the world frame: all x components, then y, then z."""


@dataclass(frozen=True, eq=False)
class WarmStart:
    """The start of a solver, its last x (nx,) relative to that start's pose, and its multipliers."""

    start: Start
    x: Array
    multipliers: Multipliers | None

    def moved(self, nlp: Nlp, motion: PlanarMotion) -> "WarmStart":
        """The same grasp after object and hand have moved together, in the same program.

        The wrist's tangent is in the wrist's own frame. So only the targets in x change, and the multipliers of rows
        that are vectors in the world. An arm begins where it was.
        """
        n, m, unit = len(nlp.hand.joint_names), len(nlp.hand.fingers), UNITS["target"]
        targets, x = slice(6 + n, 6 + n + 3 * m), self.x.copy()
        x[targets] = motion(unit * x[targets].reshape(m, 3)).ravel() / unit
        wrist, start = pin.XYZQUATToSE3(self.start.wrist), self.start
        moved = pin.SE3(motion.rotation @ wrist.rotation, motion(np.asarray(wrist.translation)))
        start = replace(start, wrist=np.asarray(pin.SE3ToXYZQUAT(moved)), targets=motion(start.targets))
        lam = self.multipliers
        return WarmStart(start, x, lam and (lam[0], _turned(nlp, motion.rotation, lam[1])))


def _turned(nlp: Nlp, rotation: Array, lam: Array) -> Array:
    """The multipliers of rows (ng,), those of vectors turned by a rotation (3, 3)."""
    parts = np.split(lam, np.cumsum(nlp.row_sizes)[:-1])
    vectors = (c.over in VECTORS and len(part) % 3 == 0 for c, part in zip(nlp.constraints, parts, strict=True))
    turned = (rotation @ part.reshape(3, -1) if v else part for v, part in zip(vectors, parts, strict=True))
    return np.concatenate([part.ravel() for part in turned])
