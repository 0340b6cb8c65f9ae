"""Do the tests notice? Mutations of the mathematics and of the judge, one at a time, and the tests that must fail.

    python -m tests.mutate            all of `mutations.toml`
    python -m tests.mutate judge      those whose names begin with one of the words

The package, its hands and the tests are copied to a temporary folder, where a mutation replaces one text of one file;
the checkout and the user's cache are never touched. It ends with 1 if the tests pass with a mutation, or if a mutation
does not fit the code any more.
"""

import os
import shutil
import subprocess
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
TIMEOUT = 300.0
"""Longest run of the tests of one mutation [s]; the slowest takes a tenth."""
PASSED, FAILED = 0, 1
"""What pytest ends with; any other number says that there was no test to run."""
KILLED, SURVIVED, BROKEN = "killed", "SURVIVED", "BROKEN"
OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "-o", "addopts=-p no:dash")
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
    (folder / "problems").symlink_to(ROOT / "problems")
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def python(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python in a copy: the package is found there, and no cache outside of the folder above it is used."""
    own = {
        "PYTHONPATH": str(folder),
        "PYTHONDONTWRITEBYTECODE": "1",
        "XDG_CACHE_HOME": str(folder.parent / "cache"),
    }
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=folder, env=os.environ | own, capture_output=True, encoding="utf-8", timeout=TIMEOUT
    )


def tested(folder: Path, tests: Sequence[str]) -> int:
    """What pytest ends with in a copy; `BROKEN` tests are told by another number than 0 and 1."""
    return python(folder, "-m", "pytest", *OPTIONS, *(f"tests/{test}" for test in tests)).returncode


def verdict(mutation: Mutation, parent: Path) -> str:
    """Whether its tests kill a mutation, in a copy of its own in a folder."""
    try:
        folder = copied(Path(tempfile.mkdtemp(dir=parent)))
        file = folder / "sgnlp" / mutation.file
        file.write_text(mutation.applied(file.read_text(encoding="utf-8")), encoding="utf-8")
        code = tested(folder, mutation.tests)
        shutil.rmtree(folder)
    except (ValueError, subprocess.TimeoutExpired) as error:
        return f"{BROKEN}: {error}"
    return {PASSED: SURVIVED, FAILED: KILLED}.get(code, f"{BROKEN}: no test of it could be run")


def sound(mutations: Sequence[Mutation], parent: Path) -> str:
    """Why no verdict would mean anything: the copy is not what is imported, or the tests fail as it is; else ""."""
    folder = copied(Path(tempfile.mkdtemp(dir=parent)))
    found = python(folder, "-c", "import sgnlp; print(sgnlp.__file__)")
    print(f"the package under test is {found.stdout.strip() or found.stderr.strip()}", flush=True)
    if not found.stdout.startswith(str(folder)):
        return "this is not the copy that is to be mutated"
    tests = list(dict.fromkeys(test for mutation in mutations for test in mutation.tests))
    done = python(folder, "-m", "pytest", *OPTIONS, *(f"tests/{test}" for test in tests))
    return "" if done.returncode == PASSED else f"the tests fail without a mutation:\n{done.stdout}{done.stderr}"


def main(words: Sequence[str]) -> int:
    """Try the mutations whose names begin with one of the words, or all, and tell of each."""
    chosen = [m for m in table() if not words or m.name.startswith(tuple(words))]
    if not chosen:
        print(f"no mutation's name begins with {' or '.join(words)}")
        return 1
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
