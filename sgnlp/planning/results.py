"""Result folders: grasps, summary, histories of the starts, rows; written whole or not at all, and read again.

The files of a folder are first written under temporary names and then renamed together, so a full disk changes nothing.
The summary is renamed last. Summary and history name their plan, by `Grasps.digest`, so that one of another plan is
noticed.
"""

import csv
import errno
import io
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, fields
from importlib import import_module
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from sgnlp.base.checked import typed
from sgnlp.base.errors import InputError, MachineError, gives_out
from sgnlp.planning.archive import read_archive
from sgnlp.planning.grasps import Grasps

GRASPS = "grasps.npz"
SUMMARY = "summary.json"
HISTORY = "history.npz"
MOTION = ("trajectory.npz", "trajectory.json", "trajectory.yaml", "grasp.yaml", "pregrasp.yaml")
"""The files with the motion of the best grasp, if one is feasible."""
AFTER = ("simulation.json", "simulation-*.png", "report.html", "report.md", "report/*.svg", "report/*.png")
"""The files that are made of a result afterwards: a new result takes them away."""


def writable(folder: Path) -> None:
    """Raise unless results can be written to a folder, which need not exist. It leaves no files behind.

    Raises `InputError` if it is not a folder, or cannot be written; `MachineError` if the disk is full.
    """
    try:
        existing = next(path for path in (folder, *folder.parents) if path.exists() or path.is_symlink())
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        raise _unwritten(f"the output folder '{folder}'", error) from None


def save(
    grasps: Grasps,
    summary: dict[str, Any],
    folder: Path,
    histories: dict[str, Any] | None = None,
    motion: Mapping[str, bytes] | None = None,
) -> None:
    """Write the files of a result, all or none, and delete those of an older one. Raises as `write_files`."""
    arrays = {f.name: getattr(grasps, f.name) for f in fields(Grasps) if f.name != "meta"}
    arrays["meta"] = np.array(json.dumps(grasps.meta, sort_keys=True))
    ways = npz(histories | {"plan": np.array(grasps.digest)}) if histories else None
    after = [str(file.relative_to(folder)) for pattern in AFTER for file in sorted(folder.glob(pattern))]
    others = {HISTORY: ways, **dict.fromkeys((*MOTION, *after)), **(motion or {})}
    write_files(folder, {GRASPS: npz(arrays), **others, SUMMARY: encoded(json_text(summary))})


def load_summary(folder: Path, grasps: Grasps) -> dict[str, Any]:
    """The summary of the grasps in a folder.

    Raises:
        InputError: the summary is missing, damaged, or belongs to other grasps.
    """
    file = folder / SUMMARY
    if not file.is_file():
        raise InputError(f"'{file}' is missing; solve it again")
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        rows, best, notes = (found[name] for name in ("starts_table", "best", "notes"))
        whole = isinstance(rows, list) and isinstance(notes, list) and isinstance(best, dict | None)
        if not whole or len(rows) < len(grasps) or not all(isinstance(row, dict) for row in rows):
            raise ValueError
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(f"'{file}' is not the summary of a result; solve it again") from None
    check_plan(file, found.get("plan"), grasps)
    return dict(found)


def check_plan(file: Path, plan: object, grasps: Grasps) -> None:
    """Raise `InputError` if a file beside grasps is of another `plan`, by its digest."""
    if plan != grasps.digest:
        raise InputError(
            f"'{file}' belongs to another plan than the {GRASPS} beside it, or an earlier version wrote it; delete it, "
            "or make it again"
        )


@typed
def load_grasps(path: str | Path) -> Grasps:
    """Read the grasps of a result folder, or of its `grasps.npz`.

    Raises:
        InputError: the file does not exist, or was not written by `save`.
    """
    file = Path(path)
    file = file / GRASPS if file.is_dir() else file
    if not file.is_file():
        raise InputError(f"no result at '{path}': it should be a folder with {GRASPS}")
    return read_archive(file, "a result of sgnlp", _grasps)


def _grasps(data: Mapping[str, Any]) -> Grasps:
    arrays = {f.name: data[f.name] for f in fields(Grasps)}
    return Grasps(**arrays | {"meta": dict(json.loads(str(arrays["meta"])))})


