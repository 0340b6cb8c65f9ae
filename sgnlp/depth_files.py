"""Reading depth images: depth and mask as .png or .npy, intrinsics and pose of the camera as JSON."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp import open3d_files
from sgnlp.clouds import floats
from sgnlp.depth import DepthImage
from sgnlp.errors import InputError

SUFFIXES = (".npy", *open3d_files.IMAGE_SUFFIXES)
CAMERA_KEYS = ("K", "pose")


def read(depth: Path, mask: Path, camera: Path, unit: float) -> DepthImage:
    """The image in three files, depths in `unit` [m]; it is called as the file of its depths.

    The mask is where its image is not black, a colour image in any channel. Raises `InputError`, one line that begins
    with the path of the file that is wrong.
    """
    depths, marked, (K, pose) = _pixels(depth), _pixels(mask), _camera(camera)
    if marked.ndim == 3:
        marked = marked.any(axis=2)
    try:
        return DepthImage(depths, marked != 0, K, pose, unit, depth.stem)
    except InputError as error:
        raise InputError(f"{depth}, {mask}, {camera}: {error}") from error


def _pixels(path: Path) -> Any:
    try:
        if path.suffix.lower() not in SUFFIXES:
            raise InputError(f"is not an image; give a file ending in {' '.join(SUFFIXES)}")
        if not path.is_file():
            raise InputError("there is no such file")
        if path.suffix.lower() == ".npy":
            return np.load(path, allow_pickle=False)
        return open3d_files.pixels(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is a damaged .npy: {error}") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _camera(path: Path) -> tuple[Any, Any]:
    """K (3, 3) and pose (4, 4); rows, or all numbers one after the other, row by row, as ROS has them."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        missing = [key for key in CAMERA_KEYS if key not in found]
        if missing:
            raise InputError(f"the key '{missing[0]}' is missing; a camera has {' and '.join(CAMERA_KEYS)}")
        K, pose = (np.ravel(found[key]) for key in CAMERA_KEYS)
        return floats(K, "K", (9,)).reshape(3, 3), floats(pose, "pose", (16,)).reshape(4, 4)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, TypeError) as error:
        raise InputError(f"{path}: is not the JSON of a camera: {error}") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
