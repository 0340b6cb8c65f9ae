"""The law of the fingers: a spring to each target and one that holds the posture, or a spring in each joint."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.checked import Checked, Positive

FREE_LENGTH = 1e-3
"""λ [m/rad]: joints that move no tip by more than this for each radian are free. A finger's smallest singular value is
some 3 cm/rad, so a thousandth of a torque is left at the tips; where a finger is stretched, nothing blows up."""
WEIGHTLESS = (0.0, 0.0, 0.0)
"""The gravity of a hand whose weight something else bears."""


@dataclass(frozen=True)
class Law(Checked):
    """Which law, and the numbers that belong to the hand and its place and not to a grasp."""

    section = "law"
    control: Literal["impedance", "position"] = "impedance"
    """a spring from each tip to its target; or one in each joint, where a plan knows the joints that squeeze"""
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    """[m/s²] in the world, which the torques bear; `WEIGHTLESS` leaves the weight of the hand to something else"""
    tip_mass: Positive = 1.0
    """[kg] for which the springs of the tips are damped critically (the paper: 2√k)"""
    joint_inertia: Positive = 1e-3
    """[kg m²], of the rotor, for which the springs of joints and posture are damped critically"""


def ramped(begin: Array, end: Array, time: float, seconds: float) -> Array:
    """The setpoint at a time [s]: `begin` before 0, linear to `end` in so many seconds, then `end`. 0 s is a jump."""
    if time < 0.0:
        return begin
    return end if time >= seconds else begin + time / seconds * (end - begin)


def freed(J: Array, torque: Array) -> Array:
    """N τ (n,) [N m], N = I - Jᵀ (J Jᵀ + λ² I)⁻¹ J: what of a torque makes no force at the tips.

    J (3m, n) is the tips' Jacobian. The projector is that of damped least squares (Nakamura and Hanafusa 1986). Where
    fingers share no joint, each has its own.
    """
    return np.asarray(torque - J.T @ np.linalg.solve(J @ J.T + FREE_LENGTH**2 * np.eye(len(J)), J @ torque))


def spring_forces(error: Array, speed: Array, gains: Array, damping: Array) -> Array:
    """F = k (o - a) - d ȧ (m, 3) [N] of the springs, with `error` o - a [m] and `speed` ȧ [m/s] of the tips (m, 3).

    Stiffness `gains` [N/m] and `damping` [N s/m] are (m,). Both are the same in all directions, so that any frame will
    do; `speed` is as seen from the frame of the targets.
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