def json_text(value: Any) -> str:
    """Indented JSON. It has no NaN and no infinities: they become null."""
    return json.dumps(finite(value), indent=2, allow_nan=False) + "\n"


def write_arrays(file: Path, arrays: dict[str, Any]) -> None:
    """Write an npz whole or not at all; the same arrays give the same bytes."""
    write_bytes(file, npz(arrays))


def write_text(file: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    write_bytes(file, encoded(text))


def write_rows(file: Path, rows: Sequence[Any]) -> None:
    """Write dataclass rows as CSV, whole or not at all."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [f.name for f in fields(rows[0])], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in rows)
    write_text(file, text.getvalue())


def write_parquet(file: Path, rows: Sequence[Any]) -> None:
    """Write the same rows as Parquet, each field a column of its type; raises as `arrow` and `write_bytes`."""
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
    read = {
        "str": str,
        "int": int,
        "float": float,
        "bool": lambda text: text == "True",
    }
    kinds = {name: read[kind.__name__] for name, kind in get_type_hints(row).items()}
    try:
        with open(file, encoding="utf-8", errors="surrogateescape", newline="") as handle:
            reader = csv.DictReader(handle)
            if strange := set(reader.fieldnames or ()) - set(kinds):
                raise ValueError(f"unknown column {min(strange)!r}")
            return [row(**{name: kinds[name](text) for name, text in line.items()}) for line in reader]
    except (KeyError, ValueError, TypeError, csv.Error) as error:
        raise InputError(f"'{file}' does not hold rows of this study: {error}; delete it to begin anew") from None


def finite(value: Any) -> Any:
    """Plain values with None in the place of NaN and infinities."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_bytes(target: Path, content: bytes) -> None:
    """Write a file whole or not at all; see `write_files`."""
    write_files(target.parent, {target.name: content})


def write_files(folder: Path, contents: Mapping[str, bytes | None]) -> None:
    """Write files into a folder and its subfolders, all or none; a file without content is deleted.

    Raises:
        InputError: the folder or one of them cannot be written.
        MachineError: the disk is full.
    """
    name = next(iter(contents))
    try:
        with ExitStack() as stack:
            for place in dict.fromkeys((folder / name).parent for name in contents):
                stack.enter_context(_made(place))
            stage = stack.enter_context(_staged(folder))
            for name, content in contents.items():
                if (folder / name).is_dir():
                    raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
                stage(name, content)
    except OSError as error:
        raise _unwritten(f"'{folder / name}'", error) from None


@contextmanager
def _staged(folder: Path) -> Iterator[Callable[[str, bytes | None], None]]:
    """Temporary files that are renamed to their final names at the end, in order; an error leaves none."""
    staged: dict[str, Path | None] = {}

    def stage(name: str, content: bytes | None) -> None:
        staged[name] = None
        if content is None:
            return
        handle, temporary = tempfile.mkstemp(dir=(folder / name).parent, prefix=".writing-")
        staged[name] = Path(temporary)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o644)

    try:
        yield stage
        for name, source in staged.items():
            if source is None:
                (folder / name).unlink(missing_ok=True)
            else:
                os.replace(source, folder / name)
    finally:
        for source in filter(None, staged.values()):
            source.unlink(missing_ok=True)


@contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make a folder and its parents, and remove them again after an error."""
    new = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for path in new:
            with suppress(OSError):
                path.rmdir()
        raise


def _unwritten(what: str, error: OSError) -> InputError | MachineError:
    kind = MachineError if gives_out(error) else InputError
    return kind(f"{what} cannot be written: {error.strerror}")


def npz(arrays: dict[str, Any]) -> bytes:
    """The bytes of a compressed npz; the same arrays give the same."""
    archive = io.BytesIO()  # unlike a file, an interrupt cannot close it while the archive is open
    np.savez_compressed(archive, **arrays)
    return archive.getvalue()


def encoded(text: str) -> bytes:
    """UTF-8, with bytes of file names that are not UTF-8 restored."""
    return text.encode("utf-8", "surrogateescape")
