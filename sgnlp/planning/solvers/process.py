"""Runs libraries that may crash, hang or print in a separate, silent process.

What a process sent before its end is kept, with the reason for the end.
"""

import ctypes
import faulthandler
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from multiprocessing.connection import Connection
from typing import Any

from sgnlp.base.errors import SgnlpError
from sgnlp.base.processes import follow_parent

WALL_FACTOR = 60.0
"""A process that sends nothing for this many times its limit of processor time hangs: no machine is that busy."""

Send = Callable[[Any], None]


@contextmanager
def silence() -> Iterator[None]:
    """Discard what libraries print, from C and from Python."""
    kept = {stream: os.dup(stream) for stream in (1, 2)}
    try:
        with open(os.devnull, "w", encoding="utf-8") as nothing, redirect_stdout(nothing), redirect_stderr(nothing):
            for stream in kept:
                os.dup2(nothing.fileno(), stream)
            yield
            ctypes.CDLL(None).fflush(None)
    finally:
        for stream, copy in kept.items():
            os.dup2(copy, stream)
            os.close(copy)


def spend(seconds: float) -> None:
    """Let the kernel end this process once it has used this much processor time [s]; 0 removes the limit."""
    signal.setitimer(signal.ITIMER_PROF, seconds)


def apart(work: Callable[[Send], None], seconds: float) -> tuple[list[Any], str]:
    """What `work` sends from a process forked for it, and why the process ended early; "" if it did not.

    The process is ended if nothing was sent for `WALL_FACTOR` times `seconds` of wall time. It limits its processor
    time itself, by `spend`. What its libraries print is discarded.
    """
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(work, theirs), daemon=True)
    process.start()
    theirs.close()
    sent: list[Any] = []
    try:
        while True:
            if not ours.poll(WALL_FACTOR * seconds):
                return sent, f"no word for {WALL_FACTOR * seconds:g} s"
            kind, value = ours.recv()
            if kind == "end":
                return sent, value
            sent.append(value)
    except (EOFError, OSError):
        process.join()
        return sent, _reason(process.exitcode, seconds)
    finally:
        process.kill()
        process.join()
        ours.close()


def _child(work: Callable[[Send], None], pipe: Connection) -> None:
    follow_parent()
    faulthandler.disable()  # a crash is reported by its reason
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silence, stream)
    reason = ""
    try:
        work(lambda value: pipe.send(("value", value)))
    except Exception as error:  # any error ends this work only
        line = next(iter(str(error).splitlines()[::-1]), "").strip()
        reason = line if isinstance(error, SgnlpError) else f"{type(error).__name__}: {line}"
    spend(0.0)
    pipe.send(("end", reason))
    pipe.close()
    os._exit(0)  # a library's own exit may hang


def _reason(code: int | None, seconds: float) -> str:
    if code == 0:  # it ended itself
        return ""
    if code == -signal.SIGPROF:
        return f"over {seconds:g} s of processor time"
    if code is not None and code < 0:
        return f"killed by {signal.Signals(-code).name}"
    return f"process ended with exit code {code}"
