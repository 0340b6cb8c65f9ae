"""Do the tests notice? Mutations of the mathematics and of the judge, one at a time, and the tests that must fail.

    python -m tests.mutate            all of `mutations.toml`
    python -m tests.mutate judge      those whose names begin with one of the words

The package, its hands and the tests are copied to a temporary folder, where a mutation replaces one text of one file;
the checkout and the user's cache are never touched. It ends with 1 if the tests pass with a mutation, or if a mutation
does not fit the code any more.
"""

import multiprocessing
import os
import shutil
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_name("mutations.toml")
JOBS = 2
"""Mutations at a time."""
TIMEOUT = 600.0
"""Longest run of tests [s], all of them without a mutation; on an idle machine it takes a tenth."""
PASSED, FAILED, UNSOUND = 0, 1, 99
"""What pytest ends with; any other number says that no test was run, the last that the package is not the copy's."""
LOG = "log.txt"
LIBRARIES = (
    *("pytest", "hypothesis.strategies", "numpy.testing", "scipy.optimize", "scipy.spatial.transform", "scipy.linalg"),
    *("casadi", "pinocchio", "pinocchio.casadi", "mujoco", "yaml", "pebble", "joblib", "threadpoolctl", "filelock"),
)
"""What every process begins with, those of them that are there: loading them takes longer than most of the tests."""
PROCESSES = multiprocessing.get_context("forkserver")
PROCESSES.set_forkserver_preload(list(LIBRARIES))
KILLED, SURVIVED, BROKEN = "killed", "SURVIVED", "BROKEN"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "-o", "addopts=")
"""Of pytest: nothing that the project adds, so that one process does it all."""


@dataclass(frozen=True)
class Mutation:
    """A text of a file of the package, what replaces it, and the tests (`file::test`) of which one must then fail."""

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def applied(self, text: str) -> str:
        """The file's text with the mutation; raises `ValueError` unless the old text is there exactly once."""
        if (count := text.count(self.old)) != 1:
            raise ValueError(f"{self.name}: its text is {count} times in {self.file}")
        return text.replace(self.old, self.new)


def table(file: Path = TABLE) -> list[Mutation]:
    """The mutations of a file, in its order."""
    rows = tomllib.loads(file.read_text(encoding="utf-8"))["mutation"]
    return [Mutation(**row | {"tests": tuple(row["tests"])}) for row in rows]


def copied(folder: Path) -> Path:
    """A copy of all that the tests need, the package with its hands as it is installed."""
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "sgnlp", folder / "sgnlp", ignore=ignored)
    shutil.copytree(ROOT / "urdf", folder / "sgnlp" / "urdf", ignore=ignored)
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=ignored)
    (folder / "urdf").symlink_to(folder / "sgnlp" / "urdf")
    for name in ("docs", "problems"):
        (folder / name).symlink_to(ROOT / name)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def tested(folder: Path, tests: Sequence[str]) -> int | None:
    """What pytest ends with in a copy, in a process of its own; None where it does not end in time."""
    process = PROCESSES.Process(target=_run, args=(folder, [f"tests/{test}" for test in tests]))
    process.start()
    process.join(TIMEOUT)
    process.kill()
    process.join()
    return process.exitcode


def _run(folder: Path, tests: list[str]) -> None:
    """Run tests in this process, where of the project nothing is loaded yet, and end with pytest's number."""
    log = os.open(folder / LOG, os.O_CREAT | os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(log, stream)
    os.environ |= {
        "PYTHONPATH": str(folder),
        "PYTHONDONTWRITEBYTECODE": "1",
        "SGNLP_TESTS_CACHE": str(folder.parent / "cache"),
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
    }
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(folder))
    os.chdir(folder)
    import pytest

    import sgnlp

    print(f"the package under test is {sgnlp.__file__}", flush=True)
    if Path(sgnlp.__file__).parents[1] != folder:
        os._exit(UNSOUND)
    code = pytest.main([*OPTIONS, *tests])
    sys.stdout.flush()
    os._exit(int(code))


def verdict(mutation: Mutation, parent: Path) -> str:
    """Whether its tests kill a mutation, in a copy of its own in a folder."""
    folder = copied(Path(tempfile.mkdtemp(dir=parent)))
    file = folder / "sgnlp" / mutation.file
    try:
        file.write_text(mutation.applied(file.read_text(encoding="utf-8")), encoding="utf-8")
    except ValueError as error:
        return f"{BROKEN}: {error}"
    code = tested(folder, mutation.tests)
    shutil.rmtree(folder)
    return {PASSED: SURVIVED, FAILED: KILLED}.get(code, f"{BROKEN}: its tests could not be run")


def sound(mutations: Sequence[Mutation], parent: Path) -> str:
    """Why no verdict would mean anything: the copy is not what is imported, or a test fails as it is; else ""."""
    tests = list(dict.fromkeys(test for mutation in mutations for test in mutation.tests))
    halves = [tests[i::JOBS] for i in range(JOBS) if tests[i::JOBS]]
    folders = [copied(Path(tempfile.mkdtemp(dir=parent))) for _ in halves]
    with ThreadPoolExecutor(JOBS) as pool:
        codes = list(pool.map(tested, folders, halves))
    logs = [(folder / LOG).read_text(encoding="utf-8") for folder in folders]
    print(logs[0].splitlines()[0], flush=True)
    failed = [log for log, code in zip(logs, codes, strict=True) if code != PASSED]
    return "the tests do not pass without a mutation:\n" + "\n".join(failed) if failed else ""


def main(words: Sequence[str]) -> int:
    """Try the mutations whose names begin with one of the words, or all, and tell of each."""
    chosen = [m for m in table() if not words or m.name.startswith(tuple(words))]
    if not chosen:
        print(f"no mutation's name begins with {' or '.join(words)}")
        return 1
    os.environ |= dict.fromkeys(THREADS, "1")  # as conftest.py does, before the libraries load
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="sgnlp-mutate-") as name, ThreadPoolExecutor(JOBS) as pool:
        parent = Path(name).resolve()
        if wrong := sound(chosen, parent):
            print(wrong)
            return 1

        def tried(mutation: Mutation) -> str:
            start = time.perf_counter()
            told = verdict(mutation, parent)
            print(f"{told:8}  {time.perf_counter() - start:5.1f} s  {mutation.name} ({mutation.file})", flush=True)
            return told

        verdicts = list(pool.map(tried, chosen))
    killed = verdicts.count(KILLED)
    print(f"{killed} of {len(verdicts)} mutations killed in {time.perf_counter() - begin:.0f} s")
    return 0 if killed == len(verdicts) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
