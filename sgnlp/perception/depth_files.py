"""Reading depth images: depth and mask as .npy or images, intrinsics and pose of the camera as JSON or YAML."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.base.errors import InputError
from sgnlp.perception import camera_files, masks
from sgnlp.perception.clouds import checked_pose
from sgnlp.perception.depth import DepthImage, checked_intrinsics
from sgnlp.perception.signatures import HEAD, PICTURES, refuse_others

DEPTH_SUFFIXES = (".npy", ".png", ".tif", ".tiff", ".pgm")
MASK_SUFFIXES = (*DEPTH_SUFFIXES, ".bmp", ".jpg", ".jpeg")
FORMATS = ("PNG", "TIFF", "PPM", "BMP", "JPEG")
"""Formats that Pillow reads, by suffix."""
DEPTH_MODES = ("L", "I", "F", "I;16", "I;16B", "I;16L", "I;16N")
"""Pillow's modes of one channel of numbers."""
UNIT = 0.001
"""[m] Assumed unit of depths: that of the 16-bit images of most cameras."""


def read(
    depth: Path, mask: Path | None, camera: Path, unit: float | None = None, label: int | None = None
) -> DepthImage:
    """The depth image in three files, with depths in `unit` [m]; its name is that of the depth file.

    The unit defaults to that in the camera's file, else to `UNIT`. The mask is where its image is not black, or equals
    `label`. Without a mask the pose may be missing too. Raises `InputError`, one line that begins with the path of the
    wrong file.
    """
    depths = _told(depth, _depths, depth)
    pixels, notes = (None, []) if mask is None else _told(mask, _mask, mask, label)
    found = _told(camera, _camera, camera, depth.stem, depths.shape, mask is not None)
    if unit is None and found.unit is None and depths.dtype == np.uint8:
        raise InputError(f"{depth}: 8 bits hold 256 depths, as pictures do; give 16 bits, or the --unit of the depths")
    if unit is None:
        origin = "Assumed" if found.unit is None else "Took from the camera's file"
        unit = found.unit or UNIT
        notes.append(f"{origin} that depths are in units of {unit:g} m; see --unit.")
    try:
        return DepthImage(depths, pixels, found.intrinsics, found.pose, unit, depth.stem, (*found.notes, *notes))
    except InputError as error:
        raise InputError(f"{depth}, {mask}: {error}" if mask else f"{depth}: {error}") from error


def _camera(path: Path, image: str, shape: tuple[int, ...], posed: bool) -> camera_files.Camera:
    """The camera of an image (height, width), checked; `posed` says whether its pose must be there."""
    found = camera_files.read(path, image, posed)
    if found.size not in (None, shape[1::-1]):
        raise InputError(
            "is of images of {:g} x {:g} pixels, this one has {} x {}; give the intrinsics of this stream and size "
            "(a resized image's: fx, cx times the factor of the width, fy, cy times that of the height)".format(
                *found.size, *shape[1::-1]
            )
        )
    checked_intrinsics(found.intrinsics)
    if found.pose is not None:
        checked_pose(found.pose)
    return found


def _told(path: Path, reader: Any, *arguments: Any) -> Any:
    """The result of a reader; its error messages begin with the path."""
    try:
        return reader(*arguments)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _depths(path: Path) -> Any:
    """One number a pixel."""
    pixels, mode, _ = _pixels(path, DEPTH_SUFFIXES)
    if mode and mode not in DEPTH_MODES:
        raise InputError(f"is a picture ({mode}), not depths; give the depths themselves, one channel of 16 bits")
    return pixels.squeeze(axis=pixels.shape.index(1)) if pixels.ndim == 3 and 1 in pixels.shape else pixels


def _mask(path: Path, label: int | None) -> tuple[Any, list[str]]:
    """The marked pixels, and notes. In an image with a palette the index counts."""
    pixels, _, palette = _pixels(path, MASK_SUFFIXES)
    values, notes = masks.flat(pixels)
    if label is None and palette is not None and (palette[0] == 255).all() and not palette[values.max()].any():
        raise InputError("its palette has white at 0 and black for the rest; choose with --label, 0 for what is white")
    marked, more = masks.marked(values, label)
    return marked, [*notes, *more]


def _pixels(path: Path, suffixes: tuple[str, ...]) -> tuple[Any, str, Any]:
    """The pixels of a file, its mode in Pillow ('' of a .npy), and its palette (n, 3) if it has one."""
    if path.suffix.lower() not in suffixes:
        raise InputError(
            f"is of a kind that is not read here; give a file ending in {' '.join(suffixes)} (any array: numpy.save)"
        )
    if not path.is_file():
        raise InputError("there is no such file")
    own = ("npy",) if path.suffix.lower() == ".npy" else PICTURES
    with path.open("rb") as stream:
        refuse_others(stream.read(HEAD), *own)
    if path.suffix.lower() == ".npy":
        try:
            with path.open("rb") as stream:
                return np.lib.format.read_array(stream, allow_pickle=False), "", None
        except (OSError, ValueError, EOFError) as error:
            if "allow_pickle" in str(error):
                raise InputError("holds pickled objects, which are never read; save the array alone") from error
            raise InputError(f"is a damaged .npy, or none: {error}") from error
    from PIL import Image

    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path, formats=FORMATS) as picture:
            palette = picture.getpalette("RGB") if picture.mode == "P" else None
            pixels = np.asarray(picture)
            if picture.format == "PNG" and pixels.dtype == np.int32:  # a PNG has 16 bits; Pillow 10 reads them into 32
                pixels = pixels.astype(np.uint16)
            return pixels, picture.mode, None if palette is None else np.reshape(palette, (-1, 3))
    except Exception as error:  # a damaged file can raise almost anything
        raise InputError(f"is a damaged {path.suffix} file, or none: {error}") from error
