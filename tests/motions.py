"""Motions made by hand: straight to a pregrasp from behind the palm, and up."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin

from sgnlp.hand.arm_inverse import reach_all
from sgnlp.hand.hand import Hand
from sgnlp.planning.motion.following import followed
from sgnlp.planning.motion.timing import shares
from sgnlp.planning.motion.trajectory import APPROACH, CLOSE, LIFT, PHASES, SQUEEZE

STEP = 0.02
"""Between samples [s]."""


def motion(hand: Hand, wrist: np.ndarray, standoff=0.06, lift=0.06, seconds=1.0) -> SimpleNamespace:
    """What a trajectory has of wrist and arm; approach and lift take so many `seconds`, the fingers two samples."""
    back = -standoff * (pin.XYZQUATToSE3(wrist).rotation @ hand.palm)
    s = shares(seconds, STEP)[:, None]
    ways = {APPROACH: (1 - s) * back, CLOSE: np.zeros((1, 3)), SQUEEZE: np.zeros((1, 3)), LIFT: s[1:] * [0, 0, lift]}
    poses = {phase: np.hstack([wrist[:3] + way, np.tile(wrist[3:], (len(way), 1))]) for phase, way in ways.items()}
    phase = np.repeat(PHASES, [len(poses[name]) for name in PHASES])
    wrists, arm = np.concatenate([poses[name] for name in PHASES]), np.zeros((len(phase), 0))
    if hand.arm is not None:
        joints = reach_all(hand.arm, wrist, 0, 20)[0]
        coming = followed(hand.arm, joints, poses[APPROACH][::-1])[0][::-1]
        coming[-1] = joints
        arm = np.concatenate([coming, [joints, joints], followed(hand.arm, joints, poses[LIFT])[0]])
    return SimpleNamespace(times=STEP * np.arange(len(phase)), phase=phase, wrist=wrists, arm=arm)
