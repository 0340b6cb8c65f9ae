"""What Open3D reads from files, in a child process: its readers can crash on a damaged file."""

import io
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sgnlp.errors import InputError

MESH_SUFFIXES = (".obj", ".stl", ".ply", ".off")
IMAGE_SUFFIXES = (".png",)
DAMAGED = "is a damaged"
TIMEOUT = 120  # [s]
ABSENT = 70  # exit code of the child that cannot import it
READER = f"""
import os, sys
answer = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # what the library prints goes to stderr
try:
    import io, numpy, open3d
except (ImportError, OSError) as error:
    print(error, file=sys.stderr)
    sys.exit({ABSENT})
content = io.BytesIO()
if sys.argv[2] == "cloud":
    numpy.savez(content, points=open3d.io.read_point_cloud(sys.argv[1]).points)
elif sys.argv[2] == "image":
    numpy.savez(content, pixels=open3d.io.read_image(sys.argv[1]))
else:
    mesh = open3d.io.read_triangle_mesh(sys.argv[1])
    numpy.savez(content, vertices=mesh.vertices, faces=mesh.triangles)
with answer:
    answer.write(content.getvalue())
"""


def points(path: Path) -> NDArray[np.float64]:
    """The points (N, 3) of a .ply or .pcd, in its unit. Raises `InputError` if Open3D cannot read all of it."""
    return _read(path, "cloud")["points"]


def triangles(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (U, 3), in the file's unit, and faces (F, 3) of a .obj, .stl, .ply or .off.

    Raises `InputError` if there is no such file, it is of another kind, or Open3D cannot read all of it.
    """
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise InputError(f"is not a mesh; give a file ending in {' '.join(MESH_SUFFIXES)}")
    if not path.is_file():
        raise InputError("is not a file" if path.exists() else "there is no such file")
    found = _read(path, "mesh")
    if len(found["faces"]) == 0:
        raise InputError(f"holds no triangles that Open3D can read as {path.suffix}")
    return found["vertices"], found["faces"].astype(np.int64)


def pixels(path: Path) -> NDArray[np.generic]:
    """The pixels (height, width) or (height, width, channels) of a .png, of 8 or 16 bits."""
    found = _read(path, "image")["pixels"]
    if found.size == 0:
        raise InputError(f"holds no image that Open3D can read as {path.suffix}")
    return found


def _read(path: Path, kind: str) -> dict[str, NDArray[np.float64]]:
    """The arrays of a file that the child answers with."""
    command = [sys.executable, "-P", "-c", READER, str(path.absolute()), kind]
    try:
        child = subprocess.run(command, capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired as error:
        raise InputError(f"was not read by Open3D within {TIMEOUT} s") from error
    messages = child.stderr.decode(errors="replace").strip().splitlines()
    if child.returncode == ABSENT:
        otherwise = ", or save the cloud as npz" if kind == "cloud" else ""
        raise InputError(
            f"needs Open3D to be read, which cannot be imported here ({messages[-1]}); "
            f"install the system library libusb-1.0 (Debian: libusb-1.0-0){otherwise}"
        )
    # Where a file ends early Open3D prints a warning, if anything, and returns uninitialised rows.
    warned = any("failed" in line or line.startswith("RPly") for line in messages)
    if child.returncode != 0 or warned:
        raise InputError(f"{DAMAGED} {path.suffix} file: Open3D cannot read all of it")
    with np.load(io.BytesIO(child.stdout), allow_pickle=False) as arrays:
        return {key: arrays[key] for key in arrays.files}
