"""Result folders: grasps, summary, courses of the starts, rows; written whole or not at all, and read again."""

import csv
import io
import json
import math
import os
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from importlib import import_module
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from sgnlp.errors import InputError
from sgnlp.grasps import Grasps

GRASPS = "grasps.npz"
SUMMARY = "summary.json"
COURSES = "courses.npz"


def writable(folder: Path) -> None:
    """Raise `InputError` unless results can be written to a folder, which need not exist. Leaves nothing behind."""
    try:
        existing = next(path for path in (folder, *folder.parents) if path.exists())
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        raise InputError(f"the output folder '{folder}' cannot be written: {error.strerror}") from None


def save(grasps: Grasps, summary: dict[str, Any], folder: Path, courses: dict[str, Any] | None = None) -> None:
    """Write the files of a result; each appears complete or not at all. Courses of an older one do not stay behind.

    Raises:
        InputError: the folder cannot be written.
    """
    arrays = {f.name: getattr(grasps, f.name) for f in fields(Grasps) if f.name != "meta"}
    arrays["meta"] = np.array(json.dumps(grasps.meta, sort_keys=True))
    write_arrays(folder / GRASPS, arrays)
    write_text(folder / SUMMARY, json_text(summary))
    if courses:
        write_arrays(folder / COURSES, courses)
    else:
        (folder / COURSES).unlink(missing_ok=True)


def load_grasps(path: str | Path) -> Grasps:
    """Read the grasps of a result folder, or of its `grasps.npz`.

    Raises:
        InputError: there is no such file, or it is not one that `save` wrote.
    """
    file = Path(path)
    file = file / GRASPS if file.is_dir() else file
    if not file.is_file():
        raise InputError(f"no result at '{path}': it should be a folder with {GRASPS}")
    if not zipfile.is_zipfile(file):
        raise InputError(f"'{file}' is not a result of sgnlp: it is not an npz, or a truncated one")
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as data:
            arrays = {f.name: data[f.name] for f in fields(Grasps)}
        return Grasps(**arrays | {"meta": json.loads(str(arrays["meta"]))})
    except KeyError as error:
        raise InputError(f"'{file}' is not a result of sgnlp: {error.args[0]}") from None
    except Exception as error:  # a damaged array can raise almost anything
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"'{file}' cannot be read: {reason}") from None


def json_text(value: Any) -> str:
    """Indented JSON. It has no NaN and no infinities: they become null."""
    return json.dumps(_finite(value), indent=2, allow_nan=False) + "\n"


def write_arrays(file: Path, arrays: dict[str, Any]) -> None:
    """Write an npz whole or not at all; the same arrays give the same bytes."""
    archive = io.BytesIO()  # never closed by an interrupt while the archive is open, unlike a file
    np.savez_compressed(archive, **arrays)
    write_bytes(file, archive.getvalue())


def write_text(file: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    write_bytes(file, text.encode())


def write_rows(file: Path, rows: Sequence[Any]) -> None:
    """Write dataclass rows as CSV, whole or not at all."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [f.name for f in fields(rows[0])], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in rows)
    write_text(file, text.getvalue())


def write_parquet(file: Path, rows: Sequence[Any]) -> None:
    """Write the same rows as Parquet, each field a column of its type, whole or not at all.

    Raises:
        InputError: pyarrow is not installed, or the folder cannot be written.
    """
    pa, parquet = arrow()
    types = {"str": pa.string(), "int": pa.int64(), "float": pa.float64(), "bool": pa.bool_()}
    schema = pa.schema([(name, types[kind.__name__]) for name, kind in get_type_hints(type(rows[0])).items()])
    content = pa.BufferOutputStream()
    parquet.write_table(pa.Table.from_pylist([asdict(row) for row in rows], schema), content)
    write_bytes(file, content.getvalue().to_pybytes())


def arrow() -> tuple[Any, Any]:
    """The modules pyarrow and pyarrow.parquet; raises `InputError` where they are not installed."""
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        raise InputError("Parquet needs the package pyarrow: pip install 'sgnlp[parquet]'") from None


def read_rows(file: Path, row: type[Any]) -> list[Any]:
    """Read rows that `write_rows` wrote, [] if there is no file. Fields are str, int, float or bool."""
    if not file.is_file():
        return []
    read: dict[str, Callable[[str], Any]]
    read = {"str": str, "int": int, "float": float, "bool": lambda text: text == "True"}
    kinds = {name: read[kind.__name__] for name, kind in get_type_hints(row).items()}
    try:
        with open(file, encoding="utf-8", newline="") as handle:
            return [row(**{name: kinds[name](text) for name, text in line.items()}) for line in csv.DictReader(handle)]
    except (KeyError, ValueError, TypeError, csv.Error) as error:
        raise InputError(f"'{file}' does not hold rows of this study: {error}; delete it to begin anew") from None


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def resumed(file: Path, made: dict[str, Any]) -> dict[str, Any]:
    """`made`, with the commits of the rows that a folder holds already where its `made.json` tells of others.

    Raises `InputError` if it tells of another study, whose rows must not be mixed with these.
    """
    if not file.is_file():
        return made
    try:
        before = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        before = {}
    known = before.get("inputs", {})
    changed = [name for name, digest in made["inputs"].items() if known.get(name, digest) != digest]
    if changed or before.get("study") != json.loads(json_text(made["study"])):
        raise InputError(f"'{file.parent}' holds rows of other settings or clouds; choose another --out or delete it")
    commits = [*before.get("earlier_commits", []), before.get("commit")]
    earlier = [commit for commit in dict.fromkeys(commits) if commit and commit != made.get("commit")]
    return made | {"earlier_commits": earlier} if earlier else made


def write_bytes(target: Path, content: bytes) -> None:
    """Write a file whole or not at all: a temporary one beside it, in a folder that is made, is moved into place."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.chmod(name, 0o644)
            os.replace(name, target)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(f"'{target}' cannot be written: {error.strerror}") from None
