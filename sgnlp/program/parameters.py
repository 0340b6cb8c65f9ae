"""The parameters of the nonlinear program as one vector with named blocks."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array


class ParameterVector:
    """Named blocks of given sizes, in order."""

    def __init__(self, sizes: Mapping[str, int]):
        self.sizes = dict(sizes)

    def symbols(self) -> tuple[ca.SX, SimpleNamespace]:
        """The symbolic vector and a namespace of its blocks."""
        blocks = {name: ca.SX.sym(name, size) for name, size in self.sizes.items()}
        return ca.vertcat(*blocks.values()), SimpleNamespace(**blocks)

    def unpack(self, p: Array) -> SimpleNamespace:
        """The blocks of a numeric vector."""
        blocks = np.split(p, np.cumsum(list(self.sizes.values()))[:-1])
        return SimpleNamespace(**dict(zip(self.sizes, blocks, strict=True)))

    def pack(self, values: Mapping[str, Any]) -> Array:
        """The numeric vector; every block must be given, with its size."""
        parts = [np.atleast_1d(np.asarray(values[name], dtype=float)).ravel() for name in self.sizes]
        for part, (name, size) in zip(parts, self.sizes.items(), strict=True):
            if part.size != size:
                raise ValueError(f"parameter '{name}' has {part.size} numbers, not {size}")
        return np.concatenate(parts)
