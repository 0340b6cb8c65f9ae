"""Archives that the tests read: whole, and closed again."""

from pathlib import Path
from typing import Any

import numpy as np


def unpacked(file: str | Path) -> dict[str, np.ndarray[Any, Any]]:
    """All arrays of an npz, by name."""
    with np.load(file) as data:
        return dict(data)
