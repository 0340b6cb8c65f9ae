"""The descriptions that come with the package: folders of `urdf/`, each of a hand or of an arm."""

import importlib.resources
from pathlib import Path

from sgnlp.base.errors import unknown


def names(file_name: str) -> tuple[str, ...]:
    """The sorted names of the folders with a file of this name."""
    return tuple(sorted(file.parent.name for file in _folder().glob(f"*/{file_name}")))


def find(kind: str, name_or_folder: str | Path, file_name: str) -> Path:
    """The file in the folder with this name in `urdf/`, or in any folder that has one.

    Raises:
        InputError: there is no such file; the message calls it a `kind`.
    """
    known = names(file_name)
    file = Path(name_or_folder) / file_name
    if str(name_or_folder) in known:
        file = _folder() / str(name_or_folder) / file_name
    if not file.is_file():
        raise unknown(kind, str(name_or_folder), [*known, f"a folder holding {file_name}"])
    return file


def called(folder: Path) -> str:
    """The name by which `find` finds a folder: short for one of `urdf/`, the path of any other."""
    path = folder.resolve()
    return path.name if path == (_folder() / path.name).resolve() else str(path)


def beside(name: str) -> Path | None:
    """The file with this name in a folder of `urdf/`; None if there is none."""
    return next(iter(sorted(_folder().glob(f"*/{name}"))), None)


def _folder() -> Path:
    """The folder `urdf/` in the installed package, else beside it in the source tree."""
    try:
        return Path(str(importlib.resources.files("sgnlp.urdf")))
    except ModuleNotFoundError:
        return Path(__file__).parents[2] / "urdf"
