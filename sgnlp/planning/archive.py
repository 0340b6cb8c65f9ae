"""Arrays in an npz file read again, whatever is wrong with it told in one line."""

import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sgnlp.base.errors import InputError

T = TypeVar("T")


def read_archive(file: Path, kind: str, made: Callable[[Mapping[str, Any]], T]) -> T:
    """What is made of the arrays in an npz, which is called a `kind` of sgnlp. No pickle is loaded.

    Raises:
        InputError: it is no npz, or not one from which it can be made.
    """
    if not zipfile.is_zipfile(file):
        raise InputError(f"'{file}' is not a {kind} of sgnlp: it is not an npz, or a truncated one")
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as data:
            return made(data)
    except KeyError as error:
        raise InputError(f"'{file}' is not a {kind} of sgnlp: {error.args[0]}") from None
    except Exception as error:  # a damaged array can raise almost anything
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"'{file}' cannot be read: {reason}") from None
