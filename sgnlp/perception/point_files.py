"""Points of .ply, .pcd and text files. What a header promises is compared with what the file holds."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sgnlp.base.errors import InputError
from sgnlp.perception import open3d_files, text_rows
from sgnlp.perception.text_rows import COORDINATES, Text

TEXTS = (".xyz", ".txt", ".csv", ".asc", ".pts")
SUFFIXES = (".ply", ".pcd", *TEXTS)
PCD_TYPES = {"F": "f", "I": "i", "U": "u"}
PLY_TYPES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "double": 8} | {
    "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float32": 4, "float64": 8
}  # fmt: skip
"""Bytes of each type of the PLY format, by either of its names."""
IDENTITY = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
"""VIEWPOINT of a .pcd whose points are not said to be in a camera's frame."""


def read(path: Path) -> Text:
    """The points (N, 3) of a file in `SUFFIXES`, in its unit, with notes. Raises `InputError` if it is damaged."""
    suffix = path.suffix.lower()
    if suffix in TEXTS:
        return text_rows.points(path.read_bytes())
    found = _pcd(path) if suffix == ".pcd" else _ply(path)
    if len(found.points) == 0:
        raise InputError(f"holds no points that can be read as {suffix}")
    return found


@dataclass(frozen=True)
class _PcdHeader:
    names: tuple[str, ...]  # one a column, a field of several counts under each of them
    dtype: np.dtype[np.void]  # of a binary point: x, y and z alone, at their offsets
    count: int
    data: str
    body: bytes
    notes: tuple[str, ...]


