"""Reads points from the lines of a text: finds separator, decimal mark and columns, and notes dropped lines."""

import itertools
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.perception import text_headings
from sgnlp.perception.text_headings import COORDINATES

COMMENTS = ("#", "//", "%", "!")
MAX_BROKEN_SHARE = 0.2
"""Largest share of the lines with fewer or more numbers than the others; above it the file is broken."""
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+\.\d*")
BRACKETED = re.compile(r"\s*(?:[\[({]\s*)+[-+.\d]")
"""The beginning of a text whose points are in brackets."""
NO_NUMBER = {"", "-", "--", "---", "*", "na", "n/a", "#n/a", "none", "null", "nil", "inf", "-inf", "nan", "-nan"}
"""Words, in lower case, for "no return"."""
INTEGER = re.compile(r"[+-]?\d+")
SHOWN = 60
"""Most characters of a line that a note shows."""
UNIT = 0.01
"""Rows whose lengths are 1 within this are directions: normals have at least two digits."""


@dataclass(frozen=True)
class Text:
    """Points (N, 3) of a text, with a sentence for each thing assumed or dropped."""

    points: Array
    notes: tuple[str, ...]


def points(content: bytes, columns: Sequence[str] = ()) -> Text:
    """The points in the lines of a text.

    Blanks, tabs, semicolons or commas separate the numbers; the decimal mark is a point or a comma. `columns` are the
    names of the columns if a header has them. Otherwise a heading or a comment may name them, or the first three are
    x y z. Raises `InputError` if the lines can be read in more than one way.
    """
    every = [line for line in map(str.strip, _bare(_decoded(content)).splitlines()) if line]
    lines = [line for line in every if not line.startswith(COMMENTS)]
    split, notes = _splitter(lines)
    fields = [split(line) for line in lines]
    if not columns:
        fields, columns, promised = _headed(lines, fields)
        columns = columns or _commented(every, fields)
        if not columns and len(lines) - (promised is not None) > len(fields):
            notes = [
                *notes,
                f"Left the first line aside, which names no x, y and z: {_shown(lines[promised is not None])}",
            ]
        if promised is not None and promised != len(fields):
            raise InputError(f"its first line promises {promised} points, but {len(fields)} lines follow")
    table, dropped = _table(fields, len(columns))
    where, said = _places(table, columns)
    return Text(table[:, where], tuple(notes + dropped + said))


def _shown(line: str) -> str:
    """A line as a note shows it."""
    return line if len(line) <= SHOWN else f"{line[:SHOWN]} ..."


def _decoded(content: bytes) -> str:
    """The text, from UTF-8 with or without a byte-order mark, or from the UTF-16 of spreadsheets."""
    return content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig", errors="replace")


def _bare(text: str) -> str:
    """The text without brackets, one pair of them a line: points as lists and tuples, as Python and JSON write them."""
    if not BRACKETED.match(text):
        return text
    joined = re.sub(r"\s+", " ", text)
    return re.sub(r"[\[({\])}]", " ", re.sub(r"[\])}]\s*,?", "\n", joined))


def _splitter(lines: Sequence[str]) -> tuple[Callable[[str], list[str]], list[str]]:
    """A function that splits a line into fields, by the separator and decimal mark of the lines; and notes."""
    if not any("," in line or ";" in line for line in lines):
        return str.split, []
    parts = [re.split(r"[;\s]+", line.rstrip(",; \t")) for line in lines]
    stripped = [[part.rstrip(",") for part in line] for line in parts]
    if any(len(line) >= 3 and any(map(THOUSANDS.fullmatch, line)) for line in parts):
        raise InputError("has commas between thousands; write the numbers without them")
    comma = sum(len(line) > 1 and any(map(DECIMAL_COMMA.fullmatch, line)) for line in stripped)
    point = sum("." in line and any(character.isdigit() for character in line) for line in lines)
    if comma and point:
        raise InputError(
            f"mixes decimal commas (in {comma} lines) and decimal points (in {point}); write points in all of them"
        )
    if comma:
        return _decimal_commas, ["Read the commas as decimal marks."]
    if not point and _halves([line.split(",") for line in lines]):
        raise InputError(
            "has commas both as decimal marks and between the numbers; write decimal points, or semicolons"
        )
    name = "semicolons" if any(";" in line for line in lines) else "commas"
    return _separated, [f"Read {name} as separators."]


def _decimal_commas(line: str) -> list[str]:
    return [part.rstrip(",").replace(",", ".") for part in re.split(r"[;\s]+", line.rstrip(",; \t"))]


def _separated(line: str) -> list[str]:
    return [part.strip(" \t\"'") for part in re.split(r"\s*[,;]\s*|\s+", line)]


def _halves(fields: list[list[str]]) -> bool:
    """Whether fields are pairs of a whole number and a fraction with a fixed number of digits: 0,151,-0,102,0,033."""
    body = [line for line in fields if len(line) >= 6 and all(map(INTEGER.fullmatch, line))]
    if not body or len(body) < len(fields) - 1:
        return False
    lengths = {len(line[i]) for line in body for i in (1, 3, 5)}
    return (
        len(lengths) == 1
        and max(lengths) > 1
        and all(len(line[i].lstrip("+-")) < 4 for line in body for i in (0, 2, 4))
    )


