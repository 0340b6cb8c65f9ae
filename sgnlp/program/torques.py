"""Joint torques of forces at the fingertips, τ = Jᵀf, with J to second order in the joints.

With the joints j ≤ k ≤ l of a finger from the root on and the columns J_j = a_j × (p - o_j), or a_j along a prismatic
joint, of its Jacobian:

    ∂J_j/∂δ_k = ∂J_k/∂δ_j = a_j × J_k,     ∂²J_j/∂δ_k∂δ_l = a_j × (a_k × J_l),     0 for a prismatic joint j

So no third derivative of the forward kinematics is needed. The turn of the wrist enters through the forces, which are
expressed in the hand's frame.
"""

from collections.abc import Iterator, Sequence
from functools import reduce
from itertools import combinations_with_replacement

import casadi as ca
import pinocchio as pin

from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import Frames
from sgnlp.program.lifting import Lifting

ORDERS = (1, 2, 3)
"""Numbers of joints that a column and its first and second derivatives refer to."""


class TipTorques:
    """The torques of a hand's joints, which are displaced by `turns` (n,) from its frames."""

    def __init__(self, hand: Hand, frames: Frames, turns: ca.SX, lifting: Lifting):
        self._model, self._turns = hand.model, turns
        self._fingers = [_joints(hand.model, finger.frame) for finger in hand.fingers]
        known = [list(_derivatives(frames, joints, frames.tips[i, :])) for i, joints in enumerate(self._fingers)]
        held = lifting.constant("columns", ca.vertcat(*[vector for each in known for _, vector in each]))
        rows = iter(ca.vertsplit(held))
        self._columns = [{which: next(rows) for which, _ in each} for each in known]

    def __call__(self, felt: ca.SX) -> ca.SX:
        """Σ Jᵀf (n,) [N m] for forces (m, 3) [N], expressed in the hand's frame."""
        torques = [ca.SX(0)] * self._model.nq
        for i, joints in enumerate(self._fingers):
            for j, joint in enumerate(joints):
                torques[self._model.idx_qs[joint]] += ca.dot(self._column(i, j), felt[i, :])
        return ca.vertcat(*torques)

    def _column(self, finger: int, j: int) -> ca.SX:
        """J_j (1, 3) [m]."""
        joints, known = self._fingers[finger], self._columns[finger]
        delta = [self._turns[self._model.idx_qs[joint]] for joint in joints]
        column = known[(j,)]
        for k in range(len(joints)):
            column = column + delta[k] * known[tuple(sorted((j, k)))]
        for k, l in combinations_with_replacement(range(len(joints)), 2):
            column = column + (0.5 if k == l else 1.0) * delta[k] * delta[l] * known[tuple(sorted((j, k, l)))]
        return column


def _joints(model: pin.Model, link: str) -> list[int]:
    """The joints that move a link, from the root on."""
    frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
    return [joint for joint in model.supports[frame.parentJoint] if joint > 0]


def _derivatives(frames: Frames, joints: Sequence[int], point: ca.SX) -> Iterator[tuple[tuple[int, ...], ca.SX]]:
    """The columns at a point (1, 3) and their derivatives (1, 3), by the joints that they refer to, in order."""
    about = [frames.about[joint - 1, :] for joint in joints]
    arms = [point - frames.pivots[joint - 1, :] for joint in joints]
    columns = [frames.along[joint - 1, :] + ca.cross(a, r) for joint, a, r in zip(joints, about, arms, strict=True)]
    for order in ORDERS:
        for which in combinations_with_replacement(range(len(joints)), order):
            *before, last = which
            yield which, reduce(lambda column, k: ca.cross(about[k], column), before[::-1], columns[last])
