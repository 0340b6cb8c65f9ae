"""Measures of solvers over common instances, on tables {instance: {solver: value}}; a failure is infinite."""

import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

Key = TypeVar("Key")
Values = Mapping[Key, Mapping[str, float]]

SHIFT = 0.1
"""Shift of the geometric mean [s]: below it times are as good as alike; Ipopt takes about as long here."""


def shifted_geometric_mean(times: Sequence[float], shift: float = SHIFT) -> float:
    """exp(mean log(t + s)) - s, infinite if one is; NaN of none."""
    if not times:
        return math.nan
    if math.inf in times:
        return math.inf
    return math.exp(sum(math.log(time + shift) for time in times) / len(times)) - shift


def common(values: Values[Key], solvers: Sequence[str]) -> list[Key]:
    """The instances that all these solvers were run on."""
    return [key for key, row in values.items() if all(solver in row for solver in solvers)]


def ratios(values: Values[Key], solvers: Sequence[str]) -> dict[str, list[float]]:
    """Each solver's time over the best on the instance, for the common instances; infinite where it failed."""
    found: dict[str, list[float]] = {solver: [] for solver in solvers}
    for key in common(values, solvers):
        best = min(values[key][solver] for solver in solvers)
        for solver in solvers:
            value = values[key][solver]
            found[solver].append(value / best if math.isfinite(value) else math.inf)
    return found


def performance_profile(
    values: Values[Key], solvers: Sequence[str], factors: Sequence[float]
) -> dict[str, list[float]]:
    """ρ(τ): the share of the common instances that a solver solves within τ times the best (Dolan & Moré 2002)."""
    return {
        solver: [sum(r <= factor for r in row) / len(row) if row else math.nan for factor in factors]
        for solver, row in ratios(values, solvers).items()
    }


def data_profile(values: Values[Key], solvers: Sequence[str], budgets: Sequence[float]) -> dict[str, list[float]]:
    """d(κ): the share of the common instances that a solver solves within κ units of work (Moré & Wild 2009)."""
    keys = common(values, solvers)
    return {
        solver: [
            sum(values[key][solver] <= budget for key in keys) / len(keys) if keys else math.nan for budget in budgets
        ]
        for solver in solvers
    }


def wins(values: Values[Key], one: str, other: str) -> tuple[int, int, int]:
    """Instances on which one is faster, on which the other is, and how many both were run on."""
    keys = common(values, (one, other))
    first = sum(values[key][one] < values[key][other] for key in keys)
    second = sum(values[key][other] < values[key][one] for key in keys)
    return first, second, len(keys)


def decreased(energy: float, start: float, best: float, share: float) -> bool:
    """Moré & Wild's test of convergence: f(x₀) - f(x) ≥ (1 - τ)(f(x₀) - f_best)."""
    return start - energy >= (1 - share) * (start - best)
