"""Types of arrays: numbers, indices, masks and words; and values as arrays of a kind and a shape."""

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.errors import InputError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
StrArray = NDArray[np.str_]


def floats(value: object, name: str, shape: tuple[int | None, ...]) -> Array:
    """`value` as a float64 array of `shape` (None: any length), or an `InputError` that calls it `name`."""
    with np.errstate(over="ignore", invalid="ignore"):  # values of wider types that do not fit become infinite
        return _checked(value, name, shape, "fiu", "real numbers").astype(np.float64)


def integers(value: object, name: str, shape: tuple[int | None, ...]) -> IntArray:
    """`value` as an int64 array of `shape` (None: any length), or an `InputError` that calls it `name`."""
    return _checked(value, name, shape, "iu", "integers").astype(np.int64)


def _checked(value: object, name: str, shape: tuple[int | None, ...], kinds: str, what: str) -> NDArray[np.generic]:
    wanted = "(" + ", ".join("N" if length is None else str(length) for length in shape) + ")"
    try:
        array: NDArray[np.generic] = np.asarray(value)
    except ValueError as error:  # rows of unequal length
        raise InputError(f"'{name}' must be an array of {what} of shape {wanted}; its rows differ") from error
    fits = array.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in kinds or not fits:
        found = f"{array.dtype} of shape {array.shape}"
        raise InputError(f"'{name}' must be an array of {what} of shape {wanted}; found {found}")
    return array
