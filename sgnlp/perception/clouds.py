"""Reading a point cloud from a file: npz (one array, or one per camera), npy, or what `point_files` reads."""

import re
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.arrays import Array, IntArray, floats, integers
from sgnlp.base.errors import InputError, unknown
from sgnlp.base.ranges import HEAVIEST, ROUGHEST
from sgnlp.perception import depth_checks, open3d_files, point_files, signatures
from sgnlp.perception.point_arrays import rows
from sgnlp.perception.text_rows import directions

PER_CAMERA = "points_"  # prefix of the keys of a file with one array per camera
NUMBERS = ("table_height", "mass", "friction")  # keys of single numbers
TEXTS = ("name", "half")  # keys of texts; the half of a problem set is tuning or held_out
OBSTACLES = ("obstacle_points", "obstacle")
OPTIONAL_KEYS = (
    *("view", "camera_positions", "background", "background_view", "mesh_vertices", "mesh_faces"),
    *OBSTACLES,
    *("notes", *NUMBERS, *TEXTS),
)
TRANSFORM = "transform"
"""Key of the transform (4, 4) from the frame of the measurement to the file's; for users, not part of the cloud."""
ATTRIBUTES = (
    *("rgb", "rgba", "bgr", "color", "colors", "colour", "colours", "normal", "normals", "intensity", "intensities"),
    *("label", "labels", "mask", "class", "classes", "segment", "segments", "semantic", "instance", "instances"),
    *("id", "ids", "index", "indices", "uv", "confidence", "feature", "features"),
)
"""Words for which `points_<word>` is an attribute of the points and not the points of a camera."""
EXPECTED = (
    "an npz with 'points' (N, 3) in metres or one array 'points_<camera>' per camera, "
    f"or a file ending in .npy {' '.join(point_files.SUFFIXES)}"
)
ROTATION_SLACK = 1e-3
"""Largest deviation of a pose's rotation from an orthogonal matrix: poses have at least four digits."""
MAX_NAME = 100
UNSAFE = re.compile(r"[^\w .+-]")  # in the name of a folder
ZIP_HEADS = (b"PK\x03\x04", b"PK\x05\x06")  # of an archive with files, and of an empty one
NPY_HEAD = b"\x93NUMPY"
CONVERT = (
    "holds pickled objects, which are never read; if you trust it, convert it once: python -c "
    "\"import numpy as np; d = np.load('{file}', allow_pickle=True); "
    "np.savez('converted.npz', **{how})\""
)
"""The one-line command that converts a pickled file to npz."""


