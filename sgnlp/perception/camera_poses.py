"""The pose of a camera from the keys of its file, and the numbers of a key; keys that contradict each other."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array, floats
from sgnlp.base.errors import InputError

MILLIMETRE = 0.001  # [m] the unit of BOP's translations, and of its depth_scale
SAME = 0.002
"""Poses of one file that differ by more, in metres or entries of R, are two poses: printed ones have three digits."""
OTHERS = (
    *("extrinsics", "R", "t", "T", "rotation", "translation", "position", "orientation", "quaternion", "rvec", "tvec"),
    *("c2w", "w2c", "cam2world", "world2cam", "cam_to_world", "world_to_cam", "transform", "transformation", "poses"),
    *("cameraPoseARFrame", "camera_pose", "view_matrix", "viewMatrix", "matrix_world"),
)
"""Keys of poses whose direction or axes differ from tool to tool."""


def numbers(found: Mapping[str, Any], key: str, count: int | None) -> Array:
    """All numbers of an array one after the other, which may be written as rows, cols and data."""
    value = found[key]
    value, matrix = (value["data"], value) if isinstance(value, Mapping) and "data" in value else (value, {})
    try:
        entries = floats(np.ravel(value), key, (count,))
    except ValueError as error:
        raise InputError(f"'{key}' must be an array of real numbers; its rows differ in length") from error
    rows, columns = matrix.get("rows"), matrix.get("cols")
    if isinstance(rows, int) and isinstance(columns, int) and rows * columns != len(entries):
        raise InputError(f"'{key}' must have rows x cols numbers, {rows} x {columns}; found {len(entries)}")
    return entries


def only(what: str, known: Mapping[str, Array], most: float) -> Array:
    """The first of the arrays of a file's keys. Raises `InputError` if another one differs by more than `most`."""
    (first, value), *rest = known.items()
    for key, other in rest:
        if not (np.abs(value[:3] - other[:3]) <= most).all():
            raise InputError(f"'{first}' and '{key}' are different {what}; leave out the wrong one")
    return value


def pose_of(found: Mapping[str, Any], posed: bool) -> tuple[Array | None, list[str]]:
    """The pose, camera to world, and a note if the file has the inverse. It may be missing unless `posed`."""
    known, notes = {}, []
    if "pose" in found:
        known["pose"] = _matrix(found)
    if "extrinsic" in found:
        extrinsic = numbers(found, "extrinsic", 16).reshape(4, 4)
        by_columns = np.array_equal(extrinsic[:, 3], [0, 0, 0, 1])
        known["extrinsic"] = _inverse(extrinsic.T if by_columns else extrinsic)
        notes.append("Inverted 'extrinsic', which is world to camera.")
    if "cam_R_w2c" in found and "cam_t_w2c" in found:
        world = np.eye(4)
        world[:3, :3] = numbers(found, "cam_R_w2c", 9).reshape(3, 3)
        world[:3, 3] = numbers(found, "cam_t_w2c", 3) * MILLIMETRE
        known["cam_R_w2c"] = _inverse(world)
        notes.append("Inverted 'cam_R_w2c' and 'cam_t_w2c', which are world to camera in mm.")
    if known:
        return only("poses of the camera", known, SAME), [] if "pose" in known else notes
    if not posed:
        return None, []
    raise InputError(_missing(found))


def _missing(found: Mapping[str, Any]) -> str:
    """What to give for a pose that is missing, or under a name that does not say from where to where it goes."""
    wanted = "the 16 numbers of the matrix from the camera's (optical) frame to the world"
    others = [str(key) for key in found if key in OTHERS or str(key).startswith("T_")]
    if not others:
        return f"the key 'pose' is missing: {wanted}; a file of Open3D has 'extrinsic', one of BOP 'cam_R_w2c'"
    named = " and ".join(f"'{key}'" for key in others)
    return (
        f"the key 'pose' is missing, and {named} may go either way: give as 'pose' {wanted}, or as 'extrinsic' the one "
        "from the world to the camera"
    )


def _matrix(found: Mapping[str, Any]) -> Array:
    """The pose (4, 4), or its upper rows (3, 4)."""
    value = found["pose"]
    entries = None if isinstance(value, Mapping) and "data" not in value else numbers(found, "pose", None)
    if entries is None or len(entries) == 7:
        raise InputError(
            "'pose' has a quaternion; give the matrix [[R, t], [0 0 0 1]] with "
            "R = scipy.spatial.transform.Rotation.from_quat([x, y, z, w]).as_matrix()"
        )
    if len(entries) not in (12, 16):
        raise InputError(f"'pose' must have the 16 numbers of [[R, t], [0 0 0 1]]; found {len(entries)}")
    return entries.reshape(-1, 4)


def _inverse(pose: Array) -> Array:
    """The inverse of a rigid motion; for any other matrix the result is not rigid either."""
    R, t = pose[:3, :3], pose[:3, 3]
    return np.block([[R.T, -(R.T @ t)[:, None]], [pose[3:]]])
