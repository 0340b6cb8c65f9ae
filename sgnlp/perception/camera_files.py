"""Files of calibrated cameras, as JSON or YAML: our own, and those of Open3D, OpenCV, ROS, RealSense and BOP."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sgnlp.base.arrays import Array, floats
from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import Loader

YAML_SUFFIXES = (".yaml", ".yml")
MILLIMETRE = 0.001  # [m] the unit of BOP's translations, and of its depth_scale
MATRICES = ("K", "k", "camera_matrix", "Camera_Matrix", "cameraMatrix", "cam_K", "intrinsics", "intrinsic")
"""Keys of the nine numbers of K."""
SIZES = (("width", "height"), ("image_width", "image_height"), ("image_Width", "image_Height"))
"""Keys of an image's size."""
DISTORTION = (
    *("d", "D", "distortion_coefficients", "distortion_coeffs", "distCoeffs", "dist_coeffs", "coeffs", "distortion"),
    *("distortion_parameters", "Distortion_Coefficients"),
    *("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"),
)
"""Keys of the lens's distortion, in one list or one by one."""
KNOWN = (
    "K and pose, Open3D's (intrinsic, extrinsic), OpenCV's camera_matrix or ROS's CameraInfo (k or K, d or D) with a "
    "pose, RealSense's (fx, fy, ppx, ppy) with a pose, or BOP's (cam_K, cam_R_w2c, cam_t_w2c)"
)
OPENCV_VERSION = re.compile(r"\A%YAML[: ][\d.]+[^\n]*")
"""First line of OpenCV's YAML files. The standard has a blank for the colon, and readers refuse the line, as they do
its version 1.0."""
OPENCV_MATRIX = "tag:yaml.org,2002:opencv-matrix"
"""Tag of matrices in OpenCV's YAML files: rows, cols, dt (the type of the numbers) and data."""


class _CameraLoader(Loader):
    """The safe loader, which also reads OpenCV's matrices: as mappings of rows, cols, dt and data."""

    def matrix(self, node: yaml.Node) -> dict[Any, Any]:
        """The mapping that the tag stands before."""
        return self.construct_mapping(node, deep=True)


_CameraLoader.add_constructor(OPENCV_MATRIX, _CameraLoader.matrix)


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera as read from a file, unchecked."""

    intrinsics: Array  # (3, 3) [px]
    pose: Array | None  # (4, 4), or (3, 4) its upper rows: camera to world [m]
    size: tuple[float, float] | None = None  # (width, height) [px] of its images
    unit: float | None = None  # [m] of its depths
    notes: tuple[str, ...] = ()


def read(path: Path, image: str, posed: bool = True) -> Camera:
    """The camera in a file; if the file has many, the one whose number is the name `image`.

    The pose may be missing unless `posed`. Raises `InputError`, which says what is missing, without the path.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        if text.lstrip().startswith("<"):
            raise InputError("is XML; save it as YAML (OpenCV writes that into a file that ends in .yml) or as JSON")
        loaded = _yaml(text) if path.suffix.lower() in YAML_SUFFIXES else _json(text)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except (ValueError, TypeError, yaml.YAMLError, RecursionError) as error:
        raise InputError(f"is not the JSON or YAML of a camera: {' '.join(str(error).split())}") from error
    if not isinstance(loaded, Mapping):
        raise InputError(f"is not the JSON or YAML of a camera, which has {KNOWN}")
    found = _one(dict(loaded), image)
    inner = [found[key] for key in MATRICES if isinstance(found.get(key), Mapping) and "data" not in found[key]]
    source = found | dict(inner[0]) if inner else found
    _undistorted(source)
    K = _intrinsics(source)
    pose, notes = _pose(found, posed)
    unit = None
    if "cam_K" in found and "depth_scale" in found:
        unit = float(_numbers(found, "depth_scale", 1)[0]) * MILLIMETRE
    elif "depth_scale" in found:  # metres for RealSense, millimetres for BOP
        notes.append(f"Did not use 'depth_scale', {found['depth_scale']}, of the camera's file; see --unit.")
    return Camera(K, pose, _size(source), unit, tuple(notes))


def _yaml(text: str) -> Any:
    """The first document; that of OpenCV, too."""
    return next(yaml.load_all(OPENCV_VERSION.sub("", text), _CameraLoader), None)


