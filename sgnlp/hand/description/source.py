"""The path of a description's file: beside the hand's file, or in an installed package."""

import functools
import importlib.metadata
import os
import sys
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError, NotInstalledError
from sgnlp.base.yaml_nodes import mapping, word

SHARE = "AMENT_PREFIX_PATH"
"""The environment variable with ROS 2's list of installed packages."""


def source_file(source: Any, folder: Path) -> Path:
    """The URDF or MJCF: a file beside the YAML, or a `path` in the installed `package`; `install` installs it.

    Raises:
        NotInstalledError: the package, or the file in it, is missing.
        InputError: the file beside the YAML is missing.
    """
    if isinstance(source, str):
        if not (folder / source).is_file():
            raise InputError(f"the URDF {source} is not there; name a file beside this one, or package and path")
        return folder / source
    told = mapping(source, "urdf", ("package", "path"), ("install",))
    parts = {key: word(value, f"{key} of urdf") for key, value in told.items()}
    file = packaged(parts["package"], parts["path"])
    if file is None:
        command = parts.get("install", "")
        remedy = f"install its package: {command}" if command else "is its package installed?"
        raise NotInstalledError(f"the URDF {parts['path']} of {parts['package']} is not there; {remedy}", command)
    return file


@functools.cache
def packaged(package: str, path: str) -> Path | None:
    """A file of a package installed by ROS, conda, a source build or pip; None if there is none."""
    prefixes = [sys.prefix, *filter(None, os.environ.get(SHARE, "").split(os.pathsep))]
    for prefix in prefixes:
        if (shared := Path(prefix) / "share" / package / path).is_file():
            return shared
    found = (Path(str(f.locate())) for f in _files(package) if str(f).endswith(f"{package}/{path}"))
    return next((file for file in found if file.is_file()), None)


@functools.cache
def _files(package: str) -> list[importlib.metadata.PackagePath]:
    """The files of a pip package; empty if there is no such package. There may be thousands."""
    try:
        return importlib.metadata.files(package) or []
    except (importlib.metadata.PackageNotFoundError, ValueError):
        return []
