"""How a hand opens and closes, in the frame of its root link: the same for every pose of its wrist.

From the reference posture each tip a_i goes along the straight line to the middle b between the last finger, which
opposes the others, and theirs, as near to it as the joints can: a step of the joints is the least-squares solution of
J dq = ±s u_i, u_i = (b - a_i)/|b - a_i|.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import tip_jacobian, tips
from sgnlp.hand.opening import ORIGIN

STEP = 0.006
"""Way of a tip from one posture to the next [m]: half a pad."""
OPENED, CLOSED = 5, 10
"""Steps from the reference to the widest posture, and to the most closed one: there the tips of most hands meet."""
DAMPING = 0.01
"""Cost of a step of the joints [m/rad]: singular postures lie on the way."""
HARDLY = 0.015
"""A direction in which a radian moves a tip by less than this [m] counts as one in which the joints cannot move it."""
NUDGES = 5
"""Newton steps to a posture near a known one."""


@dataclass(frozen=True, eq=False)
class Closing:
    """K postures of a hand with m fingers and n joints, from the widest one on."""

    joints: Array  # (K, n) [rad or m]
    tips: Array  # (K, m, 3) [m]
    spans: Array  # (K, m, 3, 3), projections on the directions in which the joints can move each tip
    own: Array  # (m, n), whether a joint moves a tip

    @property
    def middle(self) -> Array:
        """The middle (3,) [m] between the last tip and those of the others at the reference."""
        return _middle(self.tips[OPENED])

    def between(self, places: Array) -> Array:
        """The joints (n,) with each finger at its own place (m,), a number of steps, on the way.

        Where a joint moves several fingers, the first of them decides.
        """
        joints = np.zeros(self.own.shape[1])
        for place, own in reversed(list(zip(places, self.own, strict=True))):
            low = min(int(place), len(self.joints) - 2)
            way = self.joints[low] + (place - low) * (self.joints[low + 1] - self.joints[low])
            joints = np.where(own, way, joints)
        return np.where(self.own.any(axis=0), joints, self.joints[OPENED])


@lru_cache(maxsize=8)
def closing(hand: Hand) -> Closing:
    """The way of a hand."""
    begin, m = tips(hand, ORIGIN, hand.reference), len(hand.fingers)
    towards = _middle(begin) - begin
    towards = STEP * towards / np.linalg.norm(towards, axis=1, keepdims=True)
    postures = [*_way(hand, -towards, OPENED)[::-1], hand.reference, *_way(hand, towards, CLOSED)]
    jacobians = np.array([tip_jacobian(hand, ORIGIN, joints).reshape(m, 3, -1) for joints in postures])
    left, sizes, _ = np.linalg.svd(jacobians, full_matrices=False)
    spans = np.einsum("kmir,kmr,kmjr->kmij", left, sizes > HARDLY, left)
    own = np.abs(jacobians).max(axis=(0, 2)) > 0
    return Closing(np.array(postures), np.array([tips(hand, ORIGIN, q) for q in postures]), spans, own)


def nudged(hand: Hand, wrist: Array, joints: Array, points: Array) -> Array:
    """The joints (n,) near given ones that bring the tips near points (m, 3) [m], for a fixed wrist (7,)."""
    for _ in range(NUDGES):
        joints = _stepped(hand, wrist, joints, points - tips(hand, wrist, joints))
    return joints


def _middle(tips: Array) -> Array:
    return np.asarray(tips[:-1].mean(axis=0) + tips[-1]) / 2


def _way(hand: Hand, steps: Array, count: int) -> list[Array]:
    """The postures after 1 to `count` steps (m, 3) [m] of the tips from the reference."""
    postures = [hand.reference]
    for _ in range(count):
        postures.append(_stepped(hand, ORIGIN, postures[-1], steps))
    return postures[1:]


def _stepped(hand: Hand, wrist: Array, joints: Array, steps: Array) -> Array:
    """The joints (n,) after a step (m, 3) [m] of the tips, within their limits."""
    n = len(joints)
    J = np.vstack([tip_jacobian(hand, wrist, joints), DAMPING * np.eye(n)])
    step = np.linalg.lstsq(J, np.concatenate([steps.ravel(), np.zeros(n)]), rcond=None)[0]
    return np.clip(joints + step, hand.lower, hand.upper)
