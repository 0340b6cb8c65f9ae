"""Worker processes that live across items: loky's on this machine, or dask's. What kills one costs one item at most.

* loky breaks its whole pool when a process dies. The items that were running, at most one a worker, are tried again at
  the end, one at a time; one with which the pool dies again is to blame. joblib's `Parallel` would end everything
  instead, hence its executor and not `Parallel`.
* dask gives the items of a dead worker to another, up to the scheduler's `allowed-failures` (3) times. Then joblib's
  dask backend would end everything; a client's own futures fail one by one.
* With dask's scheduler go the items that it had. They wait for one at the same address, and are submitted again.
"""

import logging
import math
import multiprocessing
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import resource_tracker
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from sgnlp.base import semaphores
from sgnlp.base.errors import InputError, MachineError
from sgnlp.base.processes import die_with_parent

Item = TypeVar("Item")
Result = TypeVar("Result")

CONNECTING = 10.0
"""How long a scheduler is waited for [s]."""
RETURNING = 300.0
"""How long one that has gone is waited for [s]: to start a scheduler and its workers again, by hand too."""

FEEDER, FEEDING = "QueueFeederThread", 1.0
"""The thread, a daemon, of a queue that is closed, and how long it is waited for [s]. An interpreter that ends while it
gives back the queue's semaphore leaves a warning of what leaked."""


class Workers:
    """Processes that functions are submitted to: `jobs` of this machine, or those of a dask scheduler.

    The workers of a cluster read the files themselves and should have one thread each. At most `window` items should
    be submitted at a time: one a process, so that what ran when one died is known; dask's scheduler knows by itself.
    On a machine without semaphores there is this process alone.

    Raises `InputError` if there is no scheduler at the address, or `distributed` is not installed.
    """

    def __init__(self, jobs: int, scheduler: str | None = None):
        self._alone = scheduler is None and bool(semaphores.fault())
        self.window = math.inf if scheduler is not None else 1 if self._alone else jobs
        self._scheduler = scheduler
        self._client = None if scheduler is None else _client(scheduler)
        self._executor: Any = None

    def submit(self, function: Callable[[Item], Result], item: Item) -> "Future[Result]":
        """The result to come of a function. After `BrokenExecutor` it begins anew with `close`."""
        if self._alone:
            return _done(function, item)
        resource_tracker.ensure_running()  # which, when it starts, lets Ctrl-C through again
        with _uninterrupted():
            if self._executor is None and self._client:
                self._executor = self._client.get_executor(pure=False)
            elif self._executor is None:
                loky = import_module("joblib.externals.loky")
                self._executor = loky.ProcessPoolExecutor(self.window, initializer=die_with_parent)
            return self._executor.submit(function, item)

    def regain(self) -> None:
        """Wait for a scheduler at the address of the one that has gone. It knows nothing of what was submitted.

        Raises:
            MachineError: there is none for `RETURNING`.
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
        """End the processes of this machine and their children at once; of a cluster, what has not begun."""
        if self._executor is not None:
            feeders = [thread for thread in threading.enumerate() if thread.name == FEEDER]
            self._executor.shutdown(**{"wait": False} if self._client else {"kill_workers": True})
            self._executor = None
            for thread in feeders:
                thread.join(FEEDING)
        if self._client:
            self._client.close()


def _done(function: Callable[[Item], Result], item: Item) -> "Future[Result]":
    """The result of a function that has run in this process."""
    future: Future[Result] = Future()
    try:
        future.set_result(function(item))
    except Exception as error:
        future.set_exception(error)
    return future


def _client(scheduler: str) -> Any:
    try:
        with _uninterrupted():
            distributed = import_module("distributed")
            logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # what it tells of, we handle
            return distributed.Client(scheduler, timeout=CONNECTING, set_as_default=False)
    except ImportError:
        raise InputError("the dask backend needs the package distributed: pip install 'sgnlp[dask]'") from None
    except (OSError, ValueError) as error:
        raise InputError(f"no dask scheduler answers at '{scheduler}': {_reason(error)}") from None


def each(
    function: Callable[[Item], Result], items: Iterable[Item], workers: Workers
) -> Iterator[tuple[Item, Result | str]]:
    """Apply a function to every item, yielding its result, or the reason why there is none, as they come.

    When the processes break, the items then running are tried again at the end, one at a time; an item with which
    they break a second time has failed. When the scheduler of a cluster goes, its items wait for the next one.

    Raises:
        MachineError: it does not come back.
    """
    waiting, suspects, flying = deque(items), deque[Item](), dict[Future[Result], Item]()
    trial = False  # whether the one item that is flying is a suspect

    def fly(item: Item) -> None:
        try:
            flying[workers.submit(function, item)] = item
        except BrokenExecutor:  # an idle process died: no item's fault
            workers.close()
            flying[workers.submit(function, item)] = item

    while waiting or suspects or flying:
        while waiting and len(flying) < workers.window:
            fly(waiting.popleft())
        if suspects and not flying:
            trial = True
            fly(suspects.popleft())
        for future in sorted(wait(flying, return_when=FIRST_COMPLETED).done, key=Future.cancelled):
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
                break
            except Exception as error:  # whatever it is, it is this object's, not the batch's
                yield item, _reason(error)
            trial = False


def _reason(error: Exception) -> str:
    line = (str(error).splitlines() or [""])[0]
    return line if isinstance(error, InputError) else f"{type(error).__name__}: {line}"


_alone = threading.Lock()


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """What a process of any backend needs to solve an object.

    One object at a time, for CasADi is not thread-safe; one thread of BLAS; and leave to fork, which
    multiprocessing withholds from the daemons that dask's nannies start.
    """
    multiprocessing.current_process().daemon = False
    with _alone, threadpool_limits(1):
        yield


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Keep Ctrl-C waiting; processes and threads that are started meanwhile inherit this and never hear of it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
