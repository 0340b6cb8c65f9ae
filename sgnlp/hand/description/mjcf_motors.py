"""The motors of an MJCF: which joints they move, and how strong they are there."""

from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.hand.description.mjcf_file import compiled
from sgnlp.hand.description.xml_file import read_xml


def efforts(model: Any) -> dict[int, float]:
    """The largest effort [N m or N] by joint, of a `mujoco.MjModel`: what its motors and its own limit leave.

    A motor that pulls a fixed tendon turns each of its joints with its force times the joint's coefficient. Motors
    without a range of forces are left out, but for those whose control is the force.
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
    """Of each motor of an MJCF that moves several joints by a fixed tendon, their names; none of a URDF.

    Raises:
        InputError: the file is neither, or cannot be read.
    """
    if read_xml(file).tag != "mujoco":
        return []
    model = compiled(file)[1]
    arms = [_arms(model, motor) for motor in range(model.nu)]
    return [[str(model.joint(joint).name) for joint in joints] for joints in arms if len(joints) > 1]


def _force(model: Any, motor: int) -> float | None:
    """The largest force of a motor before its gear; None where the file bounds none."""
    import mujoco

    if model.actuator_forcelimited[motor]:
        return float(np.abs(model.actuator_forcerange[motor]).max())
    direct = model.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_NONE
    if direct and model.actuator_gaintype[motor] == mujoco.mjtGain.mjGAIN_FIXED and model.actuator_ctrllimited[motor]:
        return float(abs(model.actuator_gainprm[motor][0]) * np.abs(model.actuator_ctrlrange[motor]).max())
    return None


def _arms(model: Any, motor: int) -> dict[int, float]:
    """By joint, how far a motor moves for a unit of the joint: its gear, times the coefficient in a fixed tendon."""
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
