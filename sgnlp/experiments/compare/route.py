"""A solver set up on a problem: the programs of a formulation, with metered functions."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sgnlp.base.arrays import Array
from sgnlp.base.settings import Settings
from sgnlp.experiments.compare.meter import Meter
from sgnlp.planning.kkt import Kkt
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution, solution
from sgnlp.planning.solvers.solver import Answer
from sgnlp.planning.starts import starts
from sgnlp.program.compiled import program
from sgnlp.program.formulations import formulation
from sgnlp.program.oracle import Functions, Oracle
from sgnlp.program.structure import Structure

ASKED = 0.1
"""The solver's tolerance over ours: each solver measures in its own scaling, we in that of the problem."""
ITERATIONS = 20_000  # largest number of iterations of the last program; the limit of time is reached first


@dataclass(frozen=True)
class Run:
    """A run: a solver by name, on a file's problem in a formulation, from a start by index."""

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

    def posed(self, problem: Problem, tolerance: float) -> Problem:
        """The problem of the file in the formulation, with the solver's tolerance and limits."""
        solver = replace(problem.settings.solver, max_iterations=ITERATIONS, tolerance=ASKED * tolerance)
        settings = replace(problem.settings, solver=solver)
        return replace(problem, settings=settings, formulation=formulation(self.formulation))


_seconds: dict[tuple[str, Structure], float] = {}


def build_seconds(problem: Problem) -> float:
    """The seconds that loading or building the functions of a problem took in this process, which keeps them."""
    structures = [problem.structure(phase.formulation) for phase in problem.phases]
    for structure in structures:
        key = (problem.hand.digest, structure)
        if key not in _seconds:
            begin = time.perf_counter()
            program(problem.hand, structure, problem.settings.solver.compiled)
            _seconds[key] = time.perf_counter() - begin
    return sum(_seconds[problem.hand.digest, structure] for structure in structures)


class Route:
    """A solver set up on the programs of a formulation, each of which begins where the one before it ended.

    `watch` is called with each point at which ∇f is evaluated in the last program.
    """

    def __init__(self, run: Run, problem: Problem, tolerance: float, watch: Callable[[Array], None]):
        self.start, self._meters = starts(problem, run.start + 1, run.seed)[run.start], list[Meter]()
        begin = time.perf_counter()
        self.planner = Planner(run.posed(problem, tolerance), run.solver, self._metered)
        self.planner.prepare(self.start)
        self._meters[-1].watch = watch
        self.setup = time.perf_counter() - begin
        self.last = self.planner.stages[-1]
        instance, self.first = self.planner.begin(self.last, self.start)
        # with functions that are neither counted nor watched
        self.judged = replace(instance, functions=self.last.oracle)

    def _metered(self, oracle: Oracle) -> Functions:
        self._meters.append(Meter(oracle))
        return self._meters[-1].functions

    @property
    def points(self) -> Sequence[tuple[float, Array]]:
        """The points at which ∇f was asked for in the last program, with the processor time."""
        return self._meters[-1].points

    def solve(self) -> Answer:
        """Run the programs: the last answer, with the iterations of all."""
        for meter in self._meters:
            meter.clear()
        answers = self.planner.run(self.start)
        return replace(answers[-1], iterations=sum(answer.iterations for answer in answers))

    def calls(self, answer: Answer) -> dict[str, int]:
        """How often the functions were called."""
        counted = sum((meter.calls for meter in self._meters), type(self._meters[-1].calls)())
        return dict(counted) if answer.calls is None or len(self._meters) > 1 else answer.calls

    def solution(self, answer: Answer, kkt: Kkt | None = None) -> Solution:
        """The grasp that an answer stands for."""
        problem, iterate = self.planner.problem, self.planner.ended(self.start, [answer], kkt)
        return solution(problem, self.start, iterate, self.last.nlp)
