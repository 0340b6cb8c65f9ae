"""Worker processes that serve many items: loky's on this machine, or dask's. A crash costs at most one item.

* loky breaks its whole pool when a process dies. The items that were running, at most one for each worker, are tried
  again at the end, one at a time; an item with which the pool dies again has failed. joblib's `Parallel` would end
  everything instead, so its executor is used.
* dask gives the items of a dead worker to another, up to the scheduler's `allowed-failures` (3) times. Then joblib's
  dask backend would end everything; a client's own futures fail one by one.
* If dask's scheduler dies, its items are lost. They wait for a scheduler at the same address, and are submitted again.
"""

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import resource_tracker
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from sgnlp.base import semaphores
from sgnlp.base.errors import InputError, MachineError
from sgnlp.base.futures import Ended
from sgnlp.base.processes import follow_parent, uninterrupted, with_children

Item = TypeVar("Item")
Result = TypeVar("Result")

CONNECTING = 10.0
"""Longest wait for a scheduler [s]."""
RETURNING = 300.0
"""Longest wait for a scheduler that has died [s]: enough to start it and its workers again by hand."""

FEEDER, FEEDING = "QueueFeederThread", 1.0
"""Name of the daemon thread of a closed queue, and the longest wait for it [s]. If the interpreter ended while it
returns the queue's semaphore, a warning of a leak would be printed."""


class Workers:
    """Processes that run submitted functions: `jobs` on this machine, or those of a dask scheduler.

    The workers of a cluster read the files themselves and should have one thread each. At most `window` items should
    be submitted at a time: one for each process, so that it is known which items ran when one died. dask's scheduler
    knows that itself. On a machine without semaphores this process does the work alone.

    Raises `InputError` if there is no scheduler at the address, or `distributed` is not installed.
    """

    def __init__(self, jobs: int, scheduler: str | None = None):
        self._alone = scheduler is None and bool(semaphores.fault())
        self.window = math.inf if scheduler is not None else 1 if self._alone else jobs
        self._scheduler = scheduler
        self._client = None if scheduler is None else _client(scheduler)
        self._executor: Any = None

    def submit(self, function: Callable[[Item], Result], item: Item) -> "Future[Result]":
        """The future of a function's result. After `BrokenExecutor`, `close` makes it usable again."""
        if self._alone:
            return _done(function, item)
        resource_tracker.ensure_running()  # loky's resource tracker unblocks Ctrl-C when it starts
        with uninterrupted():
            if self._executor is None and self._client:
                self._executor = self._client.get_executor(pure=False)
            elif self._executor is None:
                loky = import_module("joblib.externals.loky")
                self._executor = loky.ProcessPoolExecutor(self.window, initializer=follow_parent)
            return self._executor.submit(function, item)

    def lacking(self) -> str:
        """Words on a scheduler without workers, for which all items wait; "" if it has some, or there is none."""
        if self._client is None or self._client.scheduler_info()["workers"]:
            return ""
        start = f"dask worker {self._scheduler} --nthreads 1"
        return f"No worker has come to the dask scheduler yet, and all waits for one. Start it by: {start}"

    def regain(self) -> None:
        """Wait for a new scheduler at the address of the one that died. It does not know the submitted items.

        Raises:
            MachineError: none comes within `RETURNING`.
        """
        assert self._scheduler is not None
        self.close()
        end = time.monotonic() + RETURNING
        while True:
            try:
                self._client = _client(self._scheduler)
                return
            except InputError:
                if time.monotonic() > end:
                    again = "start it again and repeat the command: it goes on where it ended"
                    raise MachineError(f"the dask scheduler at '{self._scheduler}' has gone; {again}") from None
                time.sleep(1.0)

    def close(self) -> None:
        """End the processes on this machine and their children at once; on a cluster, cancel items that have not
        begun."""
        if self._executor is not None:
            feeders = [thread for thread in threading.enumerate() if thread.name == FEEDER]
            self._executor.shutdown(**{"wait": False} if self._client else {"kill_workers": True})
            self._executor = None
            for thread in feeders:
                thread.join(FEEDING)
        if self._client:
            self._client.close()


def _done(function: Callable[[Item], Result], item: Item) -> "Future[Result]":
    """A finished future of a function that runs in this process."""
    future: Future[Result] = Future()
    try:
        future.set_result(function(item))
    except Exception as error:
        future.set_exception(error)
    return future


def _client(scheduler: str) -> Any:
    try:
        with uninterrupted():
            distributed = import_module("distributed")
            logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # we handle what it reports
            return distributed.Client(scheduler, timeout=CONNECTING, set_as_default=False)
    except ImportError:
        raise InputError("the dask backend needs the package distributed: pip install 'sgnlp[dask]'") from None
    except (OSError, ValueError) as error:
        raise InputError(f"no dask scheduler answers at '{scheduler}': {_reason(error)}") from None


def each(
    function: Callable[[Item], Result], items: Iterable[Item], workers: Workers
) -> Iterator[tuple[Item, Result | str]]:
    """Apply a function to every item, and yield each result, or the reason for its failure, as they come.

    If the pool breaks, the items then running are tried again at the end, one at a time; an item with which it breaks
    a second time has failed. If the scheduler of a cluster dies, its items wait for the next one.

    Raises:
        MachineError: the scheduler does not come back.
    """
    waiting, suspects, flying, ended = deque(items), deque[Item](), dict[Future[Result], Item](), Ended()
    trial = False  # whether the only running item is a suspect

    def fly(item: Item) -> None:
        try:
            future = workers.submit(function, item)
        except BrokenExecutor:  # an idle process died, which is no item's fault
            workers.close()
            future = workers.submit(function, item)
        flying[future] = item
        ended.watch(future)

    while waiting or suspects or flying:
        while waiting and len(flying) < workers.window:
            fly(waiting.popleft())
        if suspects and not flying:
            trial = True
            fly(suspects.popleft())
        for future in sorted(ended.wait(), key=Future.cancelled):
            item = flying.pop(future)
            try:
                yield item, future.result()
            except BrokenExecutor:
                workers.close()
                if trial:
                    yield item, "its worker process died twice"
                else:
                    suspects.append(item)
            except CancelledError:
                workers.regain()
                waiting.extend((item, *flying.values()))
                flying.clear()
                ended = Ended()
                break
            except Exception as error:  # any error is this object's, not the batch's
                yield item, _reason(error)
            trial = False


def _reason(error: Exception) -> str:
    line = (str(error).splitlines() or [""])[0]
    return line if isinstance(error, InputError) else f"{type(error).__name__}: {line}"


_alone = threading.Lock()


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Prepare a process of any backend to solve an object.

    One object at a time, since CasADi is not thread-safe; one BLAS thread; and permission to fork, which
    multiprocessing denies to the daemons that dask's nannies start.
    """
    with _alone, with_children(), threadpool_limits(1):
        yield
