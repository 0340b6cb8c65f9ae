"""Points with values and noise, the parts of a training set."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from sgnlp.base.arrays import Array


@dataclass(frozen=True, eq=False)
class Samples:
    """Points X (N, 3) [m], values y (N,) [m], noise deviations (N,) [m]."""

    X: Array
    y: Array
    noise: Array

    @classmethod
    def of(cls, X: Array, y: Array | float, noise: float) -> Self:
        """Points with the same noise, and with one value each or one for all."""
        return cls(X, np.broadcast_to(np.asarray(y, float), len(X)), np.full(len(X), noise))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All points of several, in their order."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("X", "y", "noise")))
