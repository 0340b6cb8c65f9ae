"""Commands and states of hands, drawn at random, for their controllers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.control.command import Command
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import tips


def pose(rng: np.random.Generator) -> np.ndarray:
    """A pose (7,) of a wrist."""
    turn = rng.normal(size=4)
    return np.concatenate([rng.uniform(-0.5, 0.5, 3), turn / np.linalg.norm(turn)])


def inside(hand: Hand, rng: np.random.Generator) -> np.ndarray:
    """Joints (n,) well inside their limits."""
    return hand.lower + rng.uniform(0.25, 0.75, len(hand.lower)) * (hand.upper - hand.lower)


def aimed(hand: Hand, seed: int = 0, **changes: Any) -> Command:
    """A command whose targets are 2 cm off its tips in any direction, and whose joints close in 0.5 s."""
    rng = np.random.default_rng(seed)
    wrist, joints = pose(rng), inside(hand, rng)
    begin = tips(hand, wrist, joints)
    way = rng.normal(size=begin.shape)
    told = Command(
        wrist=wrist,
        joints=joints,
        tips=begin,
        targets=begin + 0.02 * way / np.linalg.norm(way, axis=1, keepdims=True),
        gains=rng.uniform(50.0, 300.0, len(begin)),
        joints_contact=joints + rng.uniform(-0.2, 0.2, len(joints)),
        joints_squeeze=joints + rng.uniform(-0.3, 0.3, len(joints)),
        closing_seconds=0.5,
        posture=0.1,
        joint_stiffness=2.0,
    )
    return replace(told, **changes)


def carried(wrist: np.ndarray, motion: pin.SE3) -> np.ndarray:
    """The pose (7,) of a wrist that a motion of the world has moved."""
    return pin.SE3ToXYZQUAT(motion * pin.XYZQUATToSE3(wrist))
