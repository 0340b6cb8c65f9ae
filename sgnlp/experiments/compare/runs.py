"""One solver on one problem from one start, in a process of its own: every tolerance, cold and warm."""

import math
import os
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.settings import Settings
from sgnlp.experiments.compare.route import Route, Run, build_seconds
from sgnlp.experiments.compare.row import Row
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import load
from sgnlp.planning.multipliers import smallest_residuals
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.solution import Solution
from sgnlp.planning.solvers.process import Send, apart, spend
from sgnlp.planning.solvers.solver import Answer
from sgnlp.program.nlp import ENERGY_UNIT

GRACE = 1.5  # factor on the time limit after which the kernel ends a process that did not stop by itself
TRACED = 0
"""The start whose iterates are traced; residuals of all traces would take longer than the solvers."""
TRACE_POINTS = 16  # number of points of a trace, evenly spaced in the logarithm of time


def rows_of(run: Run) -> list[Row]:
    """The rows of a run; a tolerance that was not reached or not tried has a row with the reason."""
    name, problem = _posed(run.file, run.hand, run.settings, run.seed)
    built = build_seconds(run.posed(problem, run.tolerances[0]))
    sent, reason = apart(partial(_work, run, problem), GRACE * run.limit)
    rows = [replace(row, build=built) for row in sent]
    return [replace(row, object=name) for row in (*rows, *_missing(run, rows, reason))]


def chosen(run: Run) -> Solution | str:
    """The solution of a run at its first tolerance, or the reason why there is none."""
    _, problem = _posed(run.file, run.hand, run.settings, run.seed)

    def work(send: Send) -> None:
        spend(GRACE * run.limit)
        route = Route(run, problem, run.tolerances[0], lambda x: None)
        send(route.solution(route.solve()))

    sent, reason = apart(work, GRACE * run.limit)
    return sent[0] if sent else reason


@lru_cache(maxsize=1)
def _posed(file: Path, hand: str, settings: Settings, seed: int) -> tuple[str, Problem]:
    observation = load(file)
    return observation.name, build_problem(observation, load_hand(hand, settings.spheres), settings, seed)


def _work(run: Run, problem: Problem, send: Send) -> None:
    for tolerance in sorted(run.tolerances, reverse=True):
        clock = _Clock(run.limit)
        spend(GRACE * run.limit)
        route = Route(run, problem, tolerance, clock.watch)
        for repeat in range(run.repeats):
            row = Row("", run.formulation, run.solver, run.start, tolerance, repeat)
            clock.late = partial(_late, run, route, clock, row, send)
            spend(GRACE * run.limit)
            clock.begin()
            answer = route.solve()
            seconds, cpu = clock.read()
            spend(GRACE * run.limit)
            row = _judged(route, answer, clock, replace(row, seconds=seconds, cpu=cpu))
            send(row)
            if not row.reached:
                return


class _Clock:
    """Wall and processor time of a solve; `late` is called at the first ∇f after the limit."""

    def __init__(self, limit: float):
        self._limit, self.late = limit, lambda x: None
        self.wall = self.cpu = math.inf

    def begin(self) -> None:
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        return time.perf_counter() - self.wall, time.process_time() - self.cpu

    def watch(self, x: Array) -> None:
        if time.process_time() > self.cpu + self._limit:
            self.late(x)


def _late(run: Run, route: Route, clock: _Clock, row: Row, send: Send, x: Array) -> None:
    """End the process at the limit with the last point as the answer, which does not count as reached."""
    seconds, cpu = clock.read()
    spend(GRACE * run.limit)
    row = replace(row, seconds=seconds, cpu=cpu, failure=f"over {run.limit:g} s of processor time")
    answer = Answer(x.copy(), "stopped", len(route.points))
    send(replace(_judged(route, answer, clock, row), reached=False))
    os._exit(0)


def _judged(route: Route, answer: Answer, clock: _Clock, row: Row) -> Row:
    """The row of an answer, whatever its status says."""
    judged = route.judged
    calls: dict[str, Any] = dict(route.calls(answer))
    kkt, estimated = smallest_residuals(judged, answer.x, answer.multipliers)
    finite = bool(np.isfinite(answer.x).all())
    found = route.solution(answer, kkt) if finite else None
    energy = ENERGY_UNIT * judged.objective(answer.x)
    measured = (energy, kkt.dual, kkt.primal, kkt.complementarity)
    return replace(
        row,
        reached=bool(np.isfinite(measured).all() and kkt.worst <= row.tolerance),
        energy=energy,
        energy_start=ENERGY_UNIT * judged.objective(route.first),
        lowest=ENERGY_UNIT * answer.lowest,
        dual=kkt.dual,
        primal=kkt.primal,
        complementarity=kkt.complementarity,
        estimated=estimated,
        feasible=found is not None and found.feasible,
        margin=found.worst_margin if found else math.nan,
        iterations=answer.iterations,
        **calls,
        setup=route.setup,
        status=answer.status,
        trace=_trace(route, clock.cpu) if (row.start, row.repeat) == (TRACED, 0) else "",
    )


def _trace(route: Route, begin: float) -> str:
    """Seconds, energies and residuals at points on the way, with estimated multipliers."""
    points = [(moment - begin, x) for moment, x in route.points if moment > begin]
    if not points:
        return ""
    times, told = np.array([moment for moment, _ in points]), []
    wanted = np.searchsorted(times, np.geomspace(times[0], times[-1], TRACE_POINTS)).clip(max=len(points) - 1)
    for moment, x in (points[i] for i in sorted(set(wanted.tolist()))):
        residual = smallest_residuals(route.judged, x, None)[0].worst
        told.append(f"{moment:.4g}:{ENERGY_UNIT * route.judged.objective(x):.6g}:{residual:.3g}")
    return " ".join(told)


def _missing(run: Run, rows: Sequence[Row], reason: str) -> list[Row]:
    """A row for each tolerance without one, from loose to tight, with what went wrong before it."""
    found: list[Row] = []
    tried = {row.tolerance for row in rows}
    for tolerance in sorted(set(run.tolerances) - tried, reverse=True):
        failure = "not tried: a looser tolerance was not reached" if tried or found else reason
        row = Row("", run.formulation, run.solver, run.start, tolerance, 0, failure=failure)
        found.append(replace(row, failure=reason) if reason and not found else row)
    return found
