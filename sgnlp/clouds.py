"""Reading a point cloud from a file: npz (one array, or one per camera), or .ply .pcd .xyz through Open3D."""

import re
import warnings
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sgnlp import open3d_files
from sgnlp.errors import InputError, unknown
from sgnlp.open3d_files import CLOUD_SUFFIXES

PER_CAMERA = "points_"  # prefix of the keys of a file with one array per camera
NUMBERS = ("table_height", "mass", "friction")  # keys of single numbers
TEXTS = ("name", "half")  # keys of texts; the half of a problem set is tuning or held_out
OPTIONAL_KEYS = ("view", "camera_positions", "mesh_vertices", "mesh_faces", "notes", *NUMBERS, *TEXTS)
EXPECTED = (
    "an npz with 'points' (N, 3) in metres or one array 'points_<camera>' per camera, "
    f"or a file ending in {' '.join(CLOUD_SUFFIXES)}"
)
NAME_PATTERN = re.compile(r"\w[\w .+-]{0,99}")
ZIP_HEADS = (b"PK\x03\x04", b"PK\x05\x06")  # of an archive with files, and of an empty one


@dataclass(frozen=True, eq=False)
class RawCloud:
    """What a file holds, unchecked and in its own unit. Fields as in `sgnlp.observation.observe`."""

    points: object
    name: str
    view: object = None
    view_names: tuple[str, ...] | None = None
    table_height: float | None = None
    camera_positions: object = None
    mesh_vertices: object = None
    mesh_faces: object = None
    mass: float | None = None
    friction: float | None = None
    half: str = ""
    notes: tuple[str, ...] = ()  # what was dropped or assumed when the file was made
    ignored_keys: tuple[str, ...] = ()


