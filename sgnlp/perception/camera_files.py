"""Files of calibrated cameras, as JSON or YAML: our own, and those of Open3D, OpenCV, ROS, RealSense and BOP."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import Loader
from sgnlp.perception.camera_poses import MILLIMETRE, numbers, only, pose_of
from sgnlp.perception.signatures import HEAD, kind_of

YAML_SUFFIXES = (".yaml", ".yml")
MATRICES = ("K", "k", "camera_matrix", "Camera_Matrix", "cameraMatrix", "cam_K", "intrinsics", "intrinsic")
"""Keys of the nine numbers of K."""
NULLABLE = ("pose", "extrinsic", *MATRICES)
"""Keys that may be null, for what is not known."""
SIZES = (("width", "height"), ("image_width", "image_height"), ("image_Width", "image_Height"))
"""Keys of an image's size."""
DISTORTION = (
    *("d", "D", "distortion_coefficients", "distortion_coeffs", "distCoeffs", "dist_coeffs", "coeffs", "distortion"),
    *("distortion_parameters", "Distortion_Coefficients"),
    *("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"),
)
"""Keys of the lens's distortion, in one list or one by one."""
PIXEL = 0.5
"""[px] Intrinsics of one file that differ by more are of different streams; printed ones have at least one digit."""
EXAMPLE = '{"K": [9 numbers], "pose": [16 numbers]}'
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
        text = _text(path.read_bytes())
        if text.lstrip().startswith("<"):
            raise InputError("is XML; save it as YAML (OpenCV writes that into a file that ends in .yml) or as JSON")
        loaded = _yaml(text) if path.suffix.lower() in YAML_SUFFIXES else _json(text)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except (ValueError, TypeError, yaml.YAMLError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"is not the JSON or YAML of a camera: {reason}; write {EXAMPLE}") from error
    if isinstance(loaded, list) and len(loaded) == 1:
        (loaded,) = loaded
    if not isinstance(loaded, Mapping):
        raise InputError(f"is not the JSON or YAML of a camera, which has {KNOWN}")
    found = {key: value for key, value in _one(dict(loaded), image).items() if key not in NULLABLE or value is not None}
    inner = [found[key] for key in MATRICES if isinstance(found.get(key), Mapping) and "data" not in found[key]]
    source = found | dict(inner[0]) if inner else found
    _undistorted(source)
    _uncropped(source)
    K = _intrinsics(source)
    pose, notes = pose_of(found, posed)
    unit = None
    if "cam_K" in found and "depth_scale" in found:
        unit = float(numbers(found, "depth_scale", 1)[0]) * MILLIMETRE
    elif "depth_scale" in found:  # metres for RealSense, millimetres for BOP
        notes.append(f"Did not use 'depth_scale', {found['depth_scale']}, of the camera's file; see --unit.")
    return Camera(K, pose, _size(source), unit, tuple(notes))


def _text(content: bytes) -> str:
    """The text of a file, from UTF-8 or UTF-16. Raises `InputError` if its first bytes are those of another kind."""
    if kind := kind_of(content[:HEAD]):
        raise InputError(f"is {kind.name}, not the JSON or YAML of a camera, such as {EXAMPLE}")
    return content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")


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
        return _named(found, image)
    number = str(int(image)) if image.isdecimal() else None
    if len(entries) > 1 and number not in entries:
        raise InputError(
            f"has the cameras of {len(entries)} images, none of which is '{image}'; save one of them as a file"
        )
    return dict(entries[number] if number in entries else next(iter(entries.values())))


def _named(found: dict[str, Any], image: str) -> dict[str, Any]:
    """The camera with the name of the image, if the entries of a file are cameras; else the file as it is."""
    inner = (*MATRICES, "intrinsic_matrix", "fx")
    if not found or not all(
        isinstance(entry, Mapping) and any(key in entry for key in inner) for entry in found.values()
    ):
        return found
    if set(found) & set(MATRICES):  # the intrinsics of one camera
        return found
    cameras = {Path(str(name)).stem: entry for name, entry in found.items()}
    if len(cameras) > 1 and image not in cameras:
        raise InputError(
            f"has the cameras {', '.join(cameras)}, none of which is '{image}'; save one of them as a file"
        )
    return dict(cameras.get(image, next(iter(cameras.values()))))


def _intrinsics(found: Mapping[str, Any]) -> Array:
    """K (3, 3) from rows, or from all numbers row by row; Open3D's, which are column by column, transposed."""
    known = {key: _nine(found, key) for key in MATRICES if key in found and _is_array(found[key])}
    if "intrinsic_matrix" in found:
        K = _nine(found, "intrinsic_matrix")
        known["intrinsic_matrix"] = K if np.array_equal(K[2], [0, 0, 1]) else K.T
    if known:
        return only("intrinsics", known, PIXEL)
    names = ("fx", "fy", *(("ppx", "ppy") if "ppx" in found else ("cx", "cy")))
    missing = [name for name in names if name not in found]
    if missing:
        name = "K" if "fx" not in found else missing[0]
        raise InputError(f"the key '{name}' is missing; a camera has {KNOWN}")
    fx, fy, cx, cy = (float(numbers(found, name, 1)[0]) for name in names)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def _is_array(value: object) -> bool:
    return not isinstance(value, Mapping) or "data" in value


def _nine(found: Mapping[str, Any], key: str) -> Array:
    """The numbers (3, 3) of K."""
    entries = numbers(found, key, None)
    if len(entries) != 9:
        raise InputError(
            f"'{key}' has {len(entries)} numbers; give the 9 of [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] by rows, or the "
            "keys fx, fy, cx and cy"
        )
    return entries.reshape(3, 3)


def _uncropped(found: Mapping[str, Any]) -> None:
    """Refuse a ROS camera whose images are a part of the sensor's, or binned: its K is that of all pixels."""
    part = found.get("roi")
    offsets = [part.get(key) or 0 for key in ("x_offset", "y_offset")] if isinstance(part, Mapping) else []
    binned = [key for key in ("binning_x", "binning_y") if (found.get(key) or 0) not in (0, 1)]
    if any(offsets) or binned:
        what = f"'{binned[0]}' of {found[binned[0]]}" if binned else f"a 'roi' from {offsets[0]}, {offsets[1]} on"
        raise InputError(
            f"has {what}, and in ROS K is that of the whole sensor: give the K of these images (cx, cy less the "
            "offsets of the roi, then fx, fy, cx, cy over the binning) and leave it out"
        )


def _undistorted(found: Mapping[str, Any]) -> None:
    """Refuse a lens with distortion: images are rectified."""
    for key in DISTORTION:
        value = found.get(key)
        if isinstance(value, Mapping) and "data" not in value:
            _undistorted(value)
        elif value is not None:
            coefficients = numbers(found, key, None)
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
            width, height = (float(numbers(found, name, 1)[0]) for name in names)
            return width, height
    return None
