"""Where a hand's file says that its description lies."""

import os
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.hand.model import urdf_file


def source(file: Path, folder: Path) -> dict[str, str] | str:
    """The package that carries a description and the path in it; the path from the hand's folder if none does."""
    file = Path(os.path.abspath(file))
    for above in reversed(file.parents):
        inside: dict[str, Any] = {"package": above.name, "path": file.relative_to(above).as_posix()}
        try:
            if above.name and urdf_file(inside, folder).samefile(file):
                return inside
        except InputError:
            continue
    return Path(os.path.relpath(file, os.path.abspath(folder))).as_posix()
