"""A machine without semaphores: one start at a time, each still under its limit and in a process of its own."""

import multiprocessing
import os
from types import SimpleNamespace

import pytest
from processes import hang

from sgnlp.base import semaphores
from sgnlp.planning import pool
from sgnlp.planning.pool import Failure


def answer(planner: object, start: SimpleNamespace) -> object:
    """What each start is there for."""
    if start.index == 1:
        raise ValueError("and more\nno [good]")
    if start.index == 2:
        os._exit(7)
    if start.index == 3:
        hang(planner, start)
    return start.index, os.getpid()


def test_starts_are_solved_one_at_a_time_and_fail_alone(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(semaphores, "fault", lambda: "none here")
    monkeypatch.setattr(pool, "Planner", lambda *given: None)
    problem = SimpleNamespace(phases=())
    starts = [SimpleNamespace(index=i) for i in range(5)]
    found = list(pool.map_starts(answer, problem, [starts[i] for i in (0, 1, 2, 4)], 4, None))
    assert found[1:3] == [Failure(1, "ValueError: no [good]"), Failure(2, "process ended with exit code 7")]
    assert [found[0][0], found[3][0]] == [0, 4]
    assert len({os.getpid(), found[0][1], found[3][1]}) == 3
    assert list(pool.map_starts(answer, problem, [starts[3]], 4, 0.1)) == [Failure(3, "stopped after 0.1 s")]


def solved_by_a_daemon(_: object) -> list:
    assert multiprocessing.current_process().daemon
    found = list(pool.solve_all(SimpleNamespace(phases=()), [SimpleNamespace(index=i) for i in (0, 1)], 2, 5.0))
    assert multiprocessing.current_process().daemon
    return sorted(found, key=str)


@pytest.mark.parametrize("fault", ["", "none here"])
def test_a_daemon_of_a_pool_solves_starts_in_processes_of_their_own_too(monkeypatch, fault):
    monkeypatch.setattr(semaphores, "fault", lambda: fault)
    monkeypatch.setattr(pool, "Planner", lambda *given: None)
    monkeypatch.setattr(pool, "solve_start", answer)
    with multiprocessing.get_context("fork").Pool(1) as daemons:
        good, bad = daemons.map(solved_by_a_daemon, [None])[0]
    assert good[0] == 0
    assert bad == Failure(1, "ValueError: no [good]")


@pytest.mark.parametrize("error", [OSError(30, "Read-only file system"), ImportError("no sem_open")])
def test_why_there_are_none_is_told_with_what_to_do(monkeypatch, error):
    def fails(*_):
        raise error

    semaphores.fault.cache_clear()
    monkeypatch.setattr(multiprocessing.get_context("fork"), "Lock", fails)
    try:
        told = semaphores.fault()
    finally:
        semaphores.fault.cache_clear()
    assert (error.strerror if isinstance(error, OSError) else str(error)) in told
    assert "several processes need a writable /dev/shm" in told