def read(path: str | Path) -> RawCloud:
    """The cloud in a file; its suffix picks the reader, everything that Open3D does not read is npz.

    Raises `InputError` when the file is missing, not a file, unreadable, damaged, holds pickled objects, or
    lacks the points.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise InputError(f"is a directory; give {EXPECTED}")
        if not path.exists():
            raise InputError("there is no such file")
        if not path.is_file():
            raise InputError(f"is not a regular file; give {EXPECTED}")
        if path.suffix.lower() in CLOUD_SUFFIXES:
            return RawCloud(points=open3d_files.points(path), name=path.stem)
        return _from_arrays(_npz_arrays(path), path.stem)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from error


@dataclass(frozen=True, eq=False)
class Cameras:
    """Which camera saw which point."""

    view: NDArray[np.int64]  # (N,) index into names
    names: tuple[str, ...]  # (V,)
    positions: NDArray[np.float64] | None  # (V, 3)

    @classmethod
    def of(cls, count: int, view: object, names: Sequence[str] | None, positions: object) -> "Cameras":
        """The cameras of `count` points; without names a camera is called by its number in `view`.

        Without `view` nothing says which of several positions saw a point: one camera, no position.
        """
        number = np.zeros(count, np.int64) if view is None else integers(view, "view", (None,))
        if len(number) != count:
            raise InputError(f"'view' has {len(number)} entries for {count} points")
        place = None if positions is None else floats(positions, "camera_positions", (None, 3))
        if place is not None and not np.isfinite(place).all():
            raise InputError("'camera_positions' must be finite")
        if view is None and place is not None and len(place) > 1:
            place = None
        if names is None and place is None:
            numbers, number = np.unique(number, return_inverse=True)
            names = [str(n) for n in numbers]
        elif names is None and place is not None:
            names = [str(n) for n in range(len(place))]
        names = tuple(names or ())
        if place is not None and len(place) != len(names):
            raise InputError(f"'camera_positions' has {len(place)} rows for {len(names)} views")
        if len(number) and (number.min() < 0 or number.max() >= len(names)):
            raise InputError(f"'view' must lie in 0..{len(names) - 1}; found {number.min()}..{number.max()}")
        return cls(number, names, place)

    def pick(self, views: Sequence[str | int] | None) -> NDArray[np.int64]:
        """Sorted indices of the views asked for by name, or by place where no name matches; None: all."""
        if views is None:
            return np.arange(len(self.names))
        places = {str(i): i for i in range(len(self.names))} | {name: i for i, name in enumerate(self.names)}
        asked = [views] if isinstance(views, str) else [str(view) for view in views]
        for view in asked:
            if view not in places:
                raise unknown("view", view, self.names)
        if not asked:
            raise InputError(f"no view is chosen; valid: {', '.join(self.names)}")
        return np.unique([places[view] for view in asked])


def check_name(name: str) -> None:
    """Raise `InputError` for a name that cannot become a folder under results/."""
    if not NAME_PATTERN.fullmatch(name):
        raise InputError(f"the name {name[:40]!r} must be 1 to 100 letters, digits, spaces or . _ + -")


def check_truth(**values: float | None) -> None:
    """Raise `InputError` for a mass or another property of a body that is given and not positive."""
    for key, value in values.items():
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"'{key}' must be a positive number; found {value}")


def mesh(vertices: object, faces: object) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    """The vertices (U, 3) and faces (F, 3) of a triangle mesh, checked; None where neither is given."""
    if vertices is None and faces is None:
        return None
    if vertices is None or faces is None:
        raise InputError("'mesh_vertices' and 'mesh_faces' must be given together")
    corners = floats(vertices, "mesh_vertices", (None, 3))
    triangles = integers(faces, "mesh_faces", (None, 3))
    if not np.isfinite(corners).all():
        raise InputError("'mesh_vertices' must be finite")
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(corners)):
        raise InputError(f"'mesh_faces' must lie in 0..{len(corners) - 1}, the rows of 'mesh_vertices'")
    return corners, triangles


def floats(value: object, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """`value` as a float64 array of `shape` (None: any length), or an `InputError` that calls it `name`."""
    with np.errstate(over="ignore", invalid="ignore"):  # wider types: what does not fit becomes infinite
        return _checked(value, name, shape, "fiu", "real numbers").astype(np.float64)


def integers(value: object, name: str, shape: tuple[int | None, ...]) -> NDArray[np.int64]:
    """`value` as an int64 array of `shape` (None: any length), or an `InputError` that calls it `name`."""
    return _checked(value, name, shape, "iu", "integers").astype(np.int64)


def _checked(value: object, name: str, shape: tuple[int | None, ...], kinds: str, what: str) -> NDArray[np.generic]:
    wanted = "(" + ", ".join("N" if length is None else str(length) for length in shape) + ")"
    try:
        array: NDArray[np.generic] = np.asarray(value)
    except ValueError as error:  # rows of unequal length
        raise InputError(f"'{name}' must be an array of {what} of shape {wanted}; its rows differ") from error
    fits = array.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in kinds or not fits:
        found = f"{array.dtype} of shape {array.shape}"
        raise InputError(f"'{name}' must be an array of {what} of shape {wanted}; found {found}")
    return array


def _npz_arrays(path: Path) -> dict[str, object]:
    """Every array of an npz file, never unpickling anything."""
    arrays = {}
    key = "its directory"
    with path.open("rb") as stream, warnings.catch_warnings(action="ignore"):
        if stream.read(4) not in ZIP_HEADS:
            raise InputError(f"is not an npz; give {EXPECTED}")
        if not zipfile.is_zipfile(stream):  # the directory at its end is missing
            raise InputError("is a truncated npz")
        stream.seek(0)
        try:
            with np.load(stream, allow_pickle=False) as file:
                for key in file.files:
                    arrays[key] = file[key]
        except Exception as error:  # a damaged zip or array header can raise almost anything
            if "allow_pickle" in str(error):
                raise InputError(f"'{key}' holds pickled objects, which are never read") from error
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            raise InputError(f"is a damaged npz ({key}: {reason})") from error
    return arrays


def _from_arrays(arrays: dict[str, object], stem: str) -> RawCloud:
    cameras = sorted(key for key in arrays if key.startswith(PER_CAMERA))
    if ("points" in arrays) == bool(cameras):
        fault = "both 'points' and 'points_<camera>'" if cameras else "neither 'points' nor 'points_<camera>'"
        raise InputError(f"has {fault}; its keys: {', '.join(sorted(arrays)) or 'none'}")
    optional = {key: arrays[key] for key in OPTIONAL_KEYS if key in arrays}
    if cameras:
        optional["view_names"] = tuple(key.removeprefix(PER_CAMERA) for key in cameras)
        clouds = [floats(arrays[key], key, (None, 3)) for key in cameras]
        optional["view"] = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud in clouds])
        points: object = np.concatenate(clouds)
    else:
        points = arrays["points"]
    optional.setdefault("name", stem)
    for key in TEXTS:
        try:
            optional[key] = str(optional.get(key, ""))
        except Exception as error:  # a string array may hold what is no character
            raise InputError(f"'{key}' is not a text") from error
    if "notes" in optional:
        notes = np.asarray(optional["notes"])
        if notes.dtype.kind != "U" or notes.ndim != 1:
            raise InputError(f"'notes' must be texts (N,); found {notes.dtype} of shape {notes.shape}")
        optional["notes"] = tuple(map(str, notes))
    for key in NUMBERS:
        if key in optional:
            optional[key] = float(floats(optional[key], key, ()))
    ignored = sorted(set(arrays) - {"points", *cameras, *OPTIONAL_KEYS})
    return RawCloud(points=points, ignored_keys=tuple(ignored), **optional)  # type: ignore[arg-type]
