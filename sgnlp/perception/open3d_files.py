"""Files read by Open3D in a child process, because its readers can crash on a damaged file.

Pinocchio's reader, which hands use, is no alternative: a truncated .ply ends the process (measured).
"""

import io
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from sgnlp.base.arrays import Array, IntArray
from sgnlp.base.errors import InputError

MESH_SUFFIXES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf")
OTHER_MESHES = {
    **{".dae": "Collada", ".3mf": "3MF", ".fbx": "FBX", ".blend": "Blender's own", ".wrl": "VRML", ".x3d": "X3D"},
    **{".step": "STEP", ".stp": "STEP", ".iges": "IGES", ".igs": "IGES", ".usd": "USD", ".usdz": "USD", ".3ds": "3DS"},
}
"""Names of mesh formats that are not read."""
GLTF_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation from glTF's axes, with y up, to z up."""
STL_HEAD, STL_FACE = 84, 50
"""Bytes of a binary STL before its faces (the last four are their number), and bytes of each face."""
BARE = re.compile(rb"(?<=[\s+-])\.(?=\d)")
"""The point of a number without a digit before it, such as -.5: the reader of .obj drops the vertex."""
COLOUR_END = "\x1b[0;m"
"""The end of Open3D's lines of warning."""
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
else:
    mesh = open3d.geometry.TriangleMesh()
    if sys.argv[1].lower().endswith(".ply"):
        mesh = open3d.io.read_triangle_mesh(sys.argv[1])
    else:  # as a scene of meshes, of which polygons are cut into triangles
        for part in open3d.io.read_triangle_model(sys.argv[1]).meshes:
            mesh += part.mesh
    numpy.savez(content, vertices=mesh.vertices, faces=mesh.triangles)
with answer:
    answer.write(content.getvalue())
"""


def points(path: Path) -> Array:
    """The points (N, 3) of a .pcd, in its unit. Raises `InputError` if Open3D cannot read all of it."""
    return _read(path, "cloud")["points"]


def triangles(path: Path) -> tuple[Array, IntArray]:
    """Vertices (U, 3), in the file's unit, and faces (F, 3) of a .obj, .stl, .ply, .off, .glb or .gltf; z up.

    Polygons are cut into triangles; glTF's y, which is up by its definition, becomes z. Raises `InputError` if there is
    no such file, it is of another kind, or Open3D cannot read all of it.
    """
    suffix = path.suffix.lower()
    if suffix in OTHER_MESHES:
        how = f"save it as {MESH_SUFFIXES[0]} (FreeCAD or Blender: File, Export)"
        raise InputError(f"is of the format {OTHER_MESHES[suffix]}, which is not read; {how}")
    if suffix not in MESH_SUFFIXES:
        raise InputError(f"is not a mesh; give a file ending in {' '.join(MESH_SUFFIXES)}")
    if not path.is_file():
        raise InputError("is not a file" if path.exists() else "there is no such file")
    _check_mesh_text(path)
    with _readable(path) as file:
        found = _read(file, "mesh")
    if len(found["faces"]) == 0:
        raise InputError(f"holds no triangles that Open3D can read as {path.suffix}")
    vertices = found["vertices"] @ GLTF_UP.T if suffix in (".glb", ".gltf") else found["vertices"]
    return vertices, found["faces"].astype(np.int64)


def _check_mesh_text(path: Path) -> None:
    """Refuse what the reader would silently drop: decimal commas, faces with too few corners, a truncated STL."""
    content = path.read_bytes()
    if path.suffix.lower() == ".stl" and len(content) >= STL_HEAD and not content.lstrip().startswith(b"solid"):
        promised = int.from_bytes(content[STL_HEAD - 4 : STL_HEAD], "little")
        held = (len(content) - STL_HEAD) // STL_FACE
        if promised != held:
            raise InputError(f"says that it has {promised} faces, and holds {held}; export it again")
    if path.suffix.lower() == ".obj":
        for number, line in enumerate(content.split(b"\n"), 1):
            if line.startswith(b"v ") and b"," in line:
                raise InputError(f"has decimal commas (line {number}); write them as points")
            if line.startswith(b"f ") and not line.rstrip().endswith(b"\\") and len(line.split()) < 4:
                raise InputError(f"has a face of less than three corners (line {number}); is the file cut off?")


@contextmanager
def _readable(path: Path) -> Iterator[Path]:
    """The file, or a copy of a .obj with a digit before each point: -0.5 for -.5."""
    content = path.read_bytes() if path.suffix.lower() == ".obj" else b""
    whole = BARE.sub(b"0.", content)
    if whole == content:
        yield path
        return
    with TemporaryDirectory() as folder:
        copy = Path(folder) / "mesh.obj"
        copy.write_bytes(whole)
        yield copy


def _read(path: Path, kind: str) -> dict[str, Array]:
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
    refused = next((line.partition("ASSIMP: ")[2] for line in messages if "ASSIMP: " in line), "")
    if refused:
        raise InputError(f"is a damaged {path.suffix} file: {refused.removesuffix(COLOUR_END)}")
    warned = any("failed" in line or line.startswith("RPly") for line in messages)
    if child.returncode != 0 or warned:
        raise InputError(f"is a damaged {path.suffix} file: Open3D cannot read all of it")
    with np.load(io.BytesIO(child.stdout), allow_pickle=False) as arrays:
        return {key: arrays[key] for key in arrays.files}