def _json(text: str) -> Any:
    return json.loads(text, object_pairs_hook=_unique)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The entries of an object, refused if a key is there twice: JSON takes the last."""
    found = dict(pairs)
    if len(found) < len(pairs):
        twice = next(key for key, _ in pairs if sum(key == other for other, _ in pairs) > 1)
        raise InputError(f"the key '{twice}' is there twice; remove one")
    return found


def _numbers(found: Mapping[str, Any], key: str, count: int | None) -> Array:
    """All numbers of an array one after the other, which may be written as rows, cols and data."""
    value = found[key]
    value, matrix = (value["data"], value) if isinstance(value, Mapping) and "data" in value else (value, {})
    try:
        numbers = floats(np.ravel(value), key, (count,))
    except ValueError as error:
        raise InputError(f"'{key}' must be an array of real numbers; its rows differ in length") from error
    rows, columns = matrix.get("rows"), matrix.get("cols")
    if isinstance(rows, int) and isinstance(columns, int) and rows * columns != len(numbers):
        raise InputError(f"'{key}' must have rows x cols numbers, {rows} x {columns}; found {len(numbers)}")
    return numbers


def _one(found: dict[str, Any], image: str) -> dict[str, Any]:
    """The entry of a scene_camera.json, which has one for each number of an image."""
    if "parameters" in found and isinstance(found["parameters"], list):
        raise InputError(
            f"is a trajectory of {len(found['parameters'])} cameras; save each 'parameters' entry as a file"
        )
    if "frames" in found or "transform_matrix" in found:
        raise InputError(
            "has 'transform_matrix' with OpenGL's axes (y up, z back); give K and pose = it @ diag(1, -1, -1, 1)"
        )
    entries = {str(key): entry for key, entry in found.items() if str(key).isdecimal() and isinstance(entry, Mapping)}
    if not entries or len(entries) < len(found):
        return found
    number = str(int(image)) if image.isdecimal() else None
    if len(entries) > 1 and number not in entries:
        raise InputError(
            f"has the cameras of {len(entries)} images, none of which is '{image}'; save one of them as a file"
        )
    return dict(entries[number] if number in entries else next(iter(entries.values())))


def _intrinsics(found: Mapping[str, Any]) -> Array:
    """K (3, 3) from rows, or from all numbers row by row; Open3D's, which are column by column, transposed."""
    for key in MATRICES:
        if key in found and not (isinstance(found[key], Mapping) and "data" not in found[key]):
            return _numbers(found, key, 9).reshape(3, 3)
    if "intrinsic_matrix" in found:
        K = _numbers(found, "intrinsic_matrix", 9).reshape(3, 3)
        return K if np.array_equal(K[2], [0, 0, 1]) else K.T
    names = ("fx", "fy", *(("ppx", "ppy") if "ppx" in found else ("cx", "cy")))
    missing = [name for name in names if name not in found]
    if missing:
        name = "K" if "fx" not in found else missing[0]
        raise InputError(f"the key '{name}' is missing; a camera has {KNOWN}")
    fx, fy, cx, cy = (float(_numbers(found, name, 1)[0]) for name in names)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def _pose(found: Mapping[str, Any], posed: bool) -> tuple[Array | None, list[str]]:
    """The pose, camera to world, and a note if the file has the inverse."""
    if "pose" in found:
        return _matrix(found), []
    if "extrinsic" in found:
        extrinsic = _numbers(found, "extrinsic", 16).reshape(4, 4)
        by_columns = np.array_equal(extrinsic[:, 3], [0, 0, 0, 1])
        return _inverse(extrinsic.T if by_columns else extrinsic), ["Inverted 'extrinsic', which is world to camera."]
    if "cam_R_w2c" in found and "cam_t_w2c" in found:
        world = np.eye(4)
        world[:3, :3] = _numbers(found, "cam_R_w2c", 9).reshape(3, 3)
        world[:3, 3] = _numbers(found, "cam_t_w2c", 3) * MILLIMETRE
        return _inverse(world), ["Inverted 'cam_R_w2c' and 'cam_t_w2c', which are world to camera in mm."]
    if not posed:
        return None, []
    raise InputError(
        "the key 'pose' is missing: the 16 numbers of the matrix from the camera's (optical) frame to the world; "
        f"a camera has {KNOWN}"
    )


def _matrix(found: Mapping[str, Any]) -> Array:
    """The pose (4, 4), or its upper rows (3, 4)."""
    value = found["pose"]
    numbers = None if isinstance(value, Mapping) and "data" not in value else _numbers(found, "pose", None)
    if numbers is None or len(numbers) == 7:
        raise InputError(
            "'pose' has a quaternion; give the matrix [[R, t], [0 0 0 1]] with "
            "R = scipy.spatial.transform.Rotation.from_quat([x, y, z, w]).as_matrix()"
        )
    if len(numbers) not in (12, 16):
        raise InputError(f"'pose' must have the 16 numbers of [[R, t], [0 0 0 1]]; found {len(numbers)}")
    return numbers.reshape(-1, 4)


def _inverse(pose: Array) -> Array:
    """The inverse of a rigid motion; for any other matrix the result is not rigid either."""
    R, t = pose[:3, :3], pose[:3, 3]
    return np.block([[R.T, -(R.T @ t)[:, None]], [pose[3:]]])


def _undistorted(found: Mapping[str, Any]) -> None:
    """Refuse a lens with distortion: images are rectified."""
    for key in DISTORTION:
        value = found.get(key)
        if isinstance(value, Mapping) and "data" not in value:
            _undistorted(value)
        elif value is not None:
            coefficients = _numbers(found, key, None)
            if not (coefficients == 0).all():
                raise InputError(
                    f"the lens distortion '{key}' is not zero, but images must be rectified: rectify them, or if they "
                    "are, give the K of rectified images (of ROS the first three columns of p; cv2.undistort keeps K) "
                    "and leave it out"
                )


def _size(found: Mapping[str, Any]) -> tuple[float, float] | None:
    """Width and height [px] of the images; raises `InputError` if one of the two is missing."""
    for names in SIZES:
        there = [name for name in names if name in found]
        if len(there) == 1:
            raise InputError(f"has '{there[0]}' alone; give both '{names[0]}' and '{names[1]}', or neither")
        if there:
            width, height = (float(_numbers(found, name, 1)[0]) for name in names)
            return width, height
    return None
