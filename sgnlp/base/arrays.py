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


def as_array(value: object, name: str) -> NDArray[np.generic]:
    """`value` as an array of any type; entries that a masked array hides are NaN if they are real numbers.

    Raises `InputError`, which calls it `name`, for a tensor that does not give its numbers away (on a GPU, or with a
    gradient), and `ValueError` for rows of unequal length.
    """
    try:
        array: NDArray[np.generic] = np.asanyarray(value)
    except (TypeError, RuntimeError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"'{name}' cannot be taken for an array; give it as a NumPy array: {reason}") from error
    if not np.ma.is_masked(array):
        return np.asarray(array)
    if array.dtype.kind not in "fiu":
        raise InputError(f"'{name}' has masked entries; give it with these filled in")
    return np.asarray(np.ma.filled(array.astype(np.float64), np.nan))


def _checked(value: object, name: str, shape: tuple[int | None, ...], kinds: str, what: str) -> NDArray[np.generic]:
    wanted = "(" + ", ".join("N" if length is None else str(length) for length in shape) + ")"
    try:
        array = as_array(value, name)
    except ValueError as error:  # rows of unequal length
        raise InputError(f"'{name}' must be an array of {what} of shape {wanted}; its rows differ") from error
    fits = array.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in kinds or not fits:
        found = f"{array.dtype} of shape {array.shape}"
        raise InputError(f"'{name}' must be an array of {what} of shape {wanted}; found {found}")
    return array
