"""The control law of the fingers: a spring to each target and one for the posture, or a spring in each joint."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.checked import Checked, Positive
from sgnlp.base.errors import InputError

FREE_LENGTH = 1e-3
"""λ [m/rad]: joint motions that move the tips by less than this for each radian count as free. A finger's smallest
singular value is about 3 cm/rad, so a thousandth of a torque remains at the tips. Near a stretched finger, N stays
finite."""
WEIGHTLESS = (0.0, 0.0, 0.0)
"""The gravity of a hand whose weight is compensated elsewhere."""


@dataclass(frozen=True)
class Law(Checked):
    """The kind of law, and its numbers that belong to the hand and not to a grasp."""

    section = "law"
    control: Literal["impedance", "position"] = "impedance"
    """impedance: a spring from each tip to its target; position: a spring in each joint, to the plan's
    joints_squeeze"""
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    """[m/s²] in the world, compensated by the torques; `WEIGHTLESS` if the hand's weight is compensated elsewhere"""
    tip_mass: Positive = 1.0
    """[kg] mass for which the tips' springs are critically damped (paper: 2√k, which is 1 kg)"""
    joint_inertia: Positive = 1e-3
    """[kg m²] rotor inertia for which the springs of joints and posture are critically damped"""

    def __post_init__(self) -> None:
        """Raise `InputError` naming the first field whose value is not valid."""
        try:
            gravity = tuple(float(each) for each in self.gravity)
        except (TypeError, ValueError):
            gravity = ()
        if len(gravity) != len(WEIGHTLESS):
            raise InputError(f"--law.gravity must be three numbers [m/s²], x y z, not {self.gravity!r}")
        object.__setattr__(self, "gravity", gravity)
        super().__post_init__()


def ramped(begin: Array, end: Array, time: float, seconds: float) -> Array:
    """The setpoint at a time [s]: `begin` before 0, linear to `end` over `seconds`, then `end`. 0 s is a jump."""
    if time < 0.0:
        return begin
    return end if time >= seconds else begin + time / seconds * (end - begin)


def freed(J: Array, torque: Array) -> Array:
    """N τ (n,) [N m], N = I - Jᵀ (J Jᵀ + λ² I)⁻¹ J: the part of a torque that makes no force at the tips.

    J (3m, n) is the tips' Jacobian. The projector is that of damped least squares (Nakamura and Hanafusa 1986). If
    fingers share no joint, it splits into one for each finger.
    """
    return np.asarray(torque - J.T @ np.linalg.solve(J @ J.T + FREE_LENGTH**2 * np.eye(len(J)), J @ torque))


def spring_forces(error: Array, speed: Array, gains: Array, damping: Array) -> Array:
    """F = k (o - a) - d ȧ (m, 3) [N] of the springs, with `error` o - a [m] and `speed` ȧ [m/s] of the tips (m, 3).

    Stiffness `gains` [N/m] and `damping` [N s/m] are (m,). Both are isotropic, so any frame may be used; `speed` is
    relative to the frame of the targets.
    """
    return np.asarray(gains[:, None] * error - damping[:, None] * speed)


def joint_torque(error: Array, speed: Array, stiffness: float, damping: float) -> Array:
    """τ = k (q* - q) - d q̇ (n,) [N m] of a spring in each joint, with `error` q* - q [rad] and `speed` q̇ [rad/s]."""
    return np.asarray(stiffness * error - damping * speed)


def critical(stiffness: Any, inertia: float) -> Any:
    """The damping 2√(k I) at which springs k bring an inertia to rest without overshoot.

    N m/rad and kg m² give N m s/rad, N/m and kg give N s/m. A number gives a number, an array an array.
    """
    return 2 * np.sqrt(stiffness * inertia)
