"""Figures of a comparison: profiles, and the course of energy and residual over time."""

import math
from collections.abc import Callable, Sequence
from statistics import median

import numpy as np

from sgnlp.experiments.compare.measures import data_profile, performance_profile
from sgnlp.experiments.compare.table import Table
from sgnlp.show.plots import STYLES, Panel, Series

MOST = len(STYLES)
"""Lines in a panel at most: as many as can be told apart."""
FACTORS = np.geomspace(1.0, 64.0, 60).tolist()
"""Factors of the best time."""
BUDGETS = np.geomspace(0.3, 300.0, 60).tolist()
"""Calls over n + 1."""
MOMENTS = np.geomspace(0.003, 10.0, 40).tolist()
"""Times at which the courses are looked at [s]."""
FLOOR = 1e-9
"""Residuals and gaps below are drawn here."""
TITLES = "{} to {:g}"


def shown(table: Table) -> list[str]:
    """The solvers drawn, the same in every panel: the best of each formulation in turn."""
    orders = [table.order(formulation) for formulation in table.formulations]
    turns = [name for place in zip(*(order + [""] * MOST for order in orders), strict=False) for name in place if name]
    return list(dict.fromkeys(turns))[:MOST]


def profiles(table: Table) -> list[Panel]:
    """Dolan & Moré's profiles of processor time, for each formulation and tolerance."""
    solvers = shown(table)
    return [
        _panel(
            TITLES.format(formulation, tolerance),
            "factor of the fastest",
            "share of runs",
            FACTORS,
            performance_profile(table.times(formulation, tolerance), _run(table, formulation, solvers), FACTORS),
        )
        for formulation in table.formulations
        for tolerance in table.tolerances
    ]


def data_profiles(table: Table, size: int) -> list[Panel]:
    """Moré & Wild's profiles of calls, for each formulation of `size` variables."""
    solvers = shown(table)
    return [
        _panel(
            formulation,
            "calls over n + 1",
            "share of runs",
            BUDGETS,
            data_profile(table.works(formulation, size), _run(table, formulation, solvers), BUDGETS),
        )
        for formulation in table.formulations
    ]


def courses(table: Table) -> list[Panel]:
    """Median over the traced runs of the energy above the best known and of the best residual so far, over time."""
    found = []
    for formulation in table.formulations:
        solvers = _run(table, formulation, shown(table))
        for what, of in (("energy above the best", _gap), ("KKT residual", _residual)):
            curves = {solver: _course(table, formulation, solver, of) for solver in solvers}
            panel = _panel(formulation, "processor time [s]", what, MOMENTS, curves)
            found.append(panel)
    return found if any(row.trace for row in table.rows) else []


def _run(table: Table, formulation: str, solvers: Sequence[str]) -> list[str]:
    return [solver for solver in solvers if table.of(formulation, solver, table.tolerances[0])]


def _panel(title: str, x: str, y: str, places: Sequence[float], curves: dict[str, list[float]]) -> Panel:
    series = tuple(Series(solver, list(places), curve) for solver, curve in curves.items())
    share = y.startswith("share")
    return Panel(title, x, y, series, log=not share, log_x=True, y_range=(0.0, 1.02) if share else None)


def _gap(energy: float, residual: float, best: float) -> float:
    return max(energy - best, FLOOR)


def _residual(energy: float, residual: float, best: float) -> float:
    return max(residual, FLOOR)


def _course(table: Table, formulation: str, solver: str, of: Callable[[float, float, float], float]) -> list[float]:
    """The median of the running minimum at each moment; before its first point a run is at its start: infinite."""
    curves = []
    for (instance, name), end in table.ends.items():
        cold = table.runs[instance, name, end.tolerance][0]  # the one whose way is kept
        if (instance[1], name) == (formulation, solver) and cold.trace:
            lowest, way = math.inf, []
            for seconds, energy, residual in cold.course:
                lowest = min(lowest, of(energy, residual, table.best.get(instance, math.nan)))
                way.append((seconds, lowest))
            curves.append([min((v for t, v in way if t <= moment), default=math.inf) for moment in MOMENTS])
    values = [median(column) for column in zip(*curves, strict=True)]
    return [value if math.isfinite(value) else math.nan for value in values] or [math.nan] * len(MOMENTS)
