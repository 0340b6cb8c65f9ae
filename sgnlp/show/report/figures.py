"""Figures of a report, as panels: how the starts converged, and where fingers are likely to meet the surface."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.arrays import Array
from sgnlp.planning.approach import Approach
from sgnlp.show.plots import Panel, Series

FLOOR = 1e-10
"""Smaller violations are drawn at this value: they are rounding."""
FIRST_POINTS = 3
"""First points of each course that the energy axis may cut off: a start can be far above everything that follows."""


def convergence(courses: Mapping[str, NDArray[Any]]) -> list[Panel]:
    """Energy and violation over iterations: two panels for each formulation, a line for each start."""
    panels = []
    for formulation in dict.fromkeys(courses["formulation"].tolist()):
        chosen = courses["formulation"] == formulation
        ways = [chosen & (courses["start"] == start) for start in np.unique(courses["start"])]
        energies = [courses["energy"][way] for way in ways]
        shown = np.concatenate([e[min(FIRST_POINTS, len(e) - 1) :] for e in energies if len(e)])
        room = 0.05 * max(float(np.ptp(shown)), 1.0)
        span = (float(shown.min()) - room, float(shown.max()) + room)
        violations = [np.maximum(courses["primal"][way], FLOOR) for way in ways]
        labels = [f"start {start}" for start in np.unique(courses["start"])]
        panels.append(
            Panel(f"{formulation}: energy", "iteration", "smoothed energy", _lines(labels, energies), y_range=span)
        )
        panels.append(
            Panel(f"{formulation}: violation", "iteration", "largest violation", _lines(labels, violations), log=True)
        )
    return panels


def _lines(labels: Sequence[str], values: Sequence[Array]) -> tuple[Series, ...]:
    return tuple(Series(name, list(range(len(y))), y.tolist()) for name, y in zip(labels, values, strict=True))


def approach(paths: Sequence[Approach], unit: str) -> list[Panel]:
    """For each finger, the contact density along its path, and below it the surface's mean and deviation there.

    `unit` says what the density is: a share, or one in 1/m. The axes of all fingers are the same.
    """
    top = 1.1 * max(max(path.density.max(), path.contact_density) for path in paths)
    low = min((path.gap - path.deviation).min() for path in paths)
    high = max((path.gap + path.deviation).max() for path in paths)
    above = [_density(path, unit, (0.0, float(top))) for path in paths]
    return [*above, *(_surface(path, (1e3 * float(low), 1e3 * float(high))) for path in paths)]


def _density(path: Approach, unit: str, span: tuple[float, float]) -> Panel:
    series = (
        Series("along the path", _mm(path.way), path.density.tolist(), look="line"),
        Series("planned contact", [1e3 * path.contact_way], [path.contact_density], look="points"),
        Series("samples of E_uncer", _mm(path.sample_way), path.sample_density.tolist(), look="points"),
    )
    marks = (1e3 * path.contact_way,)
    return Panel(path.finger, "from the tip [mm]", f"density{unit}", series, marks=marks, y_range=span)


def _surface(path: Approach, span: tuple[float, float]) -> Panel:
    gap, deviation = 1e3 * path.gap, 1e3 * path.deviation
    low, high = (gap - deviation).tolist(), (gap + deviation).tolist()
    series = (Series("along the path", _mm(path.way), gap.tolist(), low, high, look="line"),)
    marks = (1e3 * path.contact_way,)
    return Panel("", "from the tip [mm]", "pad to surface, ± σ [mm]", series, marks=marks, y_range=span)


def _mm(way: Array) -> list[float]:
    return (1e3 * way).tolist()
