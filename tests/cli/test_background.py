"""Work behind a command: it ends with it, or soon after if it is nearly done, and nothing is left behind."""

import errno
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hands import THREE
from plans import SMALL_FLAGS
from processes import COMMAND, command_with, group, interrupted, running, wait_for
from scenes import ellipsoid

from sgnlp.cli.background import Work
from sgnlp.program import compiled

WORKING = """
import pathlib, signal, subprocess, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # what a shell starts in the background ignores it
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # and what nohup starts this
sys.path[:0] = {path!r}
from sgnlp.cli import background
background.NEARLY = {nearly}
def do(left):
    left({left})
    pathlib.Path("own").write_text(str(background.os.getpid()))
    subprocess.run([sys.executable, "-c", {child!r}])
    pathlib.Path("done").touch()
work = background.Work(do)
while not pathlib.Path("child").exists():
    time.sleep(0.01)
{then}
"""
CHILD = "import pathlib, time; pathlib.Path('child').touch(); {}"
LONG, SHORT = CHILD.format("time.sleep(1000)"), CHILD.format("time.sleep(1)")


def command(then: str, child: str = LONG, left: float = 1000.0, nearly: float = 20.0) -> list[str]:
    """A command with work behind it that has a child; `then` it goes on."""
    return [sys.executable, "-c", WORKING.format(path=sys.path, child=child, left=left, nearly=nearly, then=then)]


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """An empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read_only(*args: object, **kwargs: object) -> None:
    raise OSError(errno.EROFS, os.strerror(errno.EROFS))


def left_behind(place) -> list[int]:
    """What lives of the work and its child, whose group is that of the work."""
    return group(int((place / "own").read_text(encoding="utf-8")))


@pytest.mark.parametrize("then", ["work.finish()", "work.end()", "raise SystemExit(1)", "raise RuntimeError"])
def test_it_ends_with_the_command_however_that_ends(place, then):
    subprocess.run(command(then), capture_output=True, check=False)
    assert wait_for(lambda: not left_behind(place))
    assert not (place / "done").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGHUP])
def test_it_ends_when_the_command_is_killed(place, number):
    with running(command("time.sleep(1000)")) as process:
        assert wait_for((place / "child").exists)
        assert len(left_behind(place)) == 2
        os.kill(process.pid, number)
        assert wait_for(lambda: not left_behind(place))


def test_ctrl_c_at_a_terminal_reaches_the_command_alone_which_ends_the_work(place):
    with running(command("time.sleep(1000)")) as process:
        assert wait_for((place / "child").exists)
        os.killpg(process.pid, signal.SIGINT)
        assert wait_for(lambda: not left_behind(place))


def test_it_reports_without_a_file_of_shared_memory(monkeypatch):
    monkeypatch.setattr("tempfile.mkstemp", read_only)
    work = Work(lambda left: (left(1.0), time.sleep(1000)))
    assert wait_for(lambda: work._left.value == 1.0)
    work.end()


def test_what_is_nearly_done_goes_on_after_the_command(place):
    subprocess.run(command("assert work.finish()", SHORT, left=5.0), check=True)
    assert wait_for((place / "done").exists)
    assert wait_for(lambda: not left_behind(place))


def test_what_said_that_it_was_nearly_done_and_is_not_ends_all_the_same(place):
    subprocess.run(command("assert work.finish()", left=0.1, nearly=0.2), check=True)
    assert wait_for(lambda: not left_behind(place))
    assert not (place / "done").exists()


def test_work_that_fails_has_not_done_all():
    for work, done in ((lambda left: None, True), (lambda left: 1 / 0, False)):
        behind = Work(work)
        assert wait_for(
            lambda behind=behind: os.waitid(os.P_PID, behind._process, os.WEXITED | os.WNOWAIT | os.WNOHANG)
        )
        assert behind.finish() == done


def test_it_is_the_last_in_turn_and_silent(place, capfd):
    def do(left):
        (place / "nice").write_text(str(os.nice(0)), encoding="utf-8")
        os.write(1, b"heard")
        os.write(2, b"heard")

    work = Work(do)
    assert wait_for(lambda: os.waitid(os.P_PID, work._process, os.WEXITED | os.WNOWAIT | os.WNOHANG))
    assert work.finish()
    assert (place / "nice").read_text(encoding="utf-8") == "19"
    assert capfd.readouterr() == ("", "")


FLAGS = ["--hand", str(THREE), "--starts", "1", "--rounds", "1", "--solver.formulation", "penalty", *SMALL_FLAGS]
FLAGS += ["--solver.max-iterations", "3"]


@pytest.fixture
def cache(place, monkeypatch):
    """A cache of the test's own with a cloud beside it, where nothing is compiled."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(place / "cache"))
    with open("ellipsoid.npz", "wb") as stream:
        np.savez(stream, points=ellipsoid(), table_height=0.0)
    return place / "cache" / "sgnlp"


