"""Work behind a command: it ends with it, or soon after if it is nearly done, and nothing is left behind."""

import os
import signal
import subprocess
import sys

import pytest
from processes import group, running, wait_for

from sgnlp.cli.background import Work

WORKING = """
import pathlib, subprocess, sys, time
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
