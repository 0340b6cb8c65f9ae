"""Points from arrays as people keep them: lists, images, records with named fields, tables, tensors."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.arrays import Array, as_array, floats
from sgnlp.base.errors import InputError
from sgnlp.perception import text_headings
from sgnlp.perception.text_headings import COORDINATES


def rows(value: object, name: str) -> tuple[Array, tuple[str, ...]]:
    """Points (N, 3) from an array of that shape, an image (H, W, 3), records or a table that name x, y, z; and notes.

    Raises `InputError` for another shape, with an expression that corrects it if one is known.
    """
    array = _array(value, name)
    shape = array.shape
    if len(shape) == 2 and shape[0] == 3 != shape[1] and array.dtype.kind in "fiu":
        raise InputError(f"'{name}' is of shape {shape}: a point a column; save its transpose, {name}.T")
    if len(shape) == 2 and shape[1] > 3 and array.dtype.kind in "fiu":
        raise InputError(f"'{name}' is of shape {shape}; save the three columns of x y z alone, such as {name}[:, :3]")
    if len(shape) == 3 and shape[0] == 3 != shape[-1] and array.dtype.kind in "fiu":
        remedy = f"save {name}.reshape(3, -1).T"
        raise InputError(f"'{name}' is of shape {shape}: three images, of x, y and z; {remedy}")
    if len(shape) > 2 and shape[-1] == 3:
        array = array.reshape(-1, 3)
        return floats(array, name, (None, 3)), (f"Took '{name}' of shape {shape} for {len(array)} points.",)
    return floats(array, name, (None, 3)), ()


def _array(value: object, name: str) -> NDArray[np.generic]:
    """The numbers of a value, x, y and z last and in this order if its fields or columns have these names."""
    if isinstance(value, str) or hasattr(value, "__fspath__"):
        raise InputError(f"'{name}' is a text; sgnlp.load(file) reads a file")
    if (own := getattr(value, "points", None)) is not None and not hasattr(value, "__array__"):
        raise InputError(f"'{name}' is a {type(value).__name__}; give numpy.asarray of its points{_of(own)}")
    try:
        columns = getattr(value, "columns", None)
        if columns is not None and (order := _order([str(column) for column in columns])):
            table: Any = value
            return np.stack([as_array(table[columns[i]], name) for i in order], axis=-1)
        array = as_array(value, name)
    except ValueError:
        raise InputError(f"'{name}' must be an array (N, 3) of real numbers; its rows differ in length") from None
    records: Any = array
    names = array.dtype.names or ()
    if order := _order(names):
        return np.stack([records[names[i]] for i in order], axis=-1)
    whole = [field for field in names if records[field].shape == (*array.shape, 3)]
    if whole:
        raise InputError(f"'{name}' has no fields x, y and z; save the field of the points alone: {name}['{whole[0]}']")
    return array


def _order(names: Sequence[str]) -> list[int]:
    """The places of x, y and z among names, in any case; empty if each is not there once."""
    known = text_headings.columns([name.strip().lower() for name in names])
    return [known.index(axis) for axis in COORDINATES] if all(known.count(axis) == 1 for axis in COORDINATES) else []


def _of(points: object) -> str:
    """The call behind a method that gives the points."""
    return "()" if callable(points) else ""
