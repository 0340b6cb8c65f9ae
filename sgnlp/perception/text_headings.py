"""Finds the columns of x, y and z by the names in a text's heading: its first line, or a comment above its points."""

import csv
import re
from collections.abc import Sequence

from sgnlp.base.errors import InputError

COORDINATES = ("x", "y", "z")
NAME = re.compile(r"(?:(?:points?|pos(?:ition)?|coord(?:inate)?s?|xyz|p)[ :_.\[(]*)?([xyz]|(?<=[ :_.\[(])[0-3])[\])]?")
"""Name of a coordinate in lower case: x, pos_x, `Points:0` and `Points_0` of ParaView, `points_1` of a count from 1."""
UNIT = re.compile(r"(?:\s*[\[(](?:m|mm|cm|metres|meters)[\])]|[ _./](?:m|mm|cm|metres|meters))$")
"""A unit behind a name."""
FRAME = re.compile(
    r"^(?:world|map|base|robot|camera|cam|local|global)[ _./]|[ _./](?:world|map|base|robot|camera|cam)$"
)
"""The frame before or behind a name."""
OTHERS = {
    "nx",
    "ny",
    "nz",
    "r",
    "g",
    "b",
    "red",
    "green",
    "blue",
    "u",
    "v",
    "i",
    "intensity",
    "label",
    "id",
    *COORDINATES,
}
"""Names that show a heading of three columns to be one. Other words are a title: "Scan of cup"."""
REMEDY = "name three columns x, y and z in its heading, or write x y z alone"


def names(line: str) -> list[str]:
    """The names in a heading, in lower case; quoted names, and those between separators, may have blanks."""
    separator = next((mark for mark in ("\t", ";", ",") if mark in line), " ")
    try:
        (fields,) = csv.reader([line.strip()], delimiter=separator, skipinitialspace=True)
    except csv.Error:  # a field of more than 131072 characters is no name
        return []
    return [field.strip(" \t\"'").lower() for field in fields]


def split_names(line: str) -> list[str]:
    """The words of a heading whose names have no blanks, in lower case."""
    return [word.strip("\"'").lower() for word in re.split(r"[,;\s]+", line.strip(" \t,;"))]


def columns(heading: Sequence[str]) -> list[str]:
    """The same names with x, y and z for those that mean them; the rest unchanged."""
    found = [NAME.fullmatch(FRAME.sub("", UNIT.sub("", name))) for name in heading]
    letters = [match[1] if match else "" for match in found]
    if not set(COORDINATES) <= set(letters):
        first = 0 if "0" in letters else 1
        letters = ["" if c in ("", *COORDINATES) else "xyz"[int(c) - first : int(c) - first + 1] for c in letters]
    else:
        letters = [c if c in COORDINATES else "" for c in letters]
    return [letter or name for letter, name in zip(letters, heading, strict=True)]


def read(line: str, width: int) -> list[str]:
    """The names of the columns of a table of `width` columns; empty if the line is a title and no heading.

    Raises `InputError` for a heading that does not say which columns are x, y and z.
    """
    choices = [columns(found) for found in (names(line), split_names(line))]
    fitting = [found for found in choices if len(found) == width]
    known = [found for found in fitting if set(COORDINATES) <= set(found)]
    if known:
        twice = next((letter for letter in COORDINATES if known[0].count(letter) > 1), "")
        if twice:
            raise InputError(f"its heading names two columns {twice}: {', '.join(names(line))}; {REMEDY}")
        return known[0]
    if fitting and (width > len(COORDINATES) or OTHERS & set(fitting[0])):
        raise InputError(f"its heading names no columns x, y and z: {', '.join(fitting[0])}; {REMEDY}")
    if not fitting and any(set(COORDINATES) <= set(found) for found in choices):
        raise InputError(
            f"its heading names {len(choices[1])} columns, but its lines have {width}: {line.strip()}; "
            "separate the names as the numbers are"
        )
    return []
