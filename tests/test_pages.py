"""The code in the pages of the documentation runs, and the tutorial's commands print what it says they print."""

import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from unittest import SkipTest

import pytest

sybil = pytest.importorskip("sybil", reason="finds the code in the pages")
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser  # noqa: E402

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "pages"
SHARED = ("docs", "problems", "urdf")
"""What a reader in the project's folder has, beside the files that a page makes."""
CHEAP = "--starts 1 --gpis.surface-points 60 --gpis.interior-points 15 --timeout 3600"
"""Added to the plans of all pages but the tutorial, whose numbers are compared."""
SGNLP = """#!/bin/sh
case "$1" in solve|batch) exec {python} -m sgnlp "$@" $CHEAP ;; esac
exec {python} -m sgnlp "$@"
"""
TOLERANCE = 0.05
"""Of numbers in what the tutorial shows: machines with and without a compiler differ in the last digits."""
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?![\w.]*\d)")


@pytest.fixture
def namespace(tmp_path, monkeypatch) -> dict[str, Any]:
    """A folder with the project's own in it is the current one, with `sgnlp` on the path."""
    monkeypatch.chdir(tmp_path)
    for name in SHARED:
        (tmp_path / name).symlink_to(ROOT / name)
    commands = tmp_path / ".commands"
    commands.mkdir()
    (commands / "sgnlp").write_text(SGNLP.format(python=sys.executable), encoding="utf-8")
    (commands / "sgnlp").chmod(0o755)
    path = f"{commands}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT), "COLUMNS": "100"}
    missing = {"missing": lambda *modules: not all(find_spec(name) for name in modules), "which": shutil.which}
    return {"environment": environment, "printed": "", **missing}


def run(example: Any) -> str | None:
    """Run a block of commands; the first that fails is the failure of the block."""
    names = example.namespace
    environment = names["environment"] | {"CHEAP": "" if _is_tutorial(example) else CHEAP}
    command = ["bash", "-euo", "pipefail", "-c", example.parsed]
    done = subprocess.run(command, env=environment, capture_output=True, encoding="utf-8", timeout=900)
    names["printed"] = done.stdout
    return None if done.returncode == 0 else f"exit code {done.returncode}\n{done.stdout}{done.stderr}"


def compare(example: Any) -> str | None:
    """Compare a block `text` of the tutorial with what the last commands printed.

    `...` stands for anything, white space is all alike, numbers agree to `TOLERANCE`.
    """
    if not _is_tutorial(example):
        return None
    expected, printed = example.parsed, example.namespace["printed"]
    parts = [re.escape(part) for part in NUMBER.split(" ".join(expected.split()))]
    pattern = r"([-+]?\d+(?:\.\d+)?)".join(part.replace(r"\.\.\.", ".*?").replace(r"\ ", r"\s+") for part in parts)
    found = re.search(pattern, printed, re.DOTALL)
    if not found:
        return f"was not printed in\n{printed}"
    pairs = zip(map(float, NUMBER.findall(expected)), map(float, found.groups()), strict=True)
    wrong = [f"{theirs:g} is {ours:g}" for theirs, ours in pairs if ours != pytest.approx(theirs, rel=TOLERANCE)]
    return f"{', '.join(wrong)} in\n{printed}" if wrong else None


def _is_tutorial(example: Any) -> bool:
    return Path(example.path).stem == "tutorial"


BLOCKS = sybil.Sybil(
    [SkipParser(), PythonCodeBlockParser(), CodeBlockParser("bash", run), CodeBlockParser("text", compare)]
)


@pytest.mark.parametrize("page", sorted(PAGES.rglob("*.md")), ids=lambda page: page.stem)
def test_the_code_of_a_page_runs(page, namespace):
    """Block by block in one folder and namespace; a block that says what it needs is left out where that is missing."""
    document = BLOCKS.parse(page)
    document.namespace |= namespace
    for example in document.examples():
        with suppress(SkipTest):
            example.evaluate()
