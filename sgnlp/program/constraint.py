"""A constraint: rows with bounds, and the check that a finished grasp satisfies them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import acos, degrees, exp, inf
from operator import attrgetter
from typing import Any

import numpy as np

from sgnlp.base.checked import plain, require, types_of
from sgnlp.base.errors import InputError
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Exact, Ops

TOLERANCE = 1e-3
"""Tolerance of a constraint without its own, over its scale: 0.01 mm, 1 mN, a margin of 0.001."""


@dataclass(frozen=True)
class Unit:
    """The unit of a row: a row of 1 is `scale` in SI units; `reading` converts SI units to `symbol`, as in tables."""

    symbol: str
    scale: float = 1.0
    reading: Callable[[float], float] = float


def _milli(value: float) -> float:
    return 1e3 * value


def _angle_deg(trace: float) -> float:
    """The angle [deg] of a rotation with this trace, 1 + 2 cos."""
    return degrees(acos(min(max((trace - 1) / 2, -1.0), 1.0)))


NUMBER = Unit("")
LENGTH = Unit("mm", 0.01, _milli)
FORCE = Unit("N")
STIFFNESS = Unit("mN m", 0.01, _milli)
"""Of ρ."""
TORQUE = Unit("N m", 0.1)
"""Unit of the net torque: forces of a few newtons at a few centimetres."""
EFFORT = Unit("of the effort")
GAIN = Unit("N/m", 100.0)
TRACE = Unit("deg", 1.0, _angle_deg)
ANGLE = Unit("rad")
RATIO = Unit("of that at home", 1.0, exp)
"""Of a logarithm."""
SCALED = ("mm", "cm", "deg", "°", "mN", "kN", "mN m", "N mm", "g")
"""Symbols of what is no SI unit: a bound in it would be taken for one in SI units."""
UNITS = {"": NUMBER, "m": LENGTH, "N": FORCE, "N m": TORQUE, "N/m": GAIN}
"""Units by SI symbol; any other symbol is used as it is, with a scale of 1."""


@dataclass(frozen=True)
class Check:
    """The worst row of a constraint, without smoothing: `value` must be between `lower` and `upper`, all in `unit`.

    `passed` is whether that holds within the `tolerance`; NaN never passes. `row` names the worst row.
    """

    name: str
    value: float
    lower: float
    upper: float
    tolerance: float
    unit: str
    passed: bool
    row: str = ""  # name of the worst row

    @property
    def demand(self) -> str:
        """The required value: "≥ 5 mN m", "0 ± 2 mm", "4 to 10 N"."""
        if self.lower == self.upper:
            text = f"{self.lower:.3g} ± {self.tolerance:.3g}"
        elif self.upper == inf:
            text = f"≥ {self.lower:.3g}"
        elif self.lower == -inf:
            text = f"≤ {self.upper:.3g}"
        else:
            text = f"{self.lower:.3g} to {self.upper:.3g}"
        return f"{text} {self.unit}".rstrip()


@dataclass(frozen=True)
class Rows:
    """The part of a grasp of this name, or one of its rows, or an operation on it; unlike a lambda, it pickles."""

    part: str
    operation: str = ""
    row: int | None = None

    def __call__(self, g: Grasp, op: Ops) -> Any:
        """The rows of a constraint."""
        value = attrgetter(self.part)(g)
        if self.row is not None:
            return value[self.row, :]
        return getattr(op, self.operation)(value) if self.operation else value


def is_own(part: Any) -> bool:
    """Whether a class or function is the user's own, and not of this package."""
    return not str(getattr(part, "__module__", "")).startswith("sgnlp.")


@dataclass(frozen=True)
class Constraint:
    """Rows lower ≤ value(g) ≤ upper of a grasp g.

    Attributes:
        name: name in tables, in the names of rows and in `Solution.violated`.
        value: function (grasp, op) → rows, in SI units, written once in the operations of `Ops` for CasADi and NumPy.
        lower: bound of every row, in SI units.
        upper: bound of every row.
        unit: SI symbol of `UNITS`, another symbol, or a `Unit`; rows are divided by its scale for the solver.
        tolerance: largest violation of the exact rows in a feasible grasp, in SI units.
        over: what the rows range over, a key of `names.labels`; other rows are numbered.
        about: what it requires, in a few words.
        always: whether it bounds the penalty formulation too.
        domain: whether it keeps the functions defined; the elastic formulation never relaxes such a constraint.
        of_arm: whether it needs `g.arm`; the first of two phases has no arm and leaves it out.
        source: hash of the file that it was loaded from; part of the key of compiled functions.

    Raises:
        InputError: a field is of another kind than its type, the bounds are crossed or not numbers, or the tolerance is
            negative.
    """

    name: str
    value: Callable[[Grasp, Ops], Any]
    lower: float = -inf
    upper: float = inf
    unit: Unit | str = NUMBER
    tolerance: float | None = None
    over: str = ""
    about: str = ""
    always: bool = False
    domain: bool = False
    of_arm: bool = False
    source: str = ""

    def __post_init__(self) -> None:
        """Resolve the unit and the tolerance."""
        for name, kind in types_of(Constraint).items():
            object.__setattr__(self, name, plain(getattr(self, name)))
            require(f"{name} of constraint '{self.name}'", getattr(self, name), kind)
        if not self.lower <= self.upper:
            raise InputError(f"constraint '{self.name}' has the bounds {self.lower:g} to {self.upper:g}")
        if self.unit in SCALED:
            rule = f"its bounds are in SI units; valid: {', '.join(map(repr, UNITS))}, or a `Unit`"
            raise InputError(f"constraint '{self.name}' has the unit '{self.unit}': {rule}")
        if isinstance(self.unit, str):
            object.__setattr__(self, "unit", UNITS.get(self.unit, Unit(self.unit)))
        if self.tolerance is None:
            object.__setattr__(self, "tolerance", TOLERANCE * self.scale)
        elif not self.tolerance >= 0:
            raise InputError(f"tolerance of constraint '{self.name}' must be at least 0, not {self.tolerance:g}")

    @property
    def scale(self) -> float:
        """The value of a row of 1, in SI units."""
        assert isinstance(self.unit, Unit)
        return self.unit.scale

    @property
    def bounded(self) -> bool:
        """Whether it bounds anything."""
        return self.lower > -inf or self.upper < inf

    @property
    def symbol(self) -> str:
        """The unit of tables."""
        assert isinstance(self.unit, Unit)
        return self.unit.symbol

    def reading(self, value: float) -> float:
        """A value in SI units, converted to the unit of tables."""
        assert isinstance(self.unit, Unit)
        return self.unit.reading(value)

    def check(self, g: Grasp, rows: Sequence[str] = ()) -> Check | None:
        """The exact check of a grasp, without any smoothing; None if there is no row. `rows` are their names."""
        assert self.tolerance is not None
        values = np.asarray(self.value(g, Exact()), dtype=float).ravel(order="F")
        if not values.size:
            return None
        excess = np.maximum(self.lower - values, values - self.upper)
        worst = int(np.argmax(np.where(np.isnan(excess), inf, excess)))
        low, high = sorted(map(self.reading, (self.lower, self.upper)))
        near = self.lower if self.lower > -inf else self.upper
        return Check(
            name=self.name,
            value=self.reading(float(values[worst])),
            lower=low,
            upper=high,
            tolerance=abs(self.reading(near) - self.reading(near - self.tolerance)),
            unit=self.symbol,
            passed=bool(excess[worst] <= self.tolerance),
            row=rows[worst] if rows else "",
        )
