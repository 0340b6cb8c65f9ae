"""Reads arrays from an npz file; whatever is wrong with the file, the error is one line."""

import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sgnlp.base.errors import InputError

T = TypeVar("T")


def read_archive(file: Path, kind: str, made: Callable[[Mapping[str, Any]], T]) -> T:
    """The object that `made` builds from the arrays of an npz that is a `kind`, as messages say. No pickle is loaded.

    Raises:
        InputError: the file is no npz, or `made` cannot build the object from it.
    """
    if not zipfile.is_zipfile(file):
        fault = "it is not an npz, or a truncated one" if file.exists() else "there is no such file"
        raise InputError(f"'{file}' is not {kind}: {fault}")
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as data:
            return made(data)
    except KeyError as error:
        raise InputError(f"'{file}' is not {kind}: {error.args[0]}") from None
    except Exception as error:  # a damaged array can raise almost anything
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        reason = "it holds objects, not numbers" if "allow_pickle" in reason else reason
        raise InputError(f"'{file}' cannot be read: {reason}") from None
