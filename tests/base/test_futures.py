"""Futures as they end: each is told once, in order, and Ctrl-C leaves none of their locks held."""

import os
import signal
import threading
import time
from concurrent.futures import CancelledError, Future
from threading import Condition, Event, Thread

import pytest

from sgnlp.base.futures import Ended


def finished(value: int) -> Future:
    future: Future = Future()
    future.set_result(value)
    return future


def test_every_future_is_told_once_in_the_order_in_which_they_end():
    ended, futures = Ended(), [Future() for _ in range(4)]
    for future in futures:
        ended.watch(future)
    assert ended.wait(0) == []
    futures[2].set_result(2)
    futures[0].set_exception(ValueError())
    futures[1].cancel()
    assert ended.wait() == [futures[2], futures[0], futures[1]]
    with pytest.raises(CancelledError):
        futures[1].result()
    Thread(target=futures[3].set_result, args=(3,)).start()
    assert ended.wait() == [futures[3]]
    ended.watch(done := finished(4))
    assert ended.wait(0) == [done]


@pytest.mark.parametrize("other_thread", [False, True])
def test_ctrl_c_while_the_lock_of_a_future_is_taken_leaves_it_free(monkeypatch, other_thread):
    ended, future, enter, sent, over = Ended(), Future(), Condition.__enter__, list[int](), Event()
    if other_thread:  # the kernel gives a signal that one thread blocks to another
        Thread(target=over.wait, daemon=True).start()

    def interrupted(self: Condition) -> bool:
        found = enter(self)
        if not sent and threading.current_thread() is threading.main_thread():
            sent.append(os.getpid())
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.1)  # the other thread receives it when it is given a core
        return found

    def watched() -> None:
        ended.watch(future)
        time.sleep(10)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background processes ignore it
    monkeypatch.setattr(Condition, "__enter__", interrupted)
    with pytest.raises(KeyboardInterrupt):
        watched()
    signal.signal(signal.SIGINT, before)
    monkeypatch.undo()
    over.set()
    assert sent
    thread = Thread(target=future.set_result, args=(1,), daemon=True)
    thread.start()
    thread.join(10)
    assert not thread.is_alive(), "the lock is held"
    assert ended.wait(0) == [future]
