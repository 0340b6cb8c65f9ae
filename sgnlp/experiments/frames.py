"""Rows as pandas frames, and helpers for tables and figures. Pandas is in the extra `experiments`."""

from collections.abc import Sequence
from math import sqrt
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

from sgnlp.base.errors import InputError
from sgnlp.show.plots import Series

if TYPE_CHECKING:
    from pandas import DataFrame as Frame
else:
    Frame = Any

Lines = list[dict[str, str]]  # the lines of a table, all of the same keys
Tables = dict[str, Lines]  # tables by their titles


def frame(rows: Sequence[Any]) -> Frame:
    """Dataclass rows as a frame, a column for each field.

    Raises `InputError` if pandas is not installed.
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


def wilson(successes: float, trials: int, level: float = 0.95) -> tuple[float, float]:
    """Wilson's score interval of a share (Wilson 1927): all p with |p̂ - p| ≤ z √(p(1 - p)/n). (0, 1) of no trials."""
    if trials == 0:
        return 0.0, 1.0
    z, share = NormalDist().inv_cdf((1 + level) / 2), successes / trials
    centre = share + z * z / (2 * trials)
    spread = z * sqrt(share * (1 - share) / trials + z * z / (4 * trials**2))
    low, high = ((centre + side) / (1 + z * z / trials) for side in (-spread, spread))
    return min(max(low, 0.0), share), max(min(high, 1.0), share)  # rounding leaves a share of 0 or 1 outside


def sign_test(better: int, worse: int) -> float:
    """The p-value of the exact two-sided sign test: the probability that a split at least so uneven is chance."""
    from scipy.stats import binomtest

    return float(binomtest(better, better + worse).pvalue) if better + worse else 1.0


def percent(successes: float, trials: int) -> str:
    """A share in percent with its 95 % interval, `85 (79-90)`; `-` of no trials."""
    if trials == 0:
        return "-"
    low, high = wilson(successes, trials)
    return f"{100 * successes / trials:.0f} ({100 * low:.0f}-{100 * high:.0f})"
