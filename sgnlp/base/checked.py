"""Settings that know which of their values are valid."""

from dataclasses import fields
from math import inf, isfinite
from typing import Any, ClassVar, Literal, get_args, get_origin, get_type_hints

from sgnlp.base.errors import InputError, unknown

Interval = tuple[float, float]
POSITIVE: Interval = (5e-324, 1.8e308)
"""From the smallest to the largest finite number."""
NOT_NEGATIVE: Interval = (0.0, 1.8e308)


class Checked:
    """Settings that refuse values outside the intervals of `valid` (closed), NaN, and unknown names."""

    section: ClassVar[str] = ""
    valid: ClassVar[dict[str, Interval]] = {}

    def __post_init__(self) -> None:
        """Raise `InputError` naming the first field whose value is not valid."""
        hints = get_type_hints(type(self))
        for f in fields(self):  # type: ignore[arg-type]
            if isinstance(getattr(self, f.name), list):  # as JSON has them
                object.__setattr__(self, f.name, tuple(getattr(self, f.name)))
            names = get_args(hints[f.name]) if get_origin(hints[f.name]) is Literal else ()
            self._check(f.name, getattr(self, f.name), names)

    def _check(self, name: str, value: Any, names: tuple[str, ...]) -> None:
        flag = f"{self.section}.{name}".lstrip(".").replace("_", "-")
        if names and value not in names:
            raise unknown(f"value of --{flag}", value, names)
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float | int) and not isfinite(number):
                raise InputError(f"--{flag} must be a finite number, not {number}")
        low, high = self.valid.get(name, (-inf, inf))
        if name in self.valid and value is not None and not low <= value <= high:
            bounds = f"at least {low:g}" if high == POSITIVE[1] else f"between {low:g} and {high:g}"
            raise InputError(f"--{flag} must be {'positive' if (low, high) == POSITIVE else bounds}, not {value:g}")

    def _ordered(self, low: str, high: str) -> None:
        if getattr(self, low) > getattr(self, high):
            names = [f"--{self.section}.{name}".replace("_", "-") for name in (low, high)]
            raise InputError(f"{names[0]} is above {names[1]}: {getattr(self, low):g} > {getattr(self, high):g}")
