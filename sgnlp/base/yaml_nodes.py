"""Nodes of a YAML tree read as mappings, lists and arrays, with one-line errors that name the place."""

import difflib
import reprlib
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
import yaml

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError, unknown

LISTED = 12
"""Largest number of valid names that are listed; of more, only the nearest ones are."""


class Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """YAML's safe loader, changed to refuse duplicate keys instead of taking the last.

    It is LibYAML's, which takes a tenth of the time, if PyYAML was built with it.
    """

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """As YAML's own, which merges `<<` into the node, after a check of the keys that were written there."""
        if not getattr(node, "checked", False):
            node.checked = True  # type: ignore[attr-defined]
            seen = set()
            for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
                if key.value in seen:
                    where = f"line {key.start_mark.line + 1}"
                    raise InputError(f"the key '{key.value}' is there twice ({where}); remove one")
                seen.add(key.value)
        super().flatten_mapping(node)


def unknown_name(kind: str, name: str, valid: Collection[str]) -> InputError:
    """An `InputError` for a name that is not known, with the valid ones, or the nearest of many."""
    if len(valid) <= LISTED:
        return unknown(kind, name, valid)
    near = difflib.get_close_matches(name, valid, LISTED // 2, cutoff=0.0)
    return InputError(f"unknown {kind} '{name}'; nearest of the {len(valid)} valid ones: {', '.join(near)}")


def mapping(node: Any, where: str, keys: Collection[str], optional: Collection[str] = ()) -> dict[str, Any]:
    """The mapping `node`, with exactly these keys, and any of the optional ones."""
    data = any_mapping(node, where)
    for key in data:
        if key not in keys and key not in optional:
            raise unknown_name(f"key in {where}", key, [*keys, *optional])
    for key in keys:
        if key not in data:
            raise InputError(f"{where}: the key '{key}' is missing")
    return data


def any_mapping(node: Any, where: str) -> dict[str, Any]:
    """The mapping `node`, whatever its keys."""
    if not isinstance(node, Mapping):
        raise InputError(f"{where} must be a mapping of names to values")
    return {str(key): value for key, value in node.items()}


def sequence(node: Any, where: str) -> list[Any]:
    """`node` as a list."""
    if not isinstance(node, list):
        raise InputError(f"{where} must be a list")
    return node


def word(node: Any, where: str) -> str:
    """`node` as a name: a text or a number."""
    if isinstance(node, bool) or not isinstance(node, str | int | float) or not str(node).strip():
        raise InputError(f"{where} must be a text, not {_shown(node)}; put quotes around it")
    return str(node)


def numbers(value: Any, shape: tuple[int, ...], where: str) -> Array:
    """`value` as a read-only array of finite numbers; a scalar fills the shape."""
    try:
        if any(isinstance(entry, bool) for entry in np.asarray(value, object).ravel()):
            raise ValueError("YAML's yes, no, on and off")
        return frozen(np.broadcast_to(np.asarray(value, float), shape))
    except (TypeError, ValueError, OverflowError):
        count = "a finite number" if shape == (1,) else f"{shape[0]} finite numbers"
        raise InputError(f"{where} must be {count}, not {_shown(value)}") from None


def vector(value: Any, where: str) -> Array:
    """`value` as three finite numbers."""
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where} must be 3 finite numbers, not {_shown(value)}")
    return numbers(value, (3,), where)


def _shown(node: Any) -> str:
    """A node in a message: short, whatever it holds."""
    return reprlib.repr(node) if not isinstance(node, str) else node


def positive(value: Any, where: str) -> float:
    """`value` as a positive number."""
    number = float(numbers(value, (1,), where)[0])
    if number <= 0:
        raise InputError(f"{where} must be positive, not {number:g}")
    return number


def frozen(values: Iterable[float]) -> Array:
    """A read-only copy; raises `ValueError` unless every number is finite."""
    array = np.array(values, float)
    if not np.isfinite(array).all():
        raise ValueError("not finite")
    array.flags.writeable = False
    return array


def check_order(lower: Array, middle: Array, upper: Array, names: Collection[str], kind: str) -> None:
    """Raise `InputError` for the first name whose middle value is not between the lower and the upper one."""
    for name, low, value, high in zip(names, lower, middle, upper, strict=True):
        if not low <= value <= high:
            raise InputError(f"{kind} {value:g} of '{name}' is outside [{low:g}, {high:g}]")
