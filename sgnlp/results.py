"""Result folders: `grasps.npz` and `summary.json`, written whole or not at all, and read again."""

import csv
import io
import json
import os
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from sgnlp.errors import InputError
from sgnlp.grasps import Grasps

GRASPS = "grasps.npz"
SUMMARY = "summary.json"


def writable(folder: Path) -> None:
    """Make a folder for results, raising `InputError` if nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"the output folder '{folder}' cannot be written: {error.strerror}") from None


def save(grasps: Grasps, summary: dict[str, Any], folder: Path) -> None:
    """Write both files of a result; each appears complete or not at all.

    Raises:
        InputError: the folder cannot be written.
    """
    writable(folder)
    arrays = {f.name: getattr(grasps, f.name) for f in fields(Grasps) if f.name != "meta"}
    arrays["meta"] = np.array(json.dumps(grasps.meta, sort_keys=True))
    _replace(folder / GRASPS, lambda file: np.savez_compressed(file, **arrays))
    write_text(folder / SUMMARY, json.dumps(summary, indent=2) + "\n")


def load_grasps(path: str | Path) -> Grasps:
    """Read the grasps of a result folder, or of its `grasps.npz`.

    Raises:
        InputError: there is no such file, or it is not one that `save` wrote.
    """
    file = Path(path)
    file = file / GRASPS if file.is_dir() else file
    if not file.is_file():
        raise InputError(f"no result at '{path}': it should be a folder with {GRASPS}")
    try:
        with np.load(file, allow_pickle=False) as data:
            arrays = {f.name: data[f.name] for f in fields(Grasps)}
    except KeyError as error:
        raise InputError(f"'{file}' is not a result of sgnlp: {error.args[0]}") from None
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"'{file}' cannot be read: {error}") from None
    meta = json.loads(str(arrays.pop("meta")))
    return Grasps(**arrays, meta=meta)


def write_text(file: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    _replace(file, lambda handle: handle.write(text.encode()))


def write_rows(file: Path, rows: Sequence[Any]) -> None:
    """Write dataclass rows as CSV, whole or not at all."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [f.name for f in fields(rows[0])], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in rows)
    write_text(file, text.getvalue())


def read_rows(file: Path, row: type[Any]) -> list[Any]:
    """Read rows that `write_rows` wrote, [] if there is no file. Fields are str, int, float or bool."""
    if not file.is_file():
        return []
    read: dict[str, Callable[[str], Any]]
    read = {"str": str, "int": int, "float": float, "bool": lambda text: text == "True"}
    kinds = {name: read[kind.__name__] for name, kind in get_type_hints(row).items()}
    try:
        with open(file, newline="") as handle:
            return [row(**{name: kinds[name](text) for name, text in line.items()}) for line in csv.DictReader(handle)]
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"'{file}' does not hold rows of this study: {error}; delete it to begin anew") from None


def _replace(target: Path, write: Any) -> None:
    """Write a temporary file beside the target and move it into place."""
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise
