"""The motors of an MJCF: the joints that they move, and their efforts at these joints."""

from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.hand.description.mjcf_file import compiled
from sgnlp.hand.description.xml_file import read_xml


def efforts(model: Any) -> dict[int, float]:
    """The largest effort [N m or N] by joint of a `mujoco.MjModel`, from its motors and its own limit.

    A motor on a fixed tendon moves each of its joints with its force times the joint's coefficient. Motors without a
    force range are left out, except those whose control is the force.
    """
    found: dict[int, float] = {}
    for motor in range(model.nu):
        if (force := _force(model, motor)) is not None:
            for joint, arm in _arms(model, motor).items():
                found[joint] = found.get(joint, 0.0) + abs(arm) * force
    for joint in map(int, np.flatnonzero(model.jnt_actfrclimited)):
        limit = float(np.abs(model.jnt_actfrcrange[joint]).max())
        found[joint] = min(found.get(joint, limit), limit)
    return found


def shared_motors(file: Path) -> list[list[str]]:
    """For each motor of an MJCF that moves several joints by a fixed tendon, their names; none for a URDF.

    Raises:
        InputError: the file is neither, or cannot be read.
    """
    if read_xml(file).tag != "mujoco":
        return []
    model = compiled(file)[1]
    arms = [_arms(model, motor) for motor in range(model.nu)]
    return [[str(model.joint(joint).name) for joint in joints] for joints in arms if len(joints) > 1]


def _force(model: Any, motor: int) -> float | None:
    """The largest force of a motor before its gear; None if the file gives no bound."""
    import mujoco

    if model.actuator_forcelimited[motor]:
        return float(np.abs(model.actuator_forcerange[motor]).max())
    direct = model.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_NONE
    if direct and model.actuator_gaintype[motor] == mujoco.mjtGain.mjGAIN_FIXED and model.actuator_ctrllimited[motor]:
        return float(abs(model.actuator_gainprm[motor][0]) * np.abs(model.actuator_ctrlrange[motor]).max())
    return None


def _arms(model: Any, motor: int) -> dict[int, float]:
    """By joint, the motor's motion for a unit of the joint: its gear, times the coefficient in a fixed tendon."""
    import mujoco

    kind = mujoco.mjtTrn(model.actuator_trntype[motor])  # of the plain numbers, `in` finds none among the names
    target, gear = int(model.actuator_trnid[motor][0]), model.actuator_gear[motor]
    if kind in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT):
        return {target: float(gear[0])}
    if kind != mujoco.mjtTrn.mjTRN_TENDON:
        return {}
    wraps = range(model.tendon_adr[target], model.tendon_adr[target] + model.tendon_num[target])
    joints = [w for w in wraps if model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT]
    return {int(model.wrap_objid[w]): float(gear[0] * model.wrap_prm[w]) for w in joints}