def _pcd(path: Path) -> Text:
    """A .pcd, ASCII or binary; the compressed kind goes through Open3D."""
    header = _pcd_header(path.read_bytes())
    if header.data == "ascii":
        lines = [line for line in header.body.splitlines() if line.strip()]
        _agree(path, header.count, len(lines))
        text = text_rows.points(header.body, header.names)
        return Text(text.points, header.notes + text.notes)
    size = header.dtype.itemsize
    if header.data == "binary":
        _agree(path, header.count, len(header.body) // size)
        rows = np.frombuffer(header.body, header.dtype, header.count)
        return Text(np.stack([rows[name].astype(np.float64) for name in COORDINATES], axis=1), header.notes)
    if header.data != "binary_compressed":
        raise _damaged(path, f"its DATA is '{header.data}'")
    packed, unpacked = (int(n) for n in np.frombuffer(header.body[:8].ljust(8, b"\0"), "<u4"))
    _agree(path, header.count, unpacked // size)
    if len(header.body) < 8 + packed:
        raise _damaged(path, f"it ends after {len(header.body)} of {8 + packed} bytes")
    if any(header.dtype[name] != np.dtype("<f4") for name in COORDINATES):
        raise InputError("holds compressed coordinates that are not 32-bit floats; save it as ascii or binary")
    return Text(open3d_files.points(path), header.notes)


def _pcd_header(content: bytes) -> _PcdHeader:
    """The header of a .pcd. Raises `InputError` if it is none, or names no x, y and z."""
    match = re.search(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", content, re.MULTILINE)
    words = [line.split() for line in content[: match.start()].decode("latin-1").splitlines()] if match else []
    said = {line[0].upper(): line[1:] for line in words if line and not line[0].startswith("#")}
    try:
        fields = said.get("FIELDS") or said["COLUMNS"]
        each = [int(count) for count in said.get("COUNT", ["1"] * len(fields))]
        sizes, kinds = [int(size) for size in said["SIZE"]], [PCD_TYPES[kind.upper()] for kind in said["TYPE"]]
        per_field = list(zip(fields, sizes, kinds, each, strict=True))
        grid = int(said["WIDTH"][0]) * int(said["HEIGHT"][0]) if "WIDTH" in said else 0
        count = int(said["POINTS"][0]) if "POINTS" in said else grid
        viewpoint = [float(number) for number in said.get("VIEWPOINT", IDENTITY)]
    except (KeyError, ValueError, IndexError) as error:
        raise InputError(f"is a damaged .pcd file: its header lacks or garbles a line ({error})") from error
    _named(fields)
    offsets = np.cumsum([0, *(size * n for _, size, _, n in per_field)])
    formats = [f"<{kind}{size}" for _, size, kind, _ in per_field]
    at = [fields.index(name) for name in COORDINATES]
    try:
        places = {"offsets": [int(offsets[i]) for i in at], "itemsize": int(offsets[-1])}
        dtype = np.dtype({"names": list(COORDINATES), "formats": [formats[i] for i in at]} | places)  # type: ignore
    except (TypeError, ValueError) as error:
        raise InputError(f"is a damaged .pcd file: no number has {', '.join(formats)}") from error
    columns = tuple(name for name, _, _, n in per_field for _ in range(n))
    assert match is not None
    notes = [] if viewpoint == IDENTITY else ["Left the VIEWPOINT of the file aside: its points are taken as they are."]
    return _PcdHeader(columns, dtype, count, match[1].decode().lower(), content[match.end() :], tuple(notes))


def _ply(path: Path) -> Text:
    """A .ply, through Open3D; its header is read here for what Open3D does not tell."""
    try:
        found = open3d_files.points(path)
    except InputError as error:
        if str(error).startswith(open3d_files.DAMAGED):
            _ply_checked(path)  # may know better why
        raise
    return Text(found, _ply_checked(path))


def _ply_checked(path: Path) -> tuple[str, ...]:
    """What is to be said of a .ply. Raises `InputError` if its header promises another number of points."""
    content = path.read_bytes()
    match = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", content, re.MULTILINE)
    words = [line.split() for line in re.split(r"[\r\n]+", content[: match.start()].decode("latin-1"))] if match else []
    form = next((line[1] for line in words if line[:1] == ["format"] and len(line) > 1), "")
    elements: dict[str, tuple[int, list[list[str]]]] = {}
    for line in words:
        if line[:1] == ["element"] and len(line) == 3 and line[2].isdigit():
            elements[line[1]] = (int(line[2]), [])
        elif line[:1] == ["property"] and elements:
            elements[list(elements)[-1]][1].append(line[1:])
    if match is None or "vertex" not in elements:
        raise _damaged(path, "its header names no vertices")
    count, properties = elements["vertex"]
    _named([line[-1] for line in properties])
    body, others = content[match.end() :], sum(n for name, (n, _) in elements.items() if name != "vertex")
    if form == "ascii":
        lines = [line for line in body.splitlines() if line.strip()]
        if re.search(rb"\d,\d", body):
            raise InputError("has decimal commas in its lines; write decimal points")
        _agree(path, count, len(lines) - others)
    elif not any(line[0] == "list" for _, each in elements.values() for line in each):
        sizes = {name: sum(PLY_TYPES.get(line[0], 0) for line in each) for name, (_, each) in elements.items()}
        rest = sum(n * sizes[name] for name, (n, _) in elements.items() if name != "vertex")
        _agree(path, count, (len(body) - rest) // max(sizes["vertex"], 1))
    faces = elements.get("face", (0, []))[0]
    return (f"Left {faces} faces aside: `sgnlp observe` makes the cloud of a mesh.",) if faces else ()


def _named(fields: list[str]) -> None:
    missing = [name for name in COORDINATES if name not in fields]
    if missing:
        raise InputError(f"names no {', '.join(missing)} among its fields: {' '.join(fields)}")


def _agree(path: Path, promised: int, found: int) -> None:
    if promised != found:
        raise _damaged(path, f"the header says {promised} points, the file holds {max(found, 0)}")


def _damaged(path: Path, reason: str) -> InputError:
    return InputError(f"is a damaged {path.suffix} file: {reason}")
