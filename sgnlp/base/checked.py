"""Settings, other dataclasses and functions that check their values."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import fields
from functools import cache, wraps
from math import inf, isfinite
from numbers import Integral
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from sgnlp.base.errors import InputError, KindError, unknown

Interval = tuple[float, float]
"""The smallest and the largest valid value, given in the type of a field: `Annotated[int, (1, 10)]`."""
POSITIVE: Interval = (5e-324, 1.8e308)
"""From the smallest to the largest finite number."""
NOT_NEGATIVE: Interval = (0.0, 1.8e308)
Positive = Annotated[float, POSITIVE]
NotNegative = Annotated[float, NOT_NEGATIVE]
NUMBERS: dict[Any, tuple[type, ...]] = {float: (float, np.floating, Integral), int: (Integral,)}
INSTANCES: dict[Any, tuple[type, ...]] = {**NUMBERS, Path: (PathLike,), bool: (bool, np.bool_)}
"""What is of a kind beside the kind itself."""
Function = TypeVar("Function", bound=Callable[..., Any])
VARIADIC = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
WORDS: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    bool: "True or False",
    str: "a text",
    NoneType: "None",
    Callable: "a function",
    Path: "a path",
    np.ndarray: "an array",
    Set: "a set",
}
"""Kinds in words."""


class Checked:
    """Settings that refuse NaN, unknown names, and values of another kind or outside the interval of their field."""

    section: ClassVar[str] = ""

    def __post_init__(self) -> None:
        """Raise `InputError` naming the first field whose value is not valid."""
        for f in fields(self):  # type: ignore[arg-type]
            value = plain(getattr(self, f.name))
            object.__setattr__(self, f.name, value)
            if not type(value).__module__.startswith("tyro"):  # the default of a flag that is required
                self._check(f.name, value)

    @classmethod
    def names(cls, name: str) -> tuple[str, ...]:
        """The valid values of a field that takes one of several names; empty for other fields."""
        kind = types_of(cls)[name]  # type: ignore[arg-type]
        return get_args(kind) if get_origin(kind) is Literal else ()

    @classmethod
    def interval(cls, name: str) -> Interval | None:
        """The interval of a field; None if it has none."""
        metadata = getattr(types_of(cls)[name], "__metadata__", ())  # type: ignore[arg-type]
        return next((each for each in metadata if isinstance(each, tuple)), None)

    @classmethod
    def restored(cls, values: Mapping[str, Any]) -> Self:
        """The settings from plain values, as `asdict` gives them. Names from other versions are ignored."""
        types = types_of(cls)  # type: ignore[arg-type]
        known = {name: value for name, value in values.items() if name in types}
        return cls(**{n: types[n].restored(v) if isinstance(v, Mapping) else v for n, v in known.items()})

    def _check(self, name: str, value: Any) -> None:
        flag, names = f"{self.section}.{name}".lstrip(".").replace("_", "-"), self.names(name)
        if names and value not in names:
            raise unknown(f"value of --{flag}", value, names)
        require(f"--{flag}", value, types_of(type(self))[name])  # type: ignore[arg-type]
        low, high = self.interval(name) or (-inf, inf)
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float | int) and not isfinite(number):
                raise InputError(f"--{flag} must be a finite number, not {number}")
            if isinstance(number, float | int) and not low <= number <= high:
                raise InputError(f"--{flag} must be {_bounds(low, high)}, not {number:g}")

    def _ordered(self, low: str, high: str) -> None:
        if getattr(self, low) > getattr(self, high):
            names = [f"--{self.section}.{name}".replace("_", "-") for name in (low, high)]
            raise InputError(f"{names[0]} is above {names[1]}: {getattr(self, low):g} > {getattr(self, high):g}")


class Typed:
    """A dataclass whose fields are of their types; `called` is what messages call it."""

    called: ClassVar[str] = ""

    def __post_init__(self) -> None:
        """Raise `InputError` naming the first field that is of another kind."""
        require_fields(self, self.called, [f.name for f in fields(self)])  # type: ignore[arg-type]


def require_fields(thing: Any, what: str, names: Iterable[str]) -> None:
    """Raise `KindError` for the first of these fields of a dataclass, which is called so, that is of another kind."""
    kinds = types_of(type(thing))  # type: ignore[arg-type]
    for name in names:
        require(f"the {name} of {what}", getattr(thing, name), kinds[name])


def typed(function: Function) -> Function:
    """The function, which raises `InputError` for the first argument that is of another kind than its type, by name."""
    signature = inspect.signature(function)

    @wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        try:
            given, kinds = signature.bind(*args, **kwargs).arguments, types_of(function)
        except TypeError:  # Python's own words name the function
            return function(*args, **kwargs)
        for name, value in given.items():
            if name in kinds and signature.parameters[name].kind not in VARIADIC:
                require(name, value, kinds[name])
        return function(*args, **kwargs)

    return checked  # type: ignore[return-value]


def _bounds(low: float, high: float) -> str:
    """What an interval asks for."""
    if low == POSITIVE[0]:
        return "positive" if high == POSITIVE[1] else f"positive and at most {high:g}"
    return f"at least {low:g}" if high == POSITIVE[1] else f"between {low:g} and {high:g}"


def plain(value: Any) -> Any:
    """A value with Python's numbers for numpy's, and tuples for lists, which JSON has instead."""
    if isinstance(value, np.ndarray | np.generic):
        single = value.dtype.kind == "f" and value.dtype.itemsize < np.dtype(float).itemsize
        value = _written(value) if single else value.tolist()
    return tuple(map(plain, value)) if type(value) in (list, tuple) else value


def _written(values: np.ndarray | np.generic) -> Any:
    """Numbers of single precision as they are written: 0.002, not 0.0020000000949949."""
    numbers = [float(np.format_float_scientific(number)) for number in np.ravel(values)]
    return np.reshape(numbers, np.shape(values)).tolist()


def require(what: str, value: Any, kind: Any) -> None:
    """Raise `KindError` unless a value is of a kind."""
    if not _fits(value, kind):
        raise KindError(f"{what} must be {_words(kind)}, not {' '.join(repr(value).split()):.60}")


def _fits(value: Any, kind: Any) -> bool:
    """Whether a value is of the kind that a field's type names. A whole number is a number too, a bool is none."""
    origin, args = get_origin(kind), get_args(kind)
    if isinstance(value, np.ndarray) and value.ndim == 0 and kind in NUMBERS:  # a number in an npz
        value = value[()]
    if kind is Any or isinstance(kind, TypeVar) or getattr(origin or kind, "_is_protocol", False):
        return True
    if origin is Annotated:
        return _fits(value, args[0])
    if origin in (Union, UnionType):
        return any(_fits(value, each) for each in args)
    if origin is Literal:
        return any(type(value) is type(each) and value == each for each in args)
    if origin is tuple and isinstance(value, tuple):
        kinds = args[:1] * len(value) if args[-1] is ... else args
        return len(value) == len(kinds) and all(map(_fits, value, kinds))
    if origin is type:
        return isinstance(value, type) and issubclass(value, args)
    if origin is Sequence and isinstance(value, np.ndarray) and value.ndim == 1:
        value = value.tolist()
    if origin is Sequence and isinstance(value, list | tuple):
        return all(_fits(each, args[0]) for each in value)
    if origin is Sequence and isinstance(value, str | bytes):
        return False
    return isinstance(value, INSTANCES.get(kind, origin or kind)) and not (kind in NUMBERS and isinstance(value, bool))


def _words(kind: Any) -> str:
    """What a kind is called."""
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _words(args[0])
    if origin in (Union, UnionType):
        return " or ".join(map(_words, args))
    if origin is tuple:
        return f"a tuple of {'any length' if args[-1] is ... else len(args)}, each part {_words(args[0])}"
    if origin is Sequence:
        return f"a list, each part {_words(args[0])}"
    if origin is Literal:
        return f"one of {', '.join(map(repr, args))}"
    return WORDS.get(origin or kind) or f"of {getattr(kind, '__name__', kind)}"


@cache
def types_of(kind: Any) -> dict[str, Any]:
    """The types of the fields of a class, or of the arguments of a function, with the extras of `Annotated`."""
    return get_type_hints(kind, include_extras=True)
