"""What all tests share: one thread a process, a cache and a width of output of their own, properties drawn alike.

The environment is set before NumPy loads; the workers of pytest-xdist and all processes that a test starts inherit it.
"""

import importlib
import os
import shutil
import sys
import tempfile

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"
for _variable in ("COLUMNS", "LINES", "FORCE_COLOR", "NO_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "TERM"):
    os.environ.pop(_variable, None)  # what is printed has the width of 80 and no colour, wherever the tests run
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # else every process that a test starts parses all modules again
sys.dont_write_bytecode = False
SHARED = "SGNLP_TESTS_CACHE"
"""A variable that names the cache of several runs of the tests, which none of them removes."""
OWN = SHARED not in os.environ and "PYTEST_XDIST_WORKER" not in os.environ
if SHARED in os.environ:
    os.environ["XDG_CACHE_HOME"] = os.environ[SHARED]
elif OWN:
    os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp(prefix="sgnlp-tests-")

from pathlib import Path  # noqa: E402

import hypothesis  # noqa: E402
import pytest  # noqa: E402

LONGEST = (
    "test_pages",
    "test_batch",
    "test_cli",
    "test_view",
    "test_nlp",
    "test_draft",
    "test_benchmark",
    "test_docs",
    "test_check_hand",
    "test_solvers",
    "test_background",
    "test_compiled",
    "test_segment",
    "test_cli_simulate",
    "test_closure",
    "test_problems",
    "test_simulation",
    "test_report",
    "test_mutate",
    "test_readme",
    "test_open_program",
    "test_examples",
    "test_package",
)
"""The files that take long: they begin first, so that the processes end at the same time."""
PROCESSES = 4
"""At most, each of which may need 1 GB; no more than there are cores."""

hypothesis.settings.register_profile(
    "everywhere",
    derandomize=True,
    database=None,
    deadline=None,  # as for `too_slow`: how fast a machine is, is no property of the code
    print_blob=True,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
hypothesis.settings.load_profile("everywhere")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """As many processes as cores that this one may use."""
    return min(len(os.sched_getaffinity(0)), PROCESSES)


def pytest_sessionstart(session: pytest.Session) -> None:
    """What all plans share is compiled once, before processes ask for it at once."""
    if not hasattr(session.config, "workerinput"):
        for library in importlib.import_module("sgnlp.cli.compiling").LIBRARIES:
            library.load()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, and marked `long`."""
    places = {name: place for place, name in enumerate(LONGEST)}
    for item in items:
        if item.path.stem in places:
            item.add_marker(pytest.mark.long)
    items.sort(key=lambda item: places.get(item.path.stem, len(places)))


class Idle:
    """In the place of work behind a command."""

    def __init__(self, do: object):
        self.do = do

    def finish(self) -> bool:
        return False

    def end(self) -> None:
        pass


@pytest.fixture(scope="session", autouse=True)
def _nothing_works_behind_a_command() -> None:
    """A plan made in a process of the tests, by a fixture too, starts no compilers that work beside them."""
    importlib.import_module("sgnlp.cli.background").Work = Idle


def pytest_unconfigure(config: pytest.Config) -> None:
    """The cache goes with the process that made it."""
    if OWN:
        shutil.rmtree(os.environ["XDG_CACHE_HOME"], ignore_errors=True)


@pytest.fixture(scope="session", autouse=True)
def _small_pictures() -> None:
    """Pictures of grasps are drawn and packed with a tenth of their polygons and pixels."""
    png = importlib.import_module("sgnlp.show.png")
    whole = png._polygons
    png.DPI = 40
    png._polygons = lambda *shape: tuple(part[::10] for part in whole(*shape))


@pytest.fixture
def real_clouds() -> list[Path]:
    """The npz files in the folder named by SGNLP_REAL_CLOUDS; skips the test when there are none."""
    folder = os.environ.get("SGNLP_REAL_CLOUDS", "")
    files = sorted(Path(folder).glob("*.npz")) if folder else []
    if not files:
        pytest.skip("SGNLP_REAL_CLOUDS names no folder of npz clouds")
    return files
