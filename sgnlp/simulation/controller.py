"""The controller of the fingers: a spring to each target and one that holds the posture, or a spring in each joint."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.errors import InputError
from sgnlp.simulation.command import Command
from sgnlp.simulation.control import critical, null_space, posture_torque, ramped
from sgnlp.simulation.settings import SimulationSettings

Array = NDArray[np.float64]

AXES = "xyz"
MOTOR = "/torque"
"""End of the name of a joint's motor."""


def add_springs(spec: Any, tips: dict[str, str], base: str, gains: Array) -> None:
    """The torques τ = Jᵀ(k (o - p) - 2√k ṗ) of each finger, p its tip as seen from the site `base`.

    The paper's impedance control; 2√k [N s/m] is critical for 1 kg. `tips` has the site of each finger's tip. Each
    finger gets an actuator an axis, finger by finger, whose control is the setpoint's coordinate in the frame of
    `base`. As actuators, MuJoCo integrates the damping implicitly and limits the torque of each joint to its effort.
    """
    import mujoco

    for (finger, tip), k in zip(tips.items(), gains, strict=True):
        for axis, direction in zip(AXES, np.eye(6), strict=False):  # of a force and torque, here no torque
            spring = spec.add_actuator(name=f"{finger}/{axis}")
            spring.trntype = mujoco.mjtTrn.mjTRN_SITE
            spring.target, spring.refsite, spring.gear = tip, base, direction
            _spring(spring, k, 2 * np.sqrt(k))


def add_joint_springs(spec: Any, joints: list[str], stiffness: float, settings: SimulationSettings) -> None:
    """The torque k (q* - q) - d q̇ of each joint: position control, d critical for the rotor, beside its own damping."""
    for joint in joints:
        spring = _on_joint(spec, joint, joint)
        _spring(spring, stiffness, critical(stiffness, settings.joint_armature))


def add_motors(spec: Any, joints: list[str]) -> None:
    """A motor in each joint, whose control is a torque [N m]. Its sum with the springs is limited to the effort."""
    for joint in joints:
        _on_joint(spec, joint, joint + MOTOR)


def holds_posture(command: Command, settings: SimulationSettings) -> bool:
    """Whether a spring holds what the tips leave free."""
    return settings.control == "impedance" and command.joints_contact is not None and command.posture > 0


class Controller:
    """Tells the actuators what to do: `sense` at each sample, `act` at each step of the simulation."""

    def __init__(self, world: Any, command: Command, settings: SimulationSettings) -> None:
        self.world, self.command = world, command
        if settings.control == "position":
            self._begin, self._end = command.joints, _squeeze(command)
        else:
            self._begin, self._end = command.tips.ravel(), command.targets.ravel()
        self._posture = holds_posture(command, settings)
        self._damping = critical(command.posture, settings.joint_armature)
        self._free = np.empty((0, 0))

    def sense(self, data: Any) -> None:
        """See what the tips leave free. It changes slowly, and takes most of the time."""
        if self._posture:
            self._free = null_space(self.world.tip_jacobian(data))

    def act(self, data: Any) -> None:
        """Write setpoints, which are the world's until the lift and then rise with the wrist, and torques."""
        told, count = self.command, len(self._end)
        data.ctrl[:count] = ramped(self._begin, self._end, data.time, told.closing_seconds)
        if self._posture:
            angles, speed = self.world.own_joints(data)
            error = told.joints_contact - angles
            data.ctrl[count:] = posture_torque(self._free, error, speed, told.posture, self._damping)


def _squeeze(command: Command) -> Array:
    if command.joints_squeeze is None:
        raise InputError("--simulation.control position needs a plan of the joints at contact: --closing.planned")
    return command.joints_squeeze


def _on_joint(spec: Any, joint: str, name: str) -> Any:
    import mujoco

    actuator = spec.add_actuator(name=name)
    actuator.trntype, actuator.target, actuator.gear[0] = mujoco.mjtTrn.mjTRN_JOINT, joint, 1.0
    actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_NONE
    actuator.gainprm[0] = 1.0
    return actuator


def _spring(actuator: Any, stiffness: float, damping: float) -> None:
    """Let the actuator pull with stiffness · (control - place) - damping · speed."""
    import mujoco

    actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    actuator.gainprm[0] = stiffness
    actuator.biasprm[:3] = [0.0, -stiffness, -damping]
