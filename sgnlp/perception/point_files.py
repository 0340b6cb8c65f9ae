"""Reads points from .ply, .pcd and text files, and compares the header with the content."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.perception import open3d_files, text_rows
from sgnlp.perception.text_rows import COORDINATES, Text

TEXTS = (".xyz", ".txt", ".csv", ".asc", ".pts")
SUFFIXES = (".ply", ".pcd", *TEXTS)
PCD_TYPES = {"F": "f", "I": "i", "U": "u"}
PLY_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"} | {
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4",
    "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
"""NumPy's type for each type of the PLY format, by either of its names."""
PLY_FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
IDENTITY = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
"""VIEWPOINT of a .pcd without a camera frame."""
HEADER = 4096
"""The header of a .pcd ends within this many bytes."""
Columns = list[tuple[str, str]]
"""The name and NumPy's type of each number of a point."""


def read(path: Path) -> Text:
    """The points (N, 3) of a file in `SUFFIXES`, in its unit, with notes. Raises `InputError` if it is damaged."""
    suffix = path.suffix.lower()
    if suffix in TEXTS:
        return text_rows.points(path.read_bytes())
    found = _pcd(path) if suffix == ".pcd" else _ply(path)
    if len(found.points) == 0:
        raise InputError(f"holds no points that can be read as {suffix}")
    return found


