"""How good probabilities are: what came true of those that are alike, and scores of p (N,) against `held` (N,)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata

from sgnlp.base.arrays import Array, BoolArray


@dataclass(frozen=True)
class Bin:
    """Some probabilities that are alike: their number, range and mean, and how many came true."""

    number: int
    low: float
    high: float
    mean: float
    held: int


def bins(p: Array, held: BoolArray, count: int) -> Iterator[Bin]:
    """The probabilities in `count` bins of as many each, the lowest first; fewer bins of fewer probabilities."""
    for chosen in np.array_split(np.argsort(p, kind="stable"), min(count, len(p))):
        told = p[chosen]
        yield Bin(len(chosen), float(told.min()), float(told.max()), float(told.mean()), int(held[chosen].sum()))


def brier(p: Array, held: BoolArray) -> float:
    """Mean of (p - held)² (Brier 1950): 0 is perfect, a constant 1/2 has 0.25."""
    return float(((p - held) ** 2).mean())


def log_loss(p: Array, held: BoolArray) -> float:
    """Mean of -log of the probability of what came true; p is within (0, 1)."""
    return float(-np.log(np.where(held, p, 1 - p)).mean())


def area(p: Array, held: BoolArray) -> float:
    """Area under the ROC: how likely one that held is told a higher p than one that did not; a tie counts half.

    NaN where all held, or none did.
    """
    good, bad = int(held.sum()), int((~held).sum())
    if not good or not bad:
        return float("nan")
    return float((rankdata(p)[held].sum() - good * (good + 1) / 2) / (good * bad))
