"""The computation of each control cycle: joint torques from time, wrist pose and joints."""

from math import isfinite
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sgnlp.base.arrays import Array
from sgnlp.base.checked import require
from sgnlp.base.errors import InputError
from sgnlp.control.command import Command, check
from sgnlp.control.law import Law, critical, freed, joint_torque, ramped, spring_forces
from sgnlp.control.tree import Tree
from sgnlp.hand.hand import Hand
from sgnlp.hand.model import check_unit

IMPEDANCE = Law()


class Controller:
    """Carries out the grasp of a command; n joints of the hand's own, in the order of its `joint_names`, m fingers.

    The targets are fixed to the wrist: they were planned in the world for the command's wrist pose, and move with the
    wrist from there on. So the law works in the frame of the root link, and damps the tips' motion in that frame. The
    wrist's position and speed do not enter. Its orientation gives the direction of gravity.
    """

    def __init__(self, hand: Hand, command: Command, law: Law = IMPEDANCE) -> None:
        """Raise `InputError` if the grasp does not fit this hand, or lacks the joints that position control needs."""
        require("hand", hand, Hand)
        require("command", command, Command)
        require("law", law, Law)
        check(command, hand)
        self.hand, self.command, self.law, self.tree = hand, command, law, Tree(hand)
        self.begin, self.end = _ends(command, law)
        """The first and the last setpoints, as `setpoints` returns them."""
        self._damping = critical(command.gains, law.tip_mass)
        self._gravity = np.array(law.gravity)
        held = command.posture > 0 and command.joints_contact is not None
        self.posture = command.joints_contact if held else None
        """The joints (n,) of the posture spring; None without one."""

    def setpoints(self, time: float) -> Array:
        """The setpoints at a time [s] since the start of closing.

        Setpoints of the tips (m, 3) [m] in the root link's frame, or of the joints (n,) under position control.
        """
        require("time", time, float)
        if not isfinite(time):
            raise InputError(f"time must be a finite number of seconds, not {time}")
        return ramped(self.begin, self.end, time, self.command.closing_seconds)

    def torques(self, time: float, wrist: ArrayLike, joints: ArrayLike, speeds: ArrayLike) -> Array:
        """The torques (n,) [N m or N] of the hand's own joints at a time [s] since the start of closing.

        τ = Σ J_iᵀ (k_i (s_i(t) - a_i) - d_i ȧ_i) + N (k_q (q* - q) - d_q q̇) + ∂U/∂q, within the effort of each joint.
        Under position control a spring in each joint replaces the first two parts. `wrist` (7,) is the pose of the root
        link in the world, x y z [m] qx qy qz qw, `joints` (n,) [rad or m] and `speeds` (n,) [rad/s or m/s]. The same
        arguments give the same torques. Joints or speeds with NaN give torques with NaN.

        Raises:
            InputError: an argument has another shape, or the quaternion is not of norm 1.
        """
        n = len(self.hand.joint_names)
        wrist, joints, speeds = _vector(wrist, 7, "wrist"), _vector(joints, n, "joints"), _vector(speeds, n, "speeds")
        check_unit(wrist, "the wrist")
        springs = self._joint_springs if self.law.control == "position" else self._tip_springs
        torques = springs(time, joints, speeds)
        if self._gravity.any():
            down = pin.Quaternion(wrist[3:]).normalized().toRotationMatrix().T @ self._gravity
            torques = torques + self.tree.weight(joints, down)
        return np.clip(torques, -self.hand.effort, self.hand.effort)

    def _tip_springs(self, time: float, joints: Array, speeds: Array) -> Array:
        told = self.command
        tips, J = self.tree.tips(joints)
        forces = spring_forces(self.setpoints(time) - tips, (J @ speeds).reshape(-1, 3), told.gains, self._damping)
        torques = J.T @ forces.ravel()
        if self.posture is None:
            return torques
        damping = critical(told.posture, self.law.joint_inertia)
        return torques + freed(J, joint_torque(self.posture - joints, speeds, told.posture, damping))

    def _joint_springs(self, time: float, joints: Array, speeds: Array) -> Array:
        stiffness = self.command.joint_stiffness
        damping = critical(stiffness, self.law.joint_inertia)
        return joint_torque(self.setpoints(time) - joints, speeds, stiffness, damping)


def _vector(values: Any, size: int, name: str) -> Array:
    """An argument of `torques` as an array (size,)."""
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be ({size},) numbers, not {values!r}") from None
    if array.shape != (size,):
        raise InputError(f"{name} must be ({size},) numbers, not {array.shape}")
    return array


def _ends(command: Command, law: Law) -> tuple[Array, Array]:
    """The first and the last setpoints."""
    if law.control == "position":
        if command.joints_squeeze is None:
            raise InputError("position control needs the command's `joints_squeeze`, which every planned grasp has")
        return command.joints, command.joints_squeeze
    root = pin.SE3(pin.Quaternion(command.wrist[3:]).normalized().toRotationMatrix(), command.wrist[:3])
    begin, end = ((points - root.translation) @ root.rotation for points in (command.tips, command.targets))
    return begin, end
