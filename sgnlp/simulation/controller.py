"""The controller of the fingers: a spring to each target."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

AXES = "xyz"


def add_springs(spec: Any, tips: dict[str, str], base: str, gains: Array) -> None:
    """The torques τ = Jᵀ(k (o - p) - 2√k ṗ) of each finger, p its tip as seen from the site `base`.

    The paper's impedance control; 2√k [N s/m] is critical for 1 kg. `tips` has the site of each finger's tip. Each
    finger gets an actuator an axis, finger by finger, whose control is the target's coordinate in the frame of
    `base`. As actuators, MuJoCo integrates the damping implicitly and limits the torque of each joint to its effort.
    """
    import mujoco

    for (finger, tip), k in zip(tips.items(), gains, strict=True):
        for axis, direction in zip(AXES, np.eye(6), strict=False):  # of a force and torque, here no torque
            spring = spec.add_actuator(name=f"{finger}/{axis}")
            spring.trntype = mujoco.mjtTrn.mjTRN_SITE
            spring.target, spring.refsite, spring.gear = tip, base, direction
            spring.gaintype, spring.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
            spring.gainprm[0] = k
            spring.biasprm[:3] = [0.0, -k, -2 * np.sqrt(k)]
