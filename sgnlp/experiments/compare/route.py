"""A solver set up on a problem: the formulations it goes through, with functions that are metered."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.base.settings import Settings
from sgnlp.planning import solvers
from sgnlp.planning.firstorder import learning_rates
from sgnlp.planning.ipopt import Course, Iterate, schedule
from sgnlp.planning.kkt import Kkt
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution, solution
from sgnlp.planning.solvers.anatomy import Answer, Array, Method, Solve, Task
from sgnlp.planning.solvers.meter import Meter
from sgnlp.planning.starts import initial, starts
from sgnlp.planning.warm_start import handed_over
from sgnlp.program.compiled import program
from sgnlp.program.nlp import Nlp
from sgnlp.program.oracle import Oracle, join
from sgnlp.program.structure import Structure

ASKED = 0.1
"""Share of the tolerance that a solver is asked for: each measures in its own scaling, we in that of the problem."""
ITERATIONS = 20_000  # iterations of the last phase at most: the limit that counts is that of time


@dataclass(frozen=True)
class Run:
    """What is run: a solver by name, on a file's problem in a formulation, from a start by index."""

    file: Path
    formulation: str
    solver: str
    start: int
    hand: str
    settings: Settings
    seed: int
    tolerances: tuple[float, ...]
    repeats: int
    limit: float

    def stages(self) -> list[tuple[str, int]]:
        """The formulations that are solved in order, each with its iterations at most."""
        changes: dict[str, Any] = {"formulation": self.formulation, "max_iterations": ITERATIONS}
        return schedule(replace(self.settings.solver, **changes))


_programs: dict[tuple[str, Structure], tuple[Nlp, float]] = {}


def functions_of(problem: Problem, formulation: str) -> tuple[Nlp, float]:
    """The functions of a formulation and the seconds that loading or building them took in this process."""
    structure = problem.structure(formulation)
    key = (problem.hand.digest, structure)
    if key not in _programs:
        begin = time.perf_counter()
        nlp = program(problem.hand, structure, problem.settings.solver.compiled)
        _programs[key] = nlp, time.perf_counter() - begin
    return _programs[key]


class Route:
    """A solver set up on the stages of a formulation, each of which begins where the one before it ended.

    `watch` hears of each point at which ∇f is asked for in the last stage.
    """

    def __init__(self, run: Run, problem: Problem, tolerance: float, watch: Callable[[Array], None]):
        self._run, self._problem, self._start = run, problem, starts(problem, run.start + 1, run.seed)[run.start]
        begin = time.perf_counter()
        watching = [lambda x: None] * (len(run.stages()) - 1) + [watch]
        self.stages = [
            self._stage(solvers.method(run.solver), *stage, tolerance, hear)
            for stage, hear in zip(run.stages(), watching, strict=True)
        ]
        self.setup = time.perf_counter() - begin

    def _stage(
        self, method: Method, formulation: str, iterations: int, tolerance: float, watch: Callable[[Array], None]
    ) -> "Stage":
        problem, start = self._problem, self._start
        nlp, _ = functions_of(problem, formulation)
        oracle = join(nlp, problem.gpis, problem.settings.solver.compiled)
        meter, rates = Meter(oracle, watch), learning_rates(problem.hand)
        task = Task(
            functions=meter.functions,
            p=problem.parameters(nlp, start.wrist, start.joints),
            x_bounds=problem.variable_bounds(nlp, start.joints),
            g_bounds=problem.row_bounds(nlp),
            tolerance=ASKED * tolerance,
            iterations=iterations,
            rates=np.pad(rates, (0, len(nlp.units) - len(rates)), constant_values=np.nan),  # others have none
        )
        return Stage(oracle, meter, task, method.prepare(task))

    @property
    def last(self) -> "Stage":
        """The stage that is judged."""
        return self.stages[-1]

    def first(self) -> Array:
        """The start as a point of the last stage."""
        return self.last.admitted(initial(self.last.oracle.nlp, self._start))

    def solve(self) -> Answer:
        """Run the stages."""
        x, iterations = initial(self.stages[0].oracle.nlp, self._start), 0
        for stage in self.stages:
            stage.meter.clear()
            answer = stage.solve(stage.admitted(x))
            x, iterations = answer.x, iterations + answer.iterations
        return replace(answer, iterations=iterations)

    def calls(self, answer: Answer) -> dict[str, int]:
        """How often the functions were called."""
        counted = sum((stage.meter.calls for stage in self.stages), type(self.last.meter.calls)())
        return dict(counted) if answer.calls is None or len(self.stages) > 1 else answer.calls

    def solution(self, answer: Answer, kkt: Kkt | None = None) -> Solution:
        """The grasp that an answer stands for."""
        oracle, task = self.last.oracle, self.last.task
        iterate = Iterate(
            start=self._start.index,
            formulation=self._run.formulation,
            x=answer.x,
            p=task.p,
            objective=float(oracle.objective(answer.x, task.p)),
            kkt=kkt or Kkt(math.nan, math.nan, math.nan),
            status=answer.status,
            iterations=answer.iterations,
            seconds=math.nan,
            course=Course(*np.empty((len(fields(Course)), 0))),
        )
        return solution(self._problem, self._start, iterate, oracle.nlp.units)


@dataclass(frozen=True, eq=False)
class Stage:
    """One formulation with its metered functions; `oracle` are the same ones unmetered."""

    oracle: Oracle
    meter: Meter
    task: Task
    solve: Solve

    def admitted(self, x: Array) -> Array:
        """A point within the bounds, with the variables that the formulation adds."""
        return np.clip(handed_over(self.oracle, x, self.task.p, self.task.g_bounds), *self.task.x_bounds)

    @property
    def judged(self) -> Task:
        """The task on functions that nobody counts or watches."""
        return replace(self.task, functions=self.oracle)
