"""The reference to the description in a hand's file."""

import os
from pathlib import Path

from sgnlp.hand.description.source import packaged


def source(file: Path, folder: Path) -> dict[str, str] | str:
    """The package of a description and the path in it; without a package the path from the hand's folder."""
    file = Path(os.path.abspath(file))
    for above in reversed(file.parents):
        path = file.relative_to(above).as_posix()
        found = packaged(above.name, path) if above.name else None
        if found is not None and found.samefile(file):
            return {"package": above.name, "path": path}
    return Path(os.path.relpath(file, os.path.abspath(folder))).as_posix()
