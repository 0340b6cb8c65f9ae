"""No process is left behind by one that is killed."""

import os
import signal
import sys
from pathlib import Path

import pytest
from processes import TESTS, group, running, wait_for

START = (
    "from processes import hang; from scenes import SMALL, posed, replace; from sgnlp.planning.pool import map_starts; "
    "from sgnlp.planning.starts import starts; from sgnlp.base.settings import Solver; "
    "problem = posed(replace(SMALL, solver=Solver(formulation='penalty'), spheres='paper')); "
    "list(map_starts(hang, problem, starts(problem, 1, 0), 1, None))"
)
APART = (
    "from processes import hang; from sgnlp.planning.solvers.process import apart; "
    "apart(lambda send: hang(None, None), 1.0)"
)

WORKER = (
    "from processes import hang; from functools import partial; from sgnlp.planning.workers import Workers; "
    "import time; Workers(2).submit(partial(hang, None), None); time.sleep(1000)"
)


@pytest.fixture(autouse=True)
def here(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel does it, on Linux")
@pytest.mark.parametrize("work", [START, APART, WORKER], ids=["start", "solver", "worker"])
def test_what_a_process_started_ends_when_it_is_killed(work):
    code = f"import sys; sys.path.insert(0, {str(TESTS)!r}); {work}"
    with running([sys.executable, "-c", code]) as process:
        assert wait_for(Path("hanging").exists)
        assert len(group(process.pid)) > 1
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        assert wait_for(lambda: not group(process.pid)), "a process is left"
