"""Quality of probabilities: observed shares in bins, and scores of p (N,) against outcomes `held` (N,)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata

from sgnlp.base.arrays import Array, BoolArray


@dataclass(frozen=True)
class Bin:
    """Similar probabilities: their number, range and mean, and how many of the events happened."""

    number: int
    low: float
    high: float
    mean: float
    held: int


def bins(p: Array, held: BoolArray, count: int) -> Iterator[Bin]:
    """The probabilities in `count` bins of equal size, the lowest first; with few probabilities there are fewer
    bins."""
    for chosen in np.array_split(np.argsort(p, kind="stable"), min(count, len(p))):
        told = p[chosen]
        yield Bin(len(chosen), float(told.min()), float(told.max()), float(told.mean()), int(held[chosen].sum()))


def brier(p: Array, held: BoolArray) -> float:
    """Mean of (p - held)² (Brier 1950): 0 is perfect, a constant 1/2 has 0.25."""
    return float(((p - held) ** 2).mean())


def log_loss(p: Array, held: BoolArray) -> float:
    """Mean of -log of the probability of the observed outcome; p is within (0, 1)."""
    return float(-np.log(np.where(held, p, 1 - p)).mean())


def area(p: Array, held: BoolArray) -> float:
    """Area under the ROC curve: the probability that a case that held has a higher p than one that did not.

    A tie counts half. NaN if all held, or none did.
    """
    good, bad = int(held.sum()), int((~held).sum())
    if not good or not bad:
        return float("nan")
    return float((rankdata(p)[held].sum() - good * (good + 1) / 2) / (good * bad))
