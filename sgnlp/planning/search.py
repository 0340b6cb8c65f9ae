"""The starts of a problem, solved in processes as they are asked for, and what was found put in order."""

from collections.abc import Collection, Generator, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

from sgnlp.base.arrays import Array
from sgnlp.perception.observation import Observation
from sgnlp.planning.agreement import agree
from sgnlp.planning.confidence import with_confidence
from sgnlp.planning.faraway import moved_problem, moved_solution
from sgnlp.planning.pool import Failure, solve_all
from sgnlp.planning.problem import Problem
from sgnlp.planning.reach import OUT_OF_REACH, reachable
from sgnlp.planning.solution import Solution, rank
from sgnlp.planning.solvers.solver import Solver
from sgnlp.planning.starts import Start

Result = Solution | Failure
Found = tuple[Problem, tuple[Solution, ...], tuple[Failure, ...]]


@dataclass(frozen=True, eq=False)
class Search:
    """A problem and the cloud that it was posed for, both moved by -`middle` (3,) [m] to where they are planned."""

    problem: Problem
    cloud: Observation
    middle: Array
    solver: Solver
    count: int
    seed: int
    jobs: int
    timeout: float  # [s] of a start

    @cached_property
    def _reachable(self) -> tuple[list[Start], list[int]]:
        return reachable(self.problem, self.count, self.seed)

    @property
    def order(self) -> list[int]:
        """The indices of the starts that can be solved."""
        return [start.index for start in self._reachable[0]]

    def agree(self) -> None:
        """Raise `InputError` if a term or constraint of the user's own means other things in CasADi and NumPy."""
        for start in self._reachable[0][:1]:
            agree(self.problem, start)

    def results(self, known: Collection[int] = (), until: float = inf) -> Generator[Result]:
        """The result of every start, but for those of which it is known, as they end; see `pool.map_starts`."""
        starts = [start for start in self._reachable[0] if start.index not in known]
        ended = solve_all(self.problem, starts, self.jobs, self.timeout, self.solver, until)
        try:
            for result in ended:
                yield replace(result, hand=self.problem.hand) if isinstance(result, Solution) else result
        finally:
            ended.close()

    def found(self, results: Iterable[Result], known: Iterable[Result] = ()) -> Found:
        """The problem where it stands, the solutions there, best first, and the starts that gave none.

        `known` results stand there already.
        """
        starts, missed = self._reachable
        settings, free_space = self.problem.settings, self.problem.gpis.free_space
        solved = [result for result in results if isinstance(result, Solution)]
        solutions = with_confidence(solved, self.cloud, settings, free_space)
        problem = self.problem
        if self.middle.any():
            problem = moved_problem(problem, self.middle)
            solutions = [moved_solution(solution, self.middle) for solution in solutions]
        solutions = rank([*solutions, *(s for s in known if isinstance(s, Solution))], settings.rank_by)
        failed = [result for result in (*results, *known) if isinstance(result, Failure)]
        failed += [Failure(index, OUT_OF_REACH) for index in missed[: self.count - len(starts)]]
        return problem, tuple(solutions), tuple(sorted(failed, key=lambda failure: failure.start))
