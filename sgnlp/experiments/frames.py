"""Rows as pandas frames, and the lines and curves that come of them. Pandas is the extra `experiments`."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sgnlp.base.errors import InputError
from sgnlp.show.plots import Series

if TYPE_CHECKING:
    from pandas import DataFrame as Frame
else:
    Frame = Any

Lines = list[dict[str, str]]
"""The lines of a table, all of the same keys."""
Tables = dict[str, Lines]
"""Tables by their titles."""


def frame(rows: Sequence[Any]) -> Frame:
    """Dataclass rows as a frame, a column for each field.

    Raises:
        InputError: pandas is not installed.
    """
    try:
        from pandas import DataFrame
    except ImportError:
        raise InputError("studies and comparisons need pandas: pip install 'sgnlp[experiments]'") from None
    return DataFrame([vars(row) for row in rows])


def pick(rows: Frame, **values: Any) -> Frame:
    """The rows that have these values."""
    for name, value in values.items():
        rows = rows[rows[name] == value]
    return rows


def lines(table: Frame) -> Lines:
    """The lines of a frame of texts and counts."""
    return [{str(name): str(cell) for name, cell in line.items()} for line in table.to_dict("records")]


def curves(table: Frame, **look: Any) -> tuple[Series, ...]:
    """A series for each column, over the index."""
    return tuple(Series(str(name), list(table.index), list(column), **look) for name, column in table.items())
