"""Starts solved in worker processes, each under a wall-clock limit that really stops it.

Processes and not threads: MUMPS is not thread-safe, and only a process can be killed inside an iteration.
"""

import gc
import multiprocessing
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass
from functools import lru_cache
from math import inf
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from pebble import CONSTS, ProcessExpired, ProcessPool
from threadpoolctl import threadpool_limits

from sgnlp.base import semaphores
from sgnlp.base.errors import SgnlpError, SolverError
from sgnlp.base.futures import Ended
from sgnlp.base.processes import follow_parent, uninterrupted, with_children
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution, solution
from sgnlp.planning.solvers.solver import Solver
from sgnlp.planning.starts import Start
from sgnlp.program.compiled import program

T = TypeVar("T")

CONSTS.sleep_unit = 0.01
"""Polling interval of a pool [s]. With pebble's default of 0.1 s, ending a pool would take as long as a start."""

STOPPED = "stopped after"
"""How the reason of a start begins that took longer than its time."""
TOO_LATE = "not done by the deadline"
"""Reason for a start without a solution if it was running or waiting when the plan's deadline passed."""
Given = tuple[Problem, Solver | str | None]

_given: Given | None = None


@dataclass(frozen=True)
class Failure:
    """A start without a solution, and the reason."""

    start: int
    reason: str

    @property
    def stopped(self) -> bool:
        """Whether it took longer than the time of a start."""
        return self.reason.startswith(STOPPED)


def solve_start(planner: Planner, start: Start) -> Solution:
    """The solution of one start."""
    iterate = planner.solve(start)
    return solution(planner.problem, start, iterate, planner.stages[-1].nlp)


def solve_all(
    problem: Problem,
    starts: Sequence[Start],
    jobs: int,
    timeout: float | None,
    solver: Solver | str | None = None,
    until: float = inf,
) -> Generator[Solution | Failure, None, None]:
    """Solve every start in `jobs` processes, yielding solutions as they come; see `map_starts`.

    Also in a daemon, such as a worker of `multiprocessing.Pool`.
    """
    with with_children():
        yield from map_starts(solve_start, problem, starts, jobs, timeout, solver, until)


def map_starts(
    task: Callable[[Planner, Start], T],
    problem: Problem,
    starts: Sequence[Start],
    jobs: int,
    timeout: float | None,
    solver: Solver | str | None = None,
    until: float = inf,
) -> Generator[T | Failure, None, None]:
    """Apply a task to every start in `jobs` processes, yielding results as they come.

    A start is a `Failure` if it takes longer than `timeout` [s], if its process dies, or if it has not ended when
    `time.perf_counter()` reaches `until` [s]. Leaving the iteration early, also by an exception, ends every process.
    Without semaphores one start is solved at a time.
    """
    for phase in problem.phases:  # before the fork, so that workers inherit it
        program(problem.hand, problem.structure(phase.formulation), problem.settings.solver.compiled)
    if semaphores.fault():
        yield from (_apart(task, (problem, solver), start, timeout, until) for start in starts)
        return
    pool = ProcessPool(
        max_workers=min(jobs, len(starts)),
        initializer=_initialise,
        initargs=(problem, solver),
        context=multiprocessing.get_context("fork"),
    )
    try:
        ended, waiting = Ended(), dict[Any, Start]()
        with uninterrupted():
            for start in starts:
                future = pool.schedule(_run, args=(task, start), timeout=timeout)
                waiting[future] = start
                ended.watch(future)
        while waiting and (done := ended.wait(_left(until))):
            yield from (_result(future, waiting.pop(future), timeout) for future in done)
        yield from (Failure(start.index, TOO_LATE) for start in waiting.values())
    finally:
        pool.stop()
        pool.join()


def _left(until: float) -> float | None:
    """The time until then [s], 0 if it has passed; None for no end."""
    return None if until == inf else max(until - time.perf_counter(), 0.0)


def _result(future: Any, start: Start, timeout: float | None) -> Any:
    try:
        return future.result()
    except FutureTimeout:
        return _stopped(start, timeout)
    except ProcessExpired as error:
        return _expired(start, error.exitcode)
    except Exception as error:  # any error in a worker is a failure of that start, not of the plan
        return _failed(start, error)


def _stopped(start: Start, timeout: float | None) -> Failure:
    return Failure(start.index, f"{STOPPED} {timeout:g} s")


def _expired(start: Start, code: int | None) -> Failure:
    return Failure(start.index, f"process ended with exit code {code}")


def _failed(start: Start, error: Exception) -> Failure:
    line = (str(error).strip().splitlines() or [""])[-1]  # CasADi's messages end with the cause
    return Failure(start.index, line if isinstance(error, SgnlpError) else f"{type(error).__name__}: {line}")


def _apart(
    task: Callable[[Planner, Start], T], given: Given, start: Start, timeout: float | None, until: float
) -> T | Failure:
    """The result of one start in a process forked for it, which sends it through a pipe."""
    left = min(inf if limit is None else limit for limit in (timeout, _left(until)))
    if not left > 0:
        return Failure(start.index, TOO_LATE)
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(theirs, task, given, start), daemon=True)
    process.start()
    theirs.close()
    try:
        if ours.poll(None if left == inf else left):
            return ours.recv()
        return _stopped(start, timeout) if left == timeout else Failure(start.index, TOO_LATE)
    except EOFError:
        process.join()
        return _expired(start, process.exitcode)
    finally:
        process.kill()
        process.join()
        ours.close()


def _send(pipe: Connection, task: Callable[[Planner, Start], T], given: Given, start: Start) -> None:
    _initialise(*given)
    try:
        pipe.send(_run(task, start))
    except Exception as error:
        pipe.send(_failed(start, error))


def _initialise(problem: Problem, solver: Solver | str | None) -> None:
    """Prepare a worker: the parent handles interrupts, and each process uses one thread."""
    global _given
    follow_parent()
    threadpool_limits(1)
    gc.freeze()  # what the parent made is neither garbage nor worth a search
    _given = problem, solver
    _planner.cache_clear()


@lru_cache(maxsize=1)
def _planner() -> Planner:
    """The planner of this worker, made with the first task, so that an error belongs to the task."""
    assert _given is not None
    return Planner(*_given)


def _run(task: Callable[[Planner, Start], T], start: Start) -> T:
    try:
        return task(_planner(), start)
    except SystemExit as error:  # it would end the parent
        raise SolverError(f"a solver, term or constraint called sys.exit({error.code})") from None
