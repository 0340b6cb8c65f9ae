"""What a robot computes in each cycle of its control: setpoints that ramp, and torques that move no fingertip."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FREE_LENGTH = 1e-3
"""λ [m/rad]: joints that move no tip by more than this for each radian are free. A finger's smallest singular value is
some 3 cm/rad, so a thousandth of a torque is left at the tips; where a finger is stretched, nothing blows up."""


def ramped(begin: Array, end: Array, time: float, seconds: float) -> Array:
    """The setpoint at a time [s]: linear from `begin` to `end` in so many seconds, then `end`. 0 s is a jump."""
    return end if time >= seconds else begin + time / seconds * (end - begin)


def null_space(J: Array) -> Array:
    """N = I - Jᵀ (J Jᵀ + λ² I)⁻¹ J (n, n) of the tips' Jacobian (3m, n): what of a torque makes no force at the tips.

    The projector of damped least squares (Nakamura and Hanafusa 1986). Where fingers share no joint, each has its own.
    """
    return np.asarray(np.eye(J.shape[1]) - J.T @ np.linalg.solve(J @ J.T + FREE_LENGTH**2 * np.eye(len(J)), J))


def posture_torque(N: Array, error: Array, speed: Array, stiffness: float, damping: float) -> Array:
    """τ = N (k (q* - q) - d q̇) (n,) [N m], with `error` q* - q [rad] and `speed` q̇ [rad/s] of the hand's own joints."""
    return np.asarray(N @ (stiffness * error - damping * speed))


def critical(stiffness: float, inertia: float) -> float:
    """The damping 2√(k I) at which a spring k [N m/rad] brings an inertia I [kg m²] to rest without overshoot."""
    return float(2 * np.sqrt(stiffness * inertia))
