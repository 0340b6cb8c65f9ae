"""Reads whole scenes: depth images with their cameras, or clouds, organised or not, in one world frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.base.errors import InputError
from sgnlp.perception import clouds, depth_files, point_arrays, point_files
from sgnlp.perception.depth_files import DEPTH_SUFFIXES
from sgnlp.perception.scene_views import SceneView, of_image, of_points
from sgnlp.perception.views import Cameras

CLOUD_SUFFIXES = (".npz", ".npy", *point_files.SUFFIXES)
UNREAD = {".exr": "OpenEXR", ".pfm": "PFM", ".bag": "a ROS bag", ".h5": "HDF5", ".hdf5": "HDF5", ".mat": "MATLAB's own"}
"""Names of depth formats that are not read."""
METRE = 1.0
"""[m] The unit of clouds, unless another one is given."""


@dataclass(frozen=True, eq=False)
class SceneFiles:
    """The content of a scene's files."""

    views: list[SceneView]
    notes: tuple[str, ...]
    table_height: float | None = None  # [m] in the frame of the points


def read(
    files: Sequence[Path], cameras: Sequence[Path], unit: float | None = None, key: str | None = None
) -> SceneFiles:
    """The scene in files of one kind, with a camera for each depth image.

    `unit` [m] is that of the depths or coordinates, `key` names the array of an npz that holds the points. Raises
    `InputError`, one line that begins with the path of the file that is wrong.
    """
    if not files:
        raise InputError("no depth image or cloud is given")
    kinds = [_is_image(file) for file in files]
    if any(kinds) and not all(kinds):
        raise InputError("give depth images or clouds, not both")
    return _images(files, cameras, unit) if kinds[0] else _clouds(files, cameras, unit, key)


def _is_image(file: Path) -> bool:
    """Whether a file holds depths, not points."""
    suffix = file.suffix.lower()
    if suffix in UNREAD:
        raise InputError(
            f"{file}: is {UNREAD[suffix]}, which is not read; save the depths as .npy, or as .png of 16 bits"
        )
    if suffix not in (*DEPTH_SUFFIXES, *CLOUD_SUFFIXES):
        kinds = " ".join(dict.fromkeys((*DEPTH_SUFFIXES, *CLOUD_SUFFIXES)))
        raise InputError(f"{file}: is of a kind that is not read here; give a file ending in {kinds}")
    if not file.is_file():
        raise InputError(f"{file}: there is no such file")
    if suffix != ".npy":
        return suffix in DEPTH_SUFFIXES
    try:
        array = np.load(file, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return False  # `clouds` reports what is wrong with it
    return bool(array.dtype.names is None and (array.ndim == 2 or 1 in array.shape[::2]) and array.shape[-1] != 3)


def _images(files: Sequence[Path], cameras: Sequence[Path], unit: float | None) -> SceneFiles:
    if len(cameras) != len(files):
        counts = f"{len(files)} images and {len(cameras)} cameras"
        raise InputError(f"every depth image needs a camera, its intrinsics (--cameras); found {counts}")
    images = [depth_files.read(file, None, camera, unit) for file, camera in zip(files, cameras, strict=True)]
    if len(images) > 1:
        for image, camera in zip(images, cameras, strict=True):
            if image.pose is None:
                raise InputError(f"{camera}: has no pose; each of several images needs one")
    return SceneFiles([of_image(image, i) for i, image in enumerate(images)], ())


def _clouds(files: Sequence[Path], cameras: Sequence[Path], unit: float | None, key: str | None) -> SceneFiles:
    if cameras:
        raise InputError("cameras are those of depth images; a cloud needs none, but may have a --pose")
    views: list[SceneView] = []
    notes: list[str] = []
    heights = []
    for file in files:
        try:
            raw = clouds.read(file, key)
            found = _views(file, raw, unit or METRE)
        except InputError as error:
            line = "".join(letter if letter.isprintable() else "?" for letter in f"{file}: {error}")
            raise InputError(line) from error
        views += found
        notes += raw.get("notes", ())
        heights += [raw["table_height"] * (unit or METRE)] if "table_height" in raw else []
    if len(views) > 1:
        views = [replace(view, name=str(i)) for i, view in enumerate(views)]
    same = len(heights) == len(files) and len(set(heights)) == 1
    return SceneFiles(views, tuple(notes), heights[0] if same else None)


def _views(file: Path, raw: dict[str, Any], unit: float) -> list[SceneView]:
    """The views of a cloud: one, or one for each of its cameras."""
    array = np.asarray(raw["points"])
    if file.suffix.lower() == ".pcd":
        grid = point_files.pcd_grid(file)
        array = array.reshape(*grid, 3) if grid and grid[0] * grid[1] == len(array) else array
    if array.dtype.names:
        array, _ = point_arrays.rows(array, "points")
    organised = array.ndim == 3
    points, _ = point_arrays.rows(array, "points")
    seen = Cameras.of(len(points), raw.get("view"), raw.get("view_names"), raw.get("camera_positions"))
    place = None if seen.positions is None else unit * seen.positions
    if len(seen.names) == 1:
        whole = unit * (array.astype(np.float64) if organised else points)
        return [of_points(whole, 0, "", None if place is None else place[0])]
    chosen = [unit * points[seen.view == i] for i in range(len(seen.names))]
    return [of_points(part, i, "", None if place is None else place[i]) for i, part in enumerate(chosen) if len(part)]