def users(cache) -> list[int]:
    """The processes that have this cache."""
    found = []
    for environment in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if str(cache.parent).encode() in environment.read_bytes():
                found.append(int(environment.parent.name))
    return found


def half_built(cache) -> list[Path]:
    """What is compiled of the program whose build was broken off."""
    return sorted(cache.glob(".build-program-*/*.o"))


@pytest.mark.skipif(not compiled.can_compile(), reason="no C compiler")
def test_ctrl_c_ends_the_compilers_too(cache):
    hanging = command_with("import sgnlp.planning.pool, processes; sgnlp.planning.pool.solve_start = processes.hang")
    with running([*hanging, "solve", "ellipsoid.npz", *FLAGS]) as process:
        assert wait_for(lambda: half_built(cache)), "nothing is compiled"
        assert interrupted(process) == (130, "", "interrupted\n")
    assert wait_for(lambda: not users(cache)), "a compiler is left"
    assert not list(cache.glob("program-*.so"))


NOTING = """#!/bin/sh
echo "$@" >> {log}
case "$PWD $*" in *.build-program-*" -c "*)
    eval "made=\\${{$#}}"
    [ -z "$HALTS" ] || mkdir {log}.first || exec sleep 60
    exec cc -x c -c /dev/null -o "$made";;
esac
exec cc "$@"
"""
"""A compiler that notes what it is asked for. Of a program it makes empty files, if it halts only the first of them."""


@pytest.mark.skipif(not compiled.can_compile(), reason="no C compiler")
def test_a_library_that_a_plan_left_half_built_is_finished_by_what_comes_after_it(place, cache, monkeypatch):
    compiler, log = place / "noting", place / "asked"
    compiler.write_text(NOTING.format(log=log), encoding="utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setenv("CXX", "no-such-compiler")
    monkeypatch.setenv("HALTS", "1")
    slow = command_with(
        "from sgnlp.cli import background; background.NEARLY = -1; import pathlib, time; from sgnlp.cli import solve;"
        "show = solve._show;"
        f"cache = pathlib.Path({str(cache)!r});"
        "begun = lambda: time.sleep(0.02) or any(cache.glob('.build-program-*/*.o'));"
        "wait = lambda: list(iter(begun, True));"
        "solve._show = lambda *given: (wait(), show(*given))"
    )
    done = subprocess.run([*slow, "solve", "ellipsoid.npz", *FLAGS], capture_output=True, encoding="utf-8", check=False)
    assert "of them are compiled so far. The next plans go on compiling." in " ".join(done.stdout.split()), done.stderr
    assert wait_for(lambda: not users(cache)), "a compiler is left"
    before = [file.name for file in half_built(cache)]
    assert before
    assert not list(cache.glob("program-*.so"))
    flags = [*FLAGS[:2], *FLAGS[6:]]  # without starts and rounds
    monkeypatch.delenv("HALTS")
    subprocess.run([*COMMAND, "cache", "--build", *flags], capture_output=True, check=True)
    assert len(list(cache.glob("program-*.so"))) == 1
    assert not half_built(cache)
    asked = log.read_text(encoding="utf-8")
    assert [asked.count(f" -o {name}.part") for name in before] == [1] * len(before)