def _pcd(path: Path) -> Text:
    """A .pcd; Open3D unpacks the compressed kind."""
    header = _pcd_header(path.read_bytes())
    body, size = header.body, _dtype(header.columns).itemsize
    if header.data == "ascii":
        lines = [line for line in body.splitlines() if line.strip()]
        _agree(path, header.count, len(lines))
        text = text_rows.points(body, [name for name, _ in header.columns])
        return Text(text.points, header.notes + text.notes)
    if header.data == "binary":
        _agree(path, header.count, len(body) // size)
        return Text(_coordinates(body, header.columns, header.count), header.notes)
    if header.data != "binary_compressed":
        raise _damaged(path, f"its DATA is '{header.data}'")
    packed, unpacked = (int(n) for n in np.frombuffer(body[:8].ljust(8, b"\0"), "<u4"))
    _agree(path, header.count, unpacked // size)
    if len(body) < 8 + packed:
        raise _damaged(path, f"it ends after {len(body)} of {8 + packed} bytes")
    if any(kind != "<f4" for name, kind in header.columns if name in COORDINATES):
        raise InputError("holds compressed coordinates that are not 32-bit floats; save it as ascii or binary")
    return Text(open3d_files.points(path), header.notes)


def pcd_grid(path: Path) -> tuple[int, int] | None:
    """Height and width of a .pcd whose points are those of an image; None if it is not organised so."""
    said = dict(re.findall(rb"^(WIDTH|HEIGHT)[ \t]+(\d+)", path.read_bytes()[:HEADER], re.MULTILINE))
    width, height = int(said.get(b"WIDTH", 0)), int(said.get(b"HEIGHT", 0))
    return (height, width) if height > 1 and width > 1 else None


@dataclass(frozen=True)
class _PcdHeader:
    columns: Columns  # a field of several counts has as many, all with its name
    count: int
    data: str
    body: bytes
    notes: tuple[str, ...]


def _pcd_header(content: bytes) -> _PcdHeader:
    """The header of a .pcd. Raises `InputError` if it is none, or names no x, y and z."""
    match = re.search(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", content, re.MULTILINE)
    try:
        if match is None:
            raise ValueError("DATA")
        words = [line.split() for line in content[: match.start()].decode("latin-1").splitlines()]
        said = {line[0].upper(): line[1:] for line in words if line and not line[0].startswith("#")}
        fields = said.get("FIELDS") or said["COLUMNS"]
        types = [f"<{PCD_TYPES[kind.upper()]}{int(n)}" for kind, n in zip(said["TYPE"], said["SIZE"], strict=True)]
        each = [int(count) for count in said.get("COUNT", ["1"] * len(fields))]
        columns = [(_axis(name), kind) for name, kind, n in zip(fields, types, each, strict=True) for _ in range(n)]
        grid = int(said["WIDTH"][0]) * int(said["HEIGHT"][0]) if "WIDTH" in said else 0
        count = int(said["POINTS"][0]) if "POINTS" in said else grid
        viewpoint = [float(number) for number in said.get("VIEWPOINT", IDENTITY)]
        _dtype(columns)
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise InputError(f"is a damaged .pcd file: its header lacks or garbles a line ({error})") from error
    _named([name for name, _ in columns])
    notes = [] if viewpoint == IDENTITY else ["Left the VIEWPOINT of the file aside: its points are taken as they are."]
    return _PcdHeader(columns, count, match[1].decode().lower(), content[match.end() :], tuple(notes))


def _ply(path: Path) -> Text:
    """A .ply, of which the vertices are the points."""
    content = path.read_bytes()
    match = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", content, re.MULTILINE)
    words = [line.split() for line in re.split(r"[\r\n]+", content[: match.start()].decode("latin-1"))] if match else []
    form = next((line[1] for line in words if line[:1] == ["format"] and len(line) > 1), "")
    elements: dict[str, tuple[int, Columns]] = {}
    for line in words:
        if line[:1] == ["element"] and len(line) == 3 and line[2].isdigit():
            elements[line[1]] = (int(line[2]), [])
        elif line[:1] == ["property"] and len(line) > 2 and elements:
            elements[list(elements)[-1]][1].append((_axis(line[-1]), PLY_TYPES.get(line[1], line[1])))
    if match is None or "vertex" not in elements:
        raise _damaged(path, "its header names no vertices")
    if form not in PLY_FORMS:
        raise _damaged(path, f"its format is '{form}'")
    _named([name for name, _ in elements["vertex"][1]])
    faces = elements.get("face", (0, []))[0]
    notes = (f"Left {faces} faces aside: `sgnlp observe` makes the cloud of a mesh.",) if faces else ()
    read_body = _ply_rows if form == "ascii" else _ply_bytes
    found = read_body(path, content[match.end() :], elements, PLY_FORMS[form])
    return Text(found.points, (*notes, *found.notes))


def _ply_rows(path: Path, body: bytes, elements: dict[str, tuple[int, Columns]], order: str) -> Text:
    """The vertices of a .ply that is a text."""
    (count, columns), before = elements["vertex"], list(elements).index("vertex")
    counts = [n for n, _ in elements.values()]
    lines = [line for line in body.splitlines() if line.strip()]
    _agree(path, count, len(lines) - sum(counts) + count)
    own = lines[sum(counts[:before]) :][:count]
    return text_rows.points(b"\n".join(own), [name for name, _ in columns])


def _ply_bytes(path: Path, body: bytes, elements: dict[str, tuple[int, Columns]], order: str) -> Text:
    """The vertices of a binary .ply."""
    sizes: list[int | None] = []  # in bytes, None where the length of lists decides it
    for count, columns in elements.values():
        try:
            sizes.append(count * _dtype([(name, order + kind) for name, kind in columns]).itemsize)
        except TypeError:
            sizes.append(None)
    (count, columns), i = elements["vertex"], list(elements).index("vertex")
    unread = next((kind for _, kind in columns if kind not in (*PLY_TYPES.values(), "list")), "")
    if unread:
        raise InputError(f"has numbers of the type '{unread}', which a .ply has not; save them as float or double")
    if None in sizes[: i + 1]:
        raise InputError("has lists before or among its points; save it as text, or without them")
    body, own = body[sum(sizes[:i]) :], [(name, order + kind) for name, kind in columns]  # type: ignore[arg-type]
    after = [size or 0 for size in sizes[i + 1 :]]
    held = (len(body) - sum(after)) // max(_dtype(own).itemsize, 1)
    _agree(path, count, min(held, count) if None in sizes else held)
    return Text(_coordinates(body, own, count), ())


def _dtype(columns: Columns) -> np.dtype[np.void]:
    """The type of a binary point; its columns are named by their numbers, because names may repeat."""
    return np.dtype([(str(i), kind) for i, (_, kind) in enumerate(columns)])


def _coordinates(body: bytes, columns: Columns, count: int) -> Array:
    """Points (N, 3) of a binary file."""
    rows, names = np.frombuffer(body, _dtype(columns), count), [name for name, _ in columns]
    with np.errstate(invalid="ignore"):  # bytes in the wrong order may be any number
        return np.stack([rows[str(names.index(axis))].astype(np.float64) for axis in COORDINATES], axis=1)


def _axis(name: str) -> str:
    """The name of a field, small if it is X, Y or Z."""
    return name.lower() if name.lower() in COORDINATES else name


def _named(fields: list[str]) -> None:
    missing = [name for name in COORDINATES if name not in fields]
    if missing:
        raise InputError(f"names no {', '.join(missing)} among its fields: {' '.join(fields)}")


def _agree(path: Path, promised: int, found: int) -> None:
    if promised != found:
        raise _damaged(path, f"the header says {promised} points, the file holds {max(found, 0)}")


def _damaged(path: Path, reason: str) -> InputError:
    return InputError(f"is a damaged {path.suffix} file: {reason}")
