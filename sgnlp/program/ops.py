"""The elementary operations of energy terms and constraints, smooth for the solver and exact for the result.

An energy term or constraint is written once in these operations. `Smooth` evaluates it as a CasADi expression that is
twice continuously differentiable, with its widths as parameters; `Exact` evaluates it in NumPy, as printed.
Arrays of m fingers are (m,) or (m, 3); `norm` and `dot` work along rows.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca
import numpy as np

LOG_CUT = 0.02
"""Below this the exact logarithm is replaced by its tangent there: finite, and similar to the smooth one."""
MIN_NORM = 1e-12
"""Guard of exact divisions by a norm."""
ROUND_NORM = 1e-4
"""Rounding of a smooth norm at 0 [m or N]: 0.25 µm at 20 mm, 5 nN at 1 N."""


class Ops(Protocol):
    """The operations that a term or constraint may use."""

    def sum(self, x: Any) -> Any: ...  # noqa: D102
    def stack(self, *parts: Any) -> Any: ...  # noqa: D102
    def dot(self, A: Any, B: Any) -> Any: ...  # noqa: D102
    def norm(self, A: Any) -> Any: ...  # noqa: D102
    def square(self, A: Any) -> Any: ...  # noqa: D102
    def abs(self, d: Any) -> Any: ...  # noqa: D102
    def hinge(self, d: Any) -> Any: ...  # noqa: D102
    def log(self, u: Any) -> Any: ...  # noqa: D102
    def least(self, bound: Any, f: Any) -> Any: ...  # noqa: D102
    def closest(self, first: Any, *others: Any) -> Any: ...  # noqa: D102
    def residual(self, A: Any) -> Any: ...  # noqa: D102
    def fingers(self, x: Any, K: int) -> Any: ...  # noqa: D102
    def density(self, d: Any, s: Any) -> Any: ...  # noqa: D102


@dataclass(frozen=True)
class Smooth:
    """Smooth forms over CasADi; each width is a number or a symbol (see `settings.Smoothing`)."""

    distance: Any
    collision: Any
    log_width: Any
    force: Any
    deviation: Any
    exponent: Any
    lift: Callable[..., Any] = lambda name, value, **_: value
    """lifting of `sgnlp.program.lifting`, for quantities that shorten derivatives"""

    def sum(self, x: ca.SX) -> ca.SX:
        """Sum of all elements."""
        return ca.sum1(ca.vec(x))

    def stack(self, *parts: ca.SX) -> ca.SX:
        """The elements of all parts in a row (k,)."""
        return ca.vertcat(*[ca.vec(ca.SX(part)) for part in parts])

    def fingers(self, x: ca.SX, K: int) -> ca.SX:
        """Sums (m,) of the K samples of each finger in x (m K,)."""
        return self.lift("of_fingers", ca.sum1(ca.reshape(x, K, -1)).T, late=True)

    def dot(self, A: ca.SX, B: ca.SX) -> ca.SX:
        """Row by row (m,)."""
        return ca.sum2(A * B)

    def norm(self, A: ca.SX) -> ca.SX:
        """√(|a|² + w²) row by row (m,)."""
        return ca.sqrt(ca.sum2(A**2) + ROUND_NORM**2)

    def square(self, A: ca.SX) -> ca.SX:
        """Sum of squares."""
        return ca.sumsqr(A)

    def abs(self, d: ca.SX) -> ca.SX:
        """√(d² + δ²)."""
        return ca.sqrt(d**2 + self.distance**2)

    def hinge(self, d: ca.SX) -> ca.SX:
        """w softplus(d/w) for max(0, d), in the form that cannot overflow and has its derivatives at 0 too."""
        z = d / self.collision
        top = ca.fmax(z, 0)
        return self.collision * (top + ca.log(ca.exp(z - top) + ca.exp(-top)))

    def log(self, u: ca.SX) -> ca.SX:
        """log((u + √(u² + 4η²))/2): log u for u ≫ η; for u < 0 it is defined, and still has a slope towards the
        cone."""
        return ca.log(self.log_width) + ca.asinh(u / (2 * self.log_width))

    def least(self, bound: ca.SX, f: ca.SX) -> ca.SX:
        """min(bound, f) rounded over the width w."""
        return (bound + f - ca.sqrt((bound - f) ** 2 + self.force**2)) / 2

    def closest(self, first: ca.SX, *others: ca.SX) -> ca.SX:
        """The least of several distances, element by element: (a + b - √((a - b)² + w²))/2, pair after pair."""
        for other in others:
            first = (first + other - ca.sqrt((first - other) ** 2 + self.collision**2)) / 2
        return first

    def residual(self, A: ca.SX) -> ca.SX:
        """√(|a|² + w²) row by row (m,), the size of a residual; w is the width of forces."""
        return ca.sqrt(ca.sum2(A**2) + self.force**2)

    def density(self, d: ca.SX, s: ca.SX) -> ca.SX:
        """Normal density of deviation s at d, s bounded below and the exponent bounded above."""
        s2 = s**2 + self.deviation**2
        z = d**2 / (2 * s2)
        return self.lift("density", ca.exp(-z / (1 + z / self.exponent)) / ca.sqrt(2 * ca.pi * s2))


@dataclass(frozen=True)
class Exact:
    """The operations as printed, over NumPy."""

    def sum(self, x: Any) -> float:
        """Sum of all elements."""
        return float(np.sum(x))

    def stack(self, *parts: Any) -> Any:
        """The elements of all parts in a row (k,)."""
        return np.concatenate([np.ravel(part, order="F") for part in parts])

    def fingers(self, x: Any, K: int) -> Any:
        """Sums (m,) of the K samples of each finger in x (m K,)."""
        return np.reshape(x, (-1, K)).sum(axis=1)

    def dot(self, A: Any, B: Any) -> Any:
        """Row by row (m,)."""
        return np.sum(A * B, axis=1)

    def norm(self, A: Any) -> Any:
        """Row by row (m,)."""
        return np.maximum(np.linalg.norm(A, axis=1), MIN_NORM)

    def square(self, A: Any) -> float:
        """Sum of squares."""
        return float(np.sum(A**2))

    def abs(self, d: Any) -> Any:
        """|d|."""
        return np.abs(d)

    def hinge(self, d: Any) -> Any:
        """max(0, d)."""
        return np.maximum(d, 0.0)

    def log(self, u: Any) -> Any:
        """Logarithm of u, continued below `LOG_CUT` by its tangent."""
        return np.where(u > LOG_CUT, np.log(np.maximum(u, LOG_CUT)), np.log(LOG_CUT) + u / LOG_CUT - 1)

    def least(self, bound: Any, f: Any) -> Any:
        """min(bound, f)."""
        return np.minimum(bound, f)

    def closest(self, first: Any, *others: Any) -> Any:
        """The least of several distances, element by element."""
        return np.min([first, *others], axis=0)

    def residual(self, A: Any) -> Any:
        """|a| row by row."""
        return np.linalg.norm(A, axis=1)

    def density(self, d: Any, s: Any) -> Any:
        """Normal density of deviation s at d."""
        s = np.maximum(s, MIN_NORM)
        return np.exp(-((d / s) ** 2) / 2) / (np.sqrt(2 * np.pi) * s)
