"""Worker processes that die: nothing is lost but the item that is to blame."""

import math
import os
import signal
import time
from concurrent.futures import BrokenExecutor, Future

import pytest
from here import Here

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
