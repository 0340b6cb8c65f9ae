"""Settings that check their own values."""

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from math import isfinite
from typing import Annotated, Any, ClassVar, Literal, Self, get_args, get_origin, get_type_hints

from sgnlp.base.errors import InputError, unknown

Interval = tuple[float, float]
"""The smallest and the largest valid value, given in the type of a field: `Annotated[int, (1, 10)]`."""
POSITIVE: Interval = (5e-324, 1.8e308)
"""From the smallest to the largest finite number."""
NOT_NEGATIVE: Interval = (0.0, 1.8e308)
Positive = Annotated[float, POSITIVE]
NotNegative = Annotated[float, NOT_NEGATIVE]


class Checked:
    """Settings that refuse NaN, unknown names, and values outside the interval of their field's type."""

    section: ClassVar[str] = ""

    def __post_init__(self) -> None:
        """Raise `InputError` naming the first field whose value is not valid."""
        for f in fields(self):  # type: ignore[arg-type]
            if isinstance(getattr(self, f.name), list):  # JSON has lists instead of tuples
                object.__setattr__(self, f.name, tuple(getattr(self, f.name)))
            self._check(f.name, getattr(self, f.name))

    @classmethod
    def names(cls, name: str) -> tuple[str, ...]:
        """The valid values of a field that takes one of several names; empty for other fields."""
        kind = _types(cls)[name]  # type: ignore[arg-type]
        return get_args(kind) if get_origin(kind) is Literal else ()

    @classmethod
    def interval(cls, name: str) -> Interval | None:
        """The interval of a field; None if it has none."""
        metadata = getattr(_types(cls)[name], "__metadata__", ())  # type: ignore[arg-type]
        return next((each for each in metadata if isinstance(each, tuple)), None)

    @classmethod
    def restored(cls, values: Mapping[str, Any]) -> Self:
        """The settings from plain values, as `asdict` gives them. Names from other versions are ignored."""
        types = _types(cls)  # type: ignore[arg-type]
        known = {name: value for name, value in values.items() if name in types}
        return cls(**{n: types[n].restored(v) if isinstance(v, Mapping) else v for n, v in known.items()})

    def _check(self, name: str, value: Any) -> None:
        flag, names = f"{self.section}.{name}".lstrip(".").replace("_", "-"), self.names(name)
        if names and value not in names:
            raise unknown(f"value of --{flag}", value, names)
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float | int) and not isfinite(number):
                raise InputError(f"--{flag} must be a finite number, not {number}")
        interval = self.interval(name)
        if interval is not None and value is not None and not interval[0] <= value <= interval[1]:
            bounds = (
                f"at least {interval[0]:g}" if interval[1] == POSITIVE[1] else "between {:g} and {:g}".format(*interval)
            )
            raise InputError(f"--{flag} must be {'positive' if interval == POSITIVE else bounds}, not {value:g}")

    def _ordered(self, low: str, high: str) -> None:
        if getattr(self, low) > getattr(self, high):
            names = [f"--{self.section}.{name}".replace("_", "-") for name in (low, high)]
            raise InputError(f"{names[0]} is above {names[1]}: {getattr(self, low):g} > {getattr(self, high):g}")


@cache
def _types(kind: type) -> dict[str, Any]:
    """The types of the fields of a class, with the extras of `Annotated`."""
    return get_type_hints(kind, include_extras=True)
