"""Statistics of counts, and of the same cases under two conditions."""

from math import sqrt
from statistics import NormalDist


def wilson(successes: float, trials: int, level: float = 0.95) -> tuple[float, float]:
    """Wilson's score interval of a share (Wilson 1927): all p with |p̂ - p| ≤ z √(p(1 - p)/n). (0, 1) of no trials."""
    if trials == 0:
        return 0.0, 1.0
    z, share = NormalDist().inv_cdf((1 + level) / 2), successes / trials
    centre = share + z * z / (2 * trials)
    spread = z * sqrt(share * (1 - share) / trials + z * z / (4 * trials**2))
    return max((centre - spread) / (1 + z * z / trials), 0.0), min((centre + spread) / (1 + z * z / trials), 1.0)


def sign_test(better: int, worse: int) -> float:
    """The p-value of the exact two-sided sign test: how likely so uneven a split of the pairs is by chance."""
    from scipy.stats import binomtest

    return float(binomtest(better, better + worse).pvalue) if better + worse else 1.0


def percent(successes: float, trials: int) -> str:
    """A share in percent with its 95 % interval, `85 (79-90)`; `-` of no trials."""
    if trials == 0:
        return "-"
    low, high = wilson(successes, trials)
    return f"{100 * successes / trials:.0f} ({100 * low:.0f}-{100 * high:.0f})"
