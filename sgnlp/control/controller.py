"""What a robot computes in each cycle of its control: joint torques from the time, the wrist and the joints."""

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.control.command import Command, check
from sgnlp.control.law import Law, critical, freed, joint_torque, ramped, spring_forces
from sgnlp.control.tree import Tree
from sgnlp.hand.hand import Hand

IMPEDANCE = Law()


class Controller:
    """Carries out the grasp of a command; n joints of the hand's own, in the order of its `joint_names`, m fingers.

    The targets are fixed to the wrist: they were planned in the world for the wrist of the command, and wherever the
    wrist then goes, they go with it. So the law works in the frame of the root link. The tips' damping is against
    their motion in that frame, and neither place nor speed of the wrist enter; its orientation says where down is.
    """

    def __init__(self, hand: Hand, command: Command, law: Law = IMPEDANCE) -> None:
        """Raise `InputError` where the grasp is not one of this hand, or has no joints that squeeze and needs them."""
        check(command, hand)
        self.hand, self.command, self.law, self.tree = hand, command, law, Tree(hand)
        self.begin, self.end = _ends(command, law)
        """The first setpoints and the last, as `setpoints` has them."""
        self._damping = critical(np.asarray(command.gains, float), law.tip_mass)
        self._gravity = np.array(law.gravity)
        held = command.posture > 0 and command.joints_contact is not None
        self.posture = np.asarray(command.joints_contact, float) if held else None
        """The joints (n,) that a spring holds in what the tips leave free; None where none does."""

    def setpoints(self, time: float) -> Array:
        """The setpoints at a time [s] from the begin of closing.

        Those of the tips (m, 3) [m] in the frame of the root link, or of the joints (n,) under position control.
        """
        return ramped(self.begin, self.end, time, self.command.closing_seconds)

    def torques(self, time: float, wrist: Array, joints: Array, speeds: Array) -> Array:
        """The torques (n,) [N m or N] of the hand's own joints at a time [s] from the begin of closing.

        τ = Σ J_iᵀ (k_i (o_i - a_i) - d_i ȧ_i) + posture + weight, within the effort of each joint; under position
        control a spring in each joint stands for the first two. `wrist` (7,) is the pose of the root link in the world,
        `joints` (n,) [rad or m] and `speeds` (n,) [rad/s or m/s]. The same arguments give the same torques.
        """
        springs = self._joint_springs if self.law.control == "position" else self._tip_springs
        torques = springs(time, joints, speeds)
        if self._gravity.any():
            down = pin.XYZQUATToSE3(np.asarray(wrist, float)).rotation.T @ self._gravity
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


def _ends(command: Command, law: Law) -> tuple[Array, Array]:
    """The first setpoints and the last."""
    if law.control == "position":
        if command.joints_squeeze is None:
            raise InputError("position control needs a plan of the joints at contact: --closing.planned")
        return np.asarray(command.joints, float), np.asarray(command.joints_squeeze, float)
    root = pin.XYZQUATToSE3(np.asarray(command.wrist, float))
    begin, end = ((points - root.translation) @ root.rotation for points in (command.tips, command.targets))
    return begin, end
