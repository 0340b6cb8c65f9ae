"""Figures of a comparison: profiles, and the course of energy and residual over time."""

import math
from collections.abc import Sequence

import numpy as np

from sgnlp.experiments.compare.row import course
from sgnlp.experiments.compare.table import Table
from sgnlp.experiments.frames import Frame, curves
from sgnlp.show.plots import STYLES, Panel, Series

MOST = len(STYLES)  # largest number of lines in a panel: as many as can be distinguished
FACTORS = np.geomspace(1.0, 64.0, 60).tolist()  # factors of the best time
BUDGETS = np.geomspace(0.3, 300.0, 60).tolist()  # calls over n + 1
MOMENTS = np.geomspace(0.003, 10.0, 40).tolist()  # times at which the courses are sampled [s]
FLOOR = 1e-9  # residuals and gaps below are drawn here


def shown(table: Table) -> list[str]:
    """The solvers drawn, the same in every panel: the best of each formulation in turn."""
    orders = [table.order(formulation) for formulation in table.formulations]
    turns = [name for place in zip(*(order + [""] * MOST for order in orders), strict=False) for name in place if name]
    return list(dict.fromkeys(turns))[:MOST]


def profiles(table: Table) -> list[Panel]:
    """Dolan & Moré's profiles of processor time, for each formulation and tolerance."""
    solvers = shown(table)
    return [
        _shares(f"{name} to {tolerance:g}", "factor of the fastest", performance_profile(_run(times, solvers), FACTORS))
        for name in table.formulations
        for tolerance in table.tolerances
        for times in [table.times(name, tolerance)]
    ]


def data_profiles(table: Table, size: int) -> list[Panel]:
    """Moré & Wild's profiles of calls, for each formulation of `size` variables."""
    works, solvers = {name: table.works(name, size) for name in table.formulations}, shown(table)
    return [
        _shares(name, "calls over n + 1", data_profile(_run(work, solvers), BUDGETS)) for name, work in works.items()
    ]


def _run(values: Frame, solvers: Sequence[str]) -> Frame:
    """The columns of the solvers that were run."""
    return values[[solver for solver in solvers if solver in values]]


def _shares(title: str, x: str, values: Frame) -> Panel:
    return Panel(title, x, "share of runs", curves(values), log_x=True, y_range=(0.0, 1.02))


def courses(table: Table) -> list[Panel]:
    """Median over the traced runs of the energy above the best known and of the best residual so far, over time."""
    found = []
    for name in table.formulations if table.rows.trace.any() else ():
        ends = {solver: table.answers(name, solver) for solver in shown(table)}
        for i, what in enumerate(("energy above the best", "KKT residual"), 1):
            series = tuple(Series(solver, MOMENTS, _course(rows, i)) for solver, rows in ends.items() if len(rows))
            found.append(Panel(name, "processor time [s]", what, series, log=True, log_x=True))
    return found


def _course(ends: Frame, column: int) -> list[float]:
    """The median of the running minimum at each moment; before its first point a run counts as infinite."""
    curves = []
    for end in ends[ends.way != ""].itertuples():
        points = course(end.way)
        values = np.maximum(np.array(points[column]) - (end.best if column == 1 else 0.0), FLOOR)
        lowest = np.fmin.accumulate(np.r_[math.inf, values])  # not of NaN, where no best is known
        curves.append(lowest[np.searchsorted(points[0], MOMENTS, side="right")])
    middle = np.median(curves, axis=0) if curves else np.full(len(MOMENTS), math.nan)
    return np.where(np.isfinite(middle), middle, math.nan).tolist()


def performance_profile(values: Frame, factors: Sequence[float]) -> Frame:
    """ρ(τ): the share of the common instances that each solver solves within τ times the best (Dolan & Moré 2002)."""
    common = values.dropna()
    ratios = common.div(common.min(axis=1).replace(math.inf, math.nan), axis=0).fillna(math.inf)
    return _within(ratios, factors)


def data_profile(values: Frame, budgets: Sequence[float]) -> Frame:
    """d(κ): the share of the common instances that each solver solves within κ units of work (Moré & Wild 2009)."""
    return _within(values.dropna(), budgets)


def _within(values: Frame, limits: Sequence[float]) -> Frame:
    """The share of the lines within each limit, a line a limit."""
    return type(values)([(values <= limit).mean() for limit in limits], limits)
