"""Where a hand's file says that its description lies."""

import os
from pathlib import Path

from sgnlp.hand.description.source import packaged


def source(file: Path, folder: Path) -> dict[str, str] | str:
    """The package that carries a description and the path in it; the path from the hand's folder if none does."""
    file = Path(os.path.abspath(file))
    for above in reversed(file.parents):
        path = file.relative_to(above).as_posix()
        found = packaged(above.name, path) if above.name else None
        if found is not None and found.samefile(file):
            return {"package": above.name, "path": path}
    return Path(os.path.relpath(file, os.path.abspath(folder))).as_posix()
