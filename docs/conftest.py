"""The code in the pages is run: Python in this process, commands in bash, and what they print is compared."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
SHARED = ("docs", "problems", "urdf")
"""What a reader in the project's folder has beside the files that a page makes."""
CHEAP = "--starts 1 --gpis.surface-points 60 --gpis.interior-points 15"
"""Added to the plans of all pages but the tutorial, whose numbers are compared."""
SGNLP = """#!/bin/sh
case "$1" in solve|batch) exec {python} -m sgnlp "$@" $CHEAP ;; esac
exec {python} -m sgnlp "$@"
"""
TOLERANCE = 0.05
"""Of numbers in what a page says that a command prints: machines with and without a compiler differ in last digits."""
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?![\w.]*\d)")


def begin(namespace: dict[str, Any]) -> None:
    """A folder for a page with the project's own in it, and `sgnlp` on the path."""
    folder = Path(tempfile.mkdtemp(prefix="sgnlp-docs-"))
    for name in SHARED:
        (folder / name).symlink_to(ROOT / name)
    commands = folder / ".commands"
    commands.mkdir()
    (commands / "sgnlp").write_text(SGNLP.format(python=sys.executable))
    (commands / "sgnlp").chmod(0o755)
    path = f"{commands}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT), "COLUMNS": "100", "OMP_NUM_THREADS": "1"}
    namespace |= {"folder": folder, "before": Path.cwd(), "environment": environment, "printed": ""}
    namespace |= {"missing": lambda *modules: not all(find_spec(name) for name in modules), "which": shutil.which}
    os.chdir(folder)


def end(namespace: dict[str, Any]) -> None:
    """Leave no folder behind."""
    os.chdir(namespace["before"])
    shutil.rmtree(namespace["folder"])


def run(example: Any) -> str | None:
    """Run a block of commands; the first that fails is the failure of the block."""
    page = Path(example.path)
    environment = example.namespace["environment"] | {"CHEAP": "" if page.stem == "tutorial" else CHEAP}
    command = ["bash", "-euo", "pipefail", "-c", example.parsed]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    example.namespace["printed"] = done.stdout
    return None if done.returncode == 0 else f"exit code {done.returncode}\n{done.stdout}{done.stderr}"


def compare(example: Any) -> str | None:
    """Compare a block `text` with what the last commands printed, but for the cheap plans of the other pages.

    `...` stands for anything, white space is all alike, numbers agree to `TOLERANCE`.
    """
    if Path(example.path).stem != "tutorial":
        return None
    expected, printed = example.parsed, example.namespace["printed"]
    parts = [re.escape(part) for part in NUMBER.split(" ".join(expected.split()))]
    pattern = r"([-+]?\d+(?:\.\d+)?)".join(part.replace(r"\.\.\.", ".*?").replace(r"\ ", r"\s+") for part in parts)
    found = re.search(pattern, printed, re.DOTALL)
    if not found:
        return f"was not printed in\n{printed}"
    pairs = zip(map(float, NUMBER.findall(expected)), map(float, found.groups()), strict=True)
    wrong = [f"{theirs:g} is {ours:g}" for theirs, ours in pairs if ours != pytest.approx(theirs, rel=TOLERANCE)]
    return ", ".join(wrong) or None


if find_spec("sybil"):
    from sybil import Sybil
    from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser

    pytest_collect_file = Sybil(
        parsers=[
            SkipParser(),
            PythonCodeBlockParser(),
            CodeBlockParser("bash", run),
            CodeBlockParser("text", compare),
        ],
        pattern="*.md",
        setup=begin,
        teardown=end,
    ).pytest()
