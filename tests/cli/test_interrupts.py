"""Ctrl-C is heard wherever it comes, once, and what it breaks off is silent."""

import os
import signal
import sys
import threading
import time

import pytest
from rich.console import Console

from sgnlp.cli import interrupts
from sgnlp.cli.interrupts import check, listening
from sgnlp.cli.progress import bars


def press() -> None:
    """Ctrl-C."""
    signal.raise_signal(signal.SIGINT)


def swallow() -> None:
    """Ctrl-C in what clears the errors that it meets."""
    with pytest.raises(KeyboardInterrupt):
        press()


class Destroyed:
    """Ctrl-C comes while it is destroyed, or what it closes then was never opened."""

    def __init__(self, error: type[Exception] | None = None):
        self.error = error

    def __del__(self):
        if self.error is not None:
            raise self.error
        press()


def wait() -> None:
    """Nothing that looks for Ctrl-C itself."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        time.sleep(0.01)
    pytest.fail("never heard")


@pytest.fixture(autouse=True)
def _leaves_all_as_it_was():
    def now() -> list[object]:
        return [signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM), sys.unraisablehook]

    before = now()
    yield
    assert now() == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_it_ends_what_runs():
    with pytest.raises(KeyboardInterrupt), listening():
        press()


def test_one_that_is_swallowed_is_heard_at_the_next_check_and_at_the_next_step_of_a_bar():
    with listening(), bars(Console()) as bar:
        check()
        steps = bar("starts", 2)
        steps.advance(None)
        swallow()
        for look in (check, lambda: steps.advance(None), lambda: steps.move(1, 2)):
            with pytest.raises(KeyboardInterrupt):
                look()


def test_one_in_a_destructor_is_heard_a_moment_later_and_not_reported(capfd):
    with pytest.raises(KeyboardInterrupt), listening():  # noqa: PT012
        Destroyed()
        wait()
    assert capfd.readouterr() == ("", "")


def test_one_that_is_told_by_a_check_does_not_come_again(monkeypatch):
    monkeypatch.setattr(interrupts, "AGAIN", 1e-3)
    with listening():
        Destroyed()
        with pytest.raises(KeyboardInterrupt):
            check()
        time.sleep(0.1)


def test_one_inside_the_hooks_of_a_fork_lets_them_end_and_is_heard_a_moment_later():
    namespace = {"__name__": "logging", "signal": signal}
    exec("def release():\n    signal.raise_signal(signal.SIGINT)\n    return 'not interrupted'", namespace)
    with pytest.raises(KeyboardInterrupt), listening():  # noqa: PT012
        assert namespace["release"]() == "not interrupted"
        wait()


def test_it_is_no_business_of_a_process_just_forked():
    with listening():
        child = os.fork()
        if child == 0:
            try:
                press()
                os._exit(0)
            except KeyboardInterrupt:
                os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def fail() -> None:
    raise RuntimeError("in a thread")


def test_destructors_and_threads_that_fail_are_reported_unless_ctrl_c_has_come():
    heard: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "unraisablehook", lambda told: heard.append(told.exc_type.__name__))
        patch.setattr(threading, "excepthook", lambda told: heard.append(told.exc_type.__name__))
        for _ in range(2):
            with listening():
                if heard:
                    swallow()
                Destroyed(ValueError)
                thread = threading.Thread(target=fail)
                thread.start()
                thread.join()
    assert heard == ["ValueError", "RuntimeError"]
