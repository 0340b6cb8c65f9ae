"""A trajectory: setpoints of wrist, joints and springs at each sample, and the results of its checks."""

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array, IntArray, StrArray
from sgnlp.base.brief import brief
from sgnlp.base.checked import Typed
from sgnlp.base.errors import unknown
from sgnlp.program.constraint import Check

APPROACH, CLOSE, SQUEEZE, LIFT = PHASES = ("approach", "close", "squeeze", "lift")
"""The phases in their order. A sample where two meet belongs to the earlier one."""
BETWEEN = ": "
"""Separates phase and subject in the name of a check."""


@dataclass(frozen=True, eq=False)
class Trajectory(Typed):
    """T samples of a hand with n joints and m fingers, on an arm with a joints or none (a = 0), in the world frame."""

    called = "a trajectory"
    __repr__ = brief

    times: Array  # (T,) [s], from 0
    phase: StrArray  # (T,), of `PHASES`
    wrist: Array  # (T, 7) pose of the hand's root link, x y z [m] qx qy qz qw
    joints: Array  # (T, n) [rad], setpoints under position control
    arm: Array  # (T, a) [rad]
    setpoints: Array  # (T, m, 3) [m], where the springs of the fingertips end, under impedance control
    gains: Array  # (m,) [N/m], stiffness of these springs
    joint_names: StrArray  # (n,)
    arm_joint_names: StrArray  # (a,)
    finger_names: StrArray  # (m,)
    checks: tuple[Check, ...]
    meta: dict[str, Any]  # object, hand, digests of cloud and plan, rank and start of the grasp, name of the frame

    def __len__(self) -> int:
        return len(self.times)

    @property
    def clear(self) -> bool:
        """Whether every check passes."""
        return all(check.passed for check in self.checks)

    @property
    def seconds(self) -> float:
        """Duration of the whole motion [s]."""
        return float(self.times[-1])

    @property
    def velocities(self) -> Array:
        """Velocities of the arm's joints, then the hand's, (T, a + n) [rad/s]: central differences, 0 at ends of
        phases."""
        positions = np.hstack([self.arm, self.joints])
        found = np.gradient(positions, self.times, axis=0)
        found[self.ends] = 0.0
        return np.asarray(found)

    @property
    def ends(self) -> IntArray:
        """Indices of the first sample, and of the last sample of each phase."""
        return np.array([0, *(self.last(phase) for phase in PHASES)])

    def last(self, phase: str) -> int:
        """Index of the last sample of a phase: approach, close, squeeze or lift."""
        if phase not in PHASES:
            raise unknown("phase of a motion", phase, PHASES)
        return int(np.flatnonzero(self.phase == phase)[-1])

    def phase_seconds(self) -> dict[str, float]:
        """Duration of each phase [s]."""
        return dict(zip(PHASES, np.diff(self.times[self.ends]).tolist(), strict=True))

    def told(self) -> list[str]:
        """Lines of text: the durations, the least clearances, and what blocks the motion."""
        spans = ", ".join(f"{name} {span:.1f}" for name, span in self.phase_seconds().items())
        least: dict[str, Check] = {}
        for check in (check for check in self.checks if check.lower > -inf):
            what = check.name.partition(BETWEEN)[2]
            least[what] = min(least.get(what, check), check, key=lambda c: c.value)
        near = "; ".join(f"{what} {_rounded(c)} ({c.name.partition(BETWEEN)[0]})" for what, c in least.items())
        blocked = [_blocked(check) for check in self.checks if not check.passed]
        return [f"motion: {self.seconds:.1f} s: {spans}", f"least clearances of the motion [mm]: {near}", *blocked]


def _rounded(check: Check) -> str:
    return f"{round(check.value, 1) + 0.0:.1f}"


def _blocked(check: Check) -> str:
    phase, _, what = check.name.partition(BETWEEN)
    value = f"{_rounded(check)} {check.unit}"
    return f"the motion is not clear in the {phase}: {what}, {check.row}: {value}, must be {check.demand}"
