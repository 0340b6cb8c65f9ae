"""Futures as they end, waited for such that Ctrl-C leaves none of their locks held.

`wait` and `as_completed` of `concurrent.futures` take the locks of all futures. A KeyboardInterrupt between the taking
of one and its release leaves it held. Then the thread of the pool waits for that lock, and the end of the pool for that
thread, for ever.
"""

from concurrent.futures import Future
from queue import Empty, SimpleQueue
from typing import Any

from sgnlp.base.processes import uninterrupted


class Ended:
    """The watched futures that have ended. They are waited for in C, which holds no lock of theirs."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Future[Any]] = SimpleQueue()

    def watch(self, future: "Future[Any]") -> None:
        """Tell of this one, too, when it ends."""
        with uninterrupted():
            future.add_done_callback(self._queue.put)

    def wait(self, seconds: float | None = None) -> "list[Future[Any]]":
        """Those that have ended and were not told yet, in this order: one at least, or none if that takes longer."""
        try:
            found = [self._queue.get(timeout=seconds)]
        except Empty:
            return []
        while not self._queue.empty():
            found.append(self._queue.get())
        return found
