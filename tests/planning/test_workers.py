"""Worker processes that die: nothing is lost but the item that is to blame."""

import math
import os
import signal
import time
from concurrent.futures import BrokenExecutor, Future
from types import SimpleNamespace

import pytest
from here import Here

from sgnlp.base.errors import InputError, MachineError
from sgnlp.planning.workers import Workers, each


def killer(item: int) -> int:
    """The square, but item 3 kills its process."""
    if item == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return item**2


def test_an_item_that_kills_its_worker_fails_alone_and_nothing_is_lost():
    workers = Workers(2)
    try:
        found = dict(each(killer, range(6), workers))
    finally:
        workers.close()
    assert found == {i: i**2 for i in range(6)} | {3: "its worker process died twice"}


def test_without_semaphores_everything_is_done_in_this_process(monkeypatch):
    monkeypatch.setattr("sgnlp.base.semaphores.fault", lambda: "none here")
    workers = Workers(4)
    assert workers.window == 1
    assert dict(each(lambda item: (item, os.getpid()), range(3), workers)) == {i: (i, os.getpid()) for i in range(3)}
    assert dict(each(math.sqrt, [-1.0], workers)) == {-1.0: "ValueError: math domain error"}
    workers.close()


class Forgetful(Here):
    """A cluster whose scheduler goes once, with all that it had after the first two items, and comes back if it can."""

    def __init__(self, returns: bool = True):
        super().__init__()
        self.window, self.returns, self.log, self.regained = math.inf, returns, list[int](), 0

    def submit(self, function, item):
        self.log.append(item)
        if self.regained or len(self.log) <= 2:
            return super().submit(function, item)
        future: Future = Future()
        future.cancel()
        future.set_running_or_notify_cancel()
        return future

    def regain(self) -> None:
        if not self.returns:
            raise MachineError("gone")
        self.regained += 1


def test_what_a_scheduler_had_when_it_went_is_submitted_to_the_next_and_what_is_done_is_not():
    workers = Forgetful()
    found = list(each(abs, range(6), workers))
    assert sorted(found) == [(i, i) for i in range(6)]
    assert workers.regained == 1
    assert sorted(workers.log) == [0, 1, *sorted(2 * [2, 3, 4, 5])]


def test_what_is_done_is_kept_when_a_scheduler_does_not_come_back():
    ended = each(abs, range(6), Forgetful(returns=False))
    assert sorted([next(ended), next(ended)]) == [(0, 0), (1, 1)]
    with pytest.raises(MachineError, match="gone"):
        next(ended)


def test_a_scheduler_that_has_gone_is_waited_for_and_then_told(monkeypatch):
    answers = iter([SimpleNamespace(close=lambda: None), None, None, None])

    def client(scheduler: str) -> object:
        found = next(answers)
        if found is None:
            raise InputError("no dask scheduler answers")
        return found

    monkeypatch.setattr("sgnlp.planning.workers._client", client)
    now = iter(range(0, 10**6, 200))
    monkeypatch.setattr(
        "sgnlp.planning.workers.time", SimpleNamespace(monotonic=lambda: next(now), sleep=lambda s: None)
    )
    with pytest.raises(MachineError, match="the dask scheduler at 'tcp://there' has gone; start it again and repeat"):
        Workers(1, "tcp://there").regain()
    assert len(list(answers)) == 1  # two were asked: at 200 s, and at 400 s of 300


class Mortal(Here):
    """Dies of an item as often as told; nothing can be submitted before it is closed then."""

    def __init__(self, deaths: dict[int, int]):
        super().__init__()
        self.window, self.deaths, self.dead, self.log = 3, deaths, False, list[int]()

    def submit(self, function, item):
        if self.dead:
            raise BrokenExecutor
        self.log.append(item)
        future = super().submit(function, item)
        if self.deaths.get(item, 0):
            self.deaths[item] -= 1
            self.dead = True
            future = Future()
            future.set_exception(BrokenExecutor())
        return future

    def close(self) -> None:
        self.dead = False


@pytest.mark.parametrize("deaths", [{0: 1}, {2: 1, 5: 1}, {6: 1}])
def test_an_item_whose_worker_dies_once_is_tried_again(deaths):
    workers = Mortal(deaths)
    assert dict(each(abs, range(7), workers)) == {i: i for i in range(7)}


def test_an_item_is_given_up_at_the_second_death_and_not_before():
    workers = Mortal({2: 9})
    found = dict(each(abs, range(5), workers))
    assert found[2] == "its worker process died twice"
    assert workers.log.count(2) == 2
    assert {i: found[i] for i in (0, 1, 3, 4)} == {i: i for i in (0, 1, 3, 4)}
