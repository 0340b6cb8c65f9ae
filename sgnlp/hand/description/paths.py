"""The paths of a description's meshes."""

import difflib
import os
from pathlib import Path
from urllib.parse import unquote

from sgnlp.base.errors import InputError
from sgnlp.hand.description.source import packaged

MESH_SUFFIXES = (".stl", ".obj", ".dae", ".ply", ".off", ".glb", ".gltf")
LFS_POINTER = b"version https://git-lfs"
"""The beginning of a file that Git LFS has not fetched yet."""


def mesh_file(text: str, folder: Path, owner: str) -> Path:
    """The path of a mesh that a description in a folder names.

    `package://NAME/` is any folder of that name above the folder, or an installed package.

    Raises:
        InputError: the file does not exist, or is not a mesh; the message names its `owner`.
    """
    scheme, colon, rest = text.partition("://")
    if not colon:
        candidates = [folder / text.replace("\\", "/")]
    elif scheme == "file":
        candidates = [folder / unquote(rest)]
    else:
        package, _, inner = rest.partition("/")
        candidates = _of_package(package, inner, folder) if scheme == "package" else []
    found = next((path for path in candidates if text and path.is_file()), None)
    if found is None:
        forms = (
            "the path from the URDF's folder, package://NAME/PATH with NAME a folder above the URDF or an installed "
            "package, or file:///PATH"
        )
        raise InputError(f"{owner}: the mesh '{text}' is not there; valid are {forms}{_beside(text, folder)}")
    if found.suffix.lower() not in MESH_SUFFIXES:
        raise InputError(f"{owner}: the mesh '{text}' must end in {' '.join(MESH_SUFFIXES)}; convert it")
    with found.open("rb") as stream:
        head = stream.read(len(LFS_POINTER))
    if not head:
        raise InputError(f"{owner}: the mesh '{text}' is empty; export it again")
    if head == LFS_POINTER:
        raise InputError(f"{owner}: the mesh '{text}' is a pointer of Git LFS; fetch what it stands for: git lfs pull")
    return Path(os.path.abspath(found))


def _of_package(package: str, path: str, folder: Path) -> list[Path]:
    """Possible paths of a package's file: below a folder with its name above `folder`, or in installed packages."""
    above = [place / path for place in (folder, *folder.parents) if place.name == package]
    installed = packaged(package, path) if path else None
    return above if installed is None else [*above, installed]


def _beside(text: str, folder: Path) -> str:
    """A hint for a missing path whose end is a file in the URDF's folder, or below the folder above it."""
    parts = [part for part in text.replace("\\", "/").split("/") if part]
    for start in range(len(parts)):
        inner = "/".join(parts[start:])
        for place, prefix in ((folder, ""), (folder.parent, "../")):
            if (place / inner).is_file():
                return f"; '{prefix}{inner}' is there"
        near = difflib.get_close_matches(parts[-1], [f.name for f in folder.glob("*.*")], 1)
        if start == len(parts) - 1 and near:
            return f"; '{near[0]}' is there"
    return ""