def read(path: str | Path, key: str | None = None) -> dict[str, Any]:
    """The cloud in a file as unchecked arguments of `sgnlp.perception.observation.observe`, and its `half`.

    The suffix chooses the reader; all that `point_files` does not read is npz or npy. `key` names the array of an npz
    that holds the points. Raises `InputError` if the file is missing, not a regular file, unreadable, damaged, pickled,
    or without points.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise InputError(f"is a directory; give {EXPECTED}")
        if not path.exists():
            raise InputError("there is no such file")
        if not path.is_file():
            raise InputError(f"is not a regular file; give {EXPECTED}")
        _refuse_others(path)
        if path.suffix.lower() in point_files.SUFFIXES:
            text = point_files.read(path)
            return {"points": text.points, "name": safe_name(path.stem), "notes": text.notes}
        arrays = _arrays(path)
        if isinstance(arrays, dict):
            return _from_arrays(arrays, safe_name(path.stem), key)
        return {"points": arrays, "name": safe_name(path.stem)}
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from error
    except MemoryError as error:
        raise InputError("does not fit into the memory") from error


def _refuse_others(path: Path) -> None:
    """Raise `InputError` for the mesh or the other file that the suffix or the first bytes show."""
    suffix = path.suffix.lower()
    if suffix in (*open3d_files.MESH_SUFFIXES, *open3d_files.OTHER_MESHES) and suffix not in point_files.SUFFIXES:
        raise InputError(f"is a mesh; {signatures.MESH}, or give {EXPECTED}")
    own = (suffix[1:],) if suffix in point_files.SUFFIXES else ("npy", "zip")
    with path.open("rb") as stream:
        signatures.refuse_others(stream.read(signatures.HEAD), *own)


def check_name(name: str) -> None:
    """Raise `InputError` for a name that is a path, or too long or empty for a folder."""
    if (
        not isinstance(name, str)
        or not name.strip(" .")
        or len(name) > MAX_NAME
        or any(c in "/\\" or not c.isprintable() for c in name)
    ):
        raise InputError(f"the name {str(name)[:40]!r} must be 1 to {MAX_NAME} characters without a path")


def safe_name(name: str) -> str:
    """The name as that of a folder: letters, digits, spaces and . _ + - stay, other characters become _."""
    return UNSAFE.sub("_", name).lstrip(" .+-")[:MAX_NAME] or "object"


def check_positive(**values: float | None) -> None:
    """Raise `InputError` for a scale or property of a body that is given and not positive, or in another unit."""
    bounds = {"mass": (HEAVIEST, f" of kg, at most {HEAVIEST:g}"), "friction": (ROUGHEST, f", at most {ROUGHEST:g}")}
    for key, value in values.items():
        most, unit = bounds.get(key, (np.finfo(float).max, ""))
        if value is not None and not (np.asarray(value).dtype.kind in "fiu" and 0 < value <= most):
            raise InputError(f"'{key}' must be a positive number{unit}; found {value!r}")


def checked_pose(value: object, name: str = "pose") -> Array:
    """The pose (4, 4), also from (3, 4). Raises `InputError`, which calls it `name`, if it is not a rigid motion."""
    pose = floats(value, name, (3, 4) if np.asarray(value, object).shape == (3, 4) else (4, 4))
    if len(pose) == 3:
        pose = np.vstack([pose, [0.0, 0, 0, 1]])
    if not np.isfinite(pose).all():
        raise InputError(f"the {name} must be finite")
    R, volume = pose[:3, :3], float(np.linalg.det(pose[:3, :3]))
    size = np.cbrt(abs(volume)) or 1.0
    turn = np.abs(R.T @ R / size**2 - np.eye(3)).max() < ROTATION_SLACK
    if turn and np.array_equal(pose[:, 3], [0, 0, 0, 1]) and pose[3, :3].any():
        raise InputError(f"the {name} is transposed: its translation belongs into the last column; give it by rows")
    rule = f"the {name} must be [[R, t], [0 0 0 1]] with a rotation matrix R, camera to world"
    if not (turn and np.array_equal(pose[3], [0, 0, 0, 1])):
        raise InputError(rule)
    if abs(size - 1) >= ROTATION_SLACK / 2:
        raise InputError(f"{rule}; this one scales by {size:.4g}")
    if volume < 0:
        raise InputError(f"{rule}; this one mirrors, its determinant is -1")
    return pose


def mesh(vertices: object, faces: object) -> tuple[Array, IntArray]:
    """The vertices (U, 3) and faces (F, 3) of a triangle mesh, checked."""
    if vertices is None or faces is None:
        raise InputError("'mesh_vertices' and 'mesh_faces' must be given together")
    corners = floats(vertices, "mesh_vertices", (None, 3))
    triangles = integers(faces, "mesh_faces", (None, 3))
    if not np.isfinite(corners).all():
        raise InputError("'mesh_vertices' must be finite")
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(corners)):
        raise InputError(f"'mesh_faces' must lie in 0..{len(corners) - 1}, the rows of 'mesh_vertices'")
    return corners, triangles


def obstacles(points: object, numbers: object) -> tuple[Array, IntArray] | None:
    """The points (M, 3) of obstacles and the obstacle number (M,) of each, checked; None if there are none.

    Without numbers all belong to obstacle 0.
    """
    if points is None:
        if numbers is not None:
            raise InputError("'obstacle' needs 'obstacle_points'")
        return None
    place = floats(points, "obstacle_points", (None, 3))
    if not np.isfinite(place).all():
        raise InputError("'obstacle_points' must be finite")
    which = np.zeros(len(place), np.int64) if numbers is None else integers(numbers, "obstacle", (None,))
    if len(which) != len(place):
        raise InputError(f"'obstacle' has {len(which)} entries for {len(place)} points")
    return place, which


def _arrays(path: Path) -> dict[str, object] | NDArray[np.generic]:
    """Every array of an npz file, or the one of an npy file, never unpickling anything."""
    arrays: dict[str, object] = {}
    key = "its array"
    with path.open("rb") as stream, warnings.catch_warnings(action="ignore"):
        head = stream.read(len(NPY_HEAD))
        single = head == NPY_HEAD
        if not single and head[:4] not in ZIP_HEADS:
            raise InputError(f"is not an npz; give {EXPECTED}")
        if not single and not zipfile.is_zipfile(stream):  # the directory at its end is missing
            raise InputError("is a truncated npz")
        stream.seek(0)
        try:
            if single:
                return np.asarray(np.load(stream, allow_pickle=False))
            key = "its directory"
            with np.load(stream, allow_pickle=False) as file:
                for key in file.files:
                    arrays[key] = file[key]
        except Exception as error:  # a damaged zip or array header can raise almost anything
            if "allow_pickle" in str(error):
                said = CONVERT.format(
                    file=path.name, how="d.item()" if single else "{k: v.tolist() for k, v in d.items()}"
                )
                raise InputError(said if single else f"'{key}' {said}") from error
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            raise InputError(f"is a damaged {'npy' if single else 'npz'} ({key}: {reason})") from error
    return arrays


def _from_arrays(arrays: dict[str, object], stem: str, chosen: str | None) -> dict[str, Any]:
    if chosen is not None and chosen not in arrays:
        raise unknown("key", chosen, arrays)
    cameras, attributes = ([], []) if chosen is not None else _cameras(arrays)
    points_key = chosen or "points"
    if (points_key in arrays) == bool(cameras):
        fault = "both 'points' and 'points_<camera>'" if cameras else "neither 'points' nor 'points_<camera>'"
        raise InputError(f"has {fault}; {_offer(arrays)}its keys: {', '.join(sorted(arrays)) or 'none'}")
    found: dict[str, Any] = {key: arrays[key] for key in OPTIONAL_KEYS if key in arrays and key != chosen}
    notes = [f"Took {', '.join(attributes)} for attributes of the points, not for cameras."] if attributes else []
    if cameras:
        found["view_names"] = tuple(key.removeprefix(PER_CAMERA) for key in cameras)
        read = [rows(arrays[key], key) for key in cameras]
        clouds = [cloud for cloud, _ in read]
        depth_checks.twins(clouds, [None] * len(clouds), cameras)
        notes += [note for _, said in read for note in said]
        found["view"] = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud in clouds])
        found["points"] = np.concatenate(clouds)
    else:
        found["points"] = arrays[points_key]
    _plain(found, stem)
    ignored = sorted(set(arrays) - {points_key, *cameras, *attributes, *OPTIONAL_KEYS, TRANSFORM})
    notes += [f"Ignored the unknown keys {', '.join(ignored)}."] if ignored else []
    found["notes"] = (*found.get("notes", ()), *notes)
    if TRANSFORM in arrays:
        checked_pose(arrays[TRANSFORM], TRANSFORM)
    return found


def _plain(found: dict[str, Any], stem: str) -> None:
    """Turn the texts and numbers among the arrays into plain ones."""
    found.setdefault("name", stem)
    for key in TEXTS:
        try:
            found[key] = str(found.get(key, ""))
        except Exception as error:  # a string array may hold what is no character
            raise InputError(f"'{key}' is not a text") from error
    if "notes" in found:
        notes = np.asarray(found["notes"])
        if notes.dtype.kind != "U" or notes.ndim != 1:
            raise InputError(f"'notes' must be texts (N,); found {notes.dtype} of shape {notes.shape}")
        found["notes"] = tuple(map(str, notes))
    for key in NUMBERS:
        if key in found:
            one = np.asarray(found[key])
            found[key] = float(floats(one.reshape(()) if one.size == 1 else one, key, ()))


def _cameras(arrays: dict[str, object]) -> tuple[list[str], list[str]]:
    """The keys `points_<camera>`, and those that hold attributes of points instead: colours, normals, labels."""
    keys = sorted(key for key in arrays if key.startswith(PER_CAMERA))
    attributes = [key for key in keys if _is_attribute(key.removeprefix(PER_CAMERA).lower(), np.asarray(arrays[key]))]
    return [key for key in keys if key not in attributes], attributes


def _is_attribute(word: str, array: NDArray[np.generic]) -> bool:
    """Whether it is an attribute: by its name, as bytes (colours), or as rows of length 1 (normals)."""
    if word in ATTRIBUTES or array.dtype == np.uint8:
        return True
    rows_of_three = array.dtype.kind == "f" and array.ndim == 2 and array.shape[1] == 3 and len(array) > 0
    return rows_of_three and directions(array.astype(np.float64))


def _offer(arrays: dict[str, object]) -> str:
    """A hint which arrays could be given as --key."""
    if "tips_pregrasp" in arrays:
        return "it is a result of sgnlp solve, not a cloud; "
    shapes = {key: np.asarray(array) for key, array in arrays.items() if key not in (*OPTIONAL_KEYS, *ATTRIBUTES)}
    fitting = [key for key, a in shapes.items() if a.ndim > 1 and a.shape[-1] == 3 and a.dtype.kind in "fiu"]
    if not fitting and {"x", "y", "z"} <= {key.lower() for key in arrays}:
        return "save points=np.stack([x, y, z], axis=-1); "
    if len(fitting) > 1:
        return f"say which of {', '.join(fitting)} holds the points, such as --key {fitting[0]}; "
    return f"if '{fitting[0]}' holds the points, say --key {fitting[0]}; " if fitting else ""