def _headed(lines: Sequence[str], fields: list[list[str]]) -> tuple[list[list[str]], Sequence[str], int | None]:
    """The lines below a heading with their columns' names, and the number of points that a first line promises."""
    promised = None
    if len(fields) > 1 and len(fields[0]) == 1 and INTEGER.fullmatch(fields[0][0]) and len(fields[1]) > 1:
        promised, lines, fields = int(fields[0][0]), lines[1:], fields[1:]
    if fields and all(_number(field) is None for field in fields[0]):
        if all(name.lower() in NO_NUMBER for name in fields[0]):
            return fields, (), promised
        return fields[1:], text_headings.read(lines[0], _width(fields[1:])), promised
    if len(fields) > 1 and _numbered(fields[0]) and not all(map(_whole, fields[1])):
        return fields[1:], (), promised
    return fields, (), promised


def _commented(lines: Sequence[str], fields: list[list[str]]) -> Sequence[str]:
    """The columns' names in the comments above the points, as CloudCompare and NumPy write them; empty without any."""
    width = _width(fields)
    for line in itertools.takewhile(lambda line: line.startswith(COMMENTS), lines):
        heading = line.lstrip("".join(COMMENTS))
        for names in (text_headings.names(heading), text_headings.split_names(heading)):
            if len(names) == width and set(COORDINATES) <= set(text_headings.columns(names)):
                return text_headings.read(heading, width)
    return ()


def _width(fields: list[list[str]]) -> int:
    """The number of fields that most lines have."""
    return next(iter(Counter(map(len, fields)).most_common(1)), (0, 0))[0]


def _numbered(line: Sequence[str]) -> bool:
    """Whether a line holds 0, 1, 2 ..., the names that tables get whose columns have none."""
    there = [field for field in line if field]
    return len(there) >= len(COORDINATES) and there == [str(i) for i in range(len(there))]


def _whole(field: str) -> bool:
    return INTEGER.fullmatch(field) is not None


def _number(field: str) -> float | None:
    try:
        return float(field)
    except ValueError:
        return None


def _table(fields: list[list[str]], width: int) -> tuple[Array, list[str]]:
    """The numbers (N, width) of the lines that hold that many, and notes on the others."""
    try:
        table = np.array(fields, dtype=np.float64)
        if table.ndim == 2 and table.shape[1] == (width or table.shape[1]) and table.shape[1] >= 3:
            return table, []
    except ValueError:
        pass
    numbers = [[_number(field) for field in line] for line in fields]
    blank = [
        None in line and all(field.lower() in NO_NUMBER for field in said)
        for line, said in zip(numbers, fields, strict=True)
    ]
    whole = Counter(len(line) for line in numbers if line and None not in line)
    width = width or max(whole, key=lambda size: (whole[size] if size >= 3 else 0, size), default=0)
    if not whole or width < 3:
        most = max(whole, default=0)
        raise InputError(f"holds no line of three numbers{f', but lines of {most}' if most else ''}: one point a line")
    good = [line for line in numbers if len(line) == width and None not in line]
    broken, notes = len(fields) - len(good) - sum(blank), []
    said = f"{broken} of {len(fields)} lines do not hold {width} numbers as the others do"
    if broken > MAX_BROKEN_SHARE * len(fields):
        raise InputError(f"{said}, more than {MAX_BROKEN_SHARE:.0%}; write one point a line")
    if any(blank):
        notes.append(f"Dropped {sum(blank)} of {len(fields)} lines without a number.")
    if broken:
        notes.append(f"Dropped lines: {said}.")
    return np.array(good, dtype=np.float64).reshape(len(good), width), notes


def _places(table: Array, columns: Sequence[str]) -> tuple[list[int], list[str]]:
    """The columns of x, y and z, and notes. Raises `InputError` if they look like something else."""
    if columns:
        return [list(columns).index(name) for name in COORDINATES], []
    first, second, more = table[:, :3], table[:, 1:4], table[:, 3:6]
    remedy = "write x y z first, or a heading line that names the columns"
    if table.shape[1] > 3 and counts(table[:, 0]):
        return [1, 2, 3], ["Took the columns 2 to 4 for x y z: the first column counts."]
    if table.shape[1] > 3 and len(table) > 1 and _whole_alone(table[:, 0], second):
        raise InputError(f"begins its lines with whole numbers, as labels and indices are; {remedy}")
    if more.shape[1] == 3 and len(table) > 1:
        if _colours(first) and not _colours(more):
            raise InputError(f"begins its lines with whole numbers from 0 to 255, as colours are; {remedy}")
        if directions(first) and not directions(more):
            raise InputError(f"begins its lines with directions of length 1, as normals are; {remedy}")
    said = f"Took the first 3 of {table.shape[1]} columns for x y z: no heading names them."
    return [0, 1, 2], [said] if table.shape[1] > 3 else []


def _whole_alone(column: Array, others: Array) -> bool:
    """Whether a column (N,) holds whole numbers, not all the same, and none of the others (N, 3) does."""
    whole = (others == np.round(others)).all(axis=0)
    return bool((column == np.round(column)).all() and np.ptp(column) > 0 and not whole.any())


def counts(column: Array) -> bool:
    """Whether a column (N,) is a running number: whole numbers that always increase, unlike coordinates."""
    return len(column) > 2 and bool((column == np.round(column)).all() and (np.diff(column) > 0).all())


def _colours(rows: Array) -> bool:
    return bool(((rows == np.round(rows)) & (rows >= 0) & (rows <= 255)).all() and (rows > 1).any())


def directions(rows: Array) -> bool:
    """Whether all rows (N, 3) have length 1, like normals and unlike coordinates."""
    return bool((np.abs(np.linalg.norm(rows, axis=1) - 1) < UNIT).all())
