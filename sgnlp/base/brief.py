"""Objects in a few words, for those whose arrays would fill the screen of a notebook."""

from dataclasses import fields
from pathlib import Path
from reprlib import Repr
from typing import Any

LONGEST = 60
"""So many characters of a value are shown."""
SHORT = 8
"""So many values of a tuple or list are shown."""
PLAIN = (str, int, float, bool, bytes, type(None))


def brief(it: Any, *more: str) -> str:
    """A dataclass as `Class(field=value, ...)`: arrays by their shape, and what is inside by its class or number.

    `more` names properties, which come after the first field.
    """
    first, *rest = (f.name for f in fields(it))
    return f"{type(it).__name__}({', '.join(f'{name}={_value(getattr(it, name))}' for name in (first, *more, *rest))})"


def _value(value: Any) -> str:
    shape, kind = getattr(value, "shape", None), type(value).__name__
    if isinstance(shape, tuple) and shape:
        return f"{kind.removeprefix('nd')} of {shape}"
    if shape == () or isinstance(value, PLAIN):
        return _text(value.item() if shape == () and hasattr(value, "item") else value)
    if isinstance(value, Path):
        return _text(str(value))
    if isinstance(value, tuple | list) and len(value) <= SHORT and all(isinstance(v, PLAIN) for v in value):
        return _text(value)
    return f"{kind} of {len(value)}" if hasattr(value, "__len__") else kind


def _text(value: Any) -> str:
    shown = Repr()
    shown.maxstring = shown.maxother = LONGEST
    shown.maxtuple = shown.maxlist = SHORT
    return shown.repr(float(f"{value:.6g}") if isinstance(value, float) else value)
