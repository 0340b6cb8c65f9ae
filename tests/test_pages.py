"""The code in the pages of the documentation runs, and the tutorial's commands print what it says they print."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout, suppress
from importlib.util import find_spec
from io import BytesIO, StringIO, TextIOWrapper
from itertools import groupby
from pathlib import Path
from runpy import run_path
from typing import Any
from unittest import SkipTest

import pytest
from readers import CHEAP, pieces_are_coarse, plans_are_cheap, simulations_are_brief

from sgnlp import cli

sybil = pytest.importorskip("sybil", reason="finds the code in the pages")
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser  # noqa: E402

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "pages"
SHARED = ("docs", "problems", "urdf")
"""What a reader in the project's folder has, beside the files that a page makes."""
WHOLE = ("tutorial", "code")
"""The pages whose numbers are compared: their plans are not made cheap."""
TOLERANCE = 0.05
"""Of numbers in what the tutorial shows: machines with and without a compiler differ in the last digits."""
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?![\w.]*\d)")


@pytest.fixture
def namespace(page, tmp_path, monkeypatch) -> dict[str, Any]:
    """A folder with the project's own in it is the current one, with `sgnlp` on the path."""
    monkeypatch.chdir(tmp_path)
    for name in SHARED:
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "bin").mkdir()
    if compiler := shutil.which("c++"):
        (tmp_path / "bin" / "c++").write_text(f'#!/bin/sh\nexec {compiler} "$@" -O0\n', encoding="utf-8")
        (tmp_path / "bin" / "c++").chmod(0o755)  # it does not optimise, which takes half of its time
    folders = (str(tmp_path / "bin"), str(Path(sys.executable).parent), os.environ["PATH"])
    monkeypatch.setenv("PATH", os.pathsep.join(folders))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("COLUMNS", "100")
    pieces_are_coarse(monkeypatch)
    simulations_are_brief(monkeypatch)
    if page.stem not in WHOLE:
        plans_are_cheap(monkeypatch)
    missing = {"missing": lambda *modules: not all(find_spec(name) for name in modules), "which": shutil.which}
    return {"printed": "", "whole": page.stem in WHOLE, **missing}


def run(example: Any) -> str | None:
    """Run a block of commands; the first that fails is the failure of the block."""
    example.namespace["printed"] = ""
    for kind, lines in groupby(example.parsed.splitlines(), _kind):
        for command in lines if kind else ["\n".join(lines)]:
            if kind == "sgnlp":
                code, out, err = _sgnlp(command, example.namespace["whole"])
            else:
                code, out, err = _script(command) if kind else _shell(command)
            example.namespace["printed"] += out
            if code:
                return f"{command}: exit code {code}\n{out}{err}"
    return None


def _kind(line: str) -> str:
    """What runs a line in this process, which has loaded all that it needs; "" if the shell does."""
    return next((kind for kind in ("sgnlp", "python docs/") if line.startswith(kind)), "")


def _script(command: str) -> tuple[int, str, str]:
    """Exit code and output of `python FILE …`, run in this process."""
    words = shlex.split(command)[1:]
    out, err = StringIO(), StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", words)
        patch.setattr(sys, "path", [str(Path(words[0]).parent), *sys.path[1:]])
        run_path(words[0], run_name="__main__")
    return 0, out.getvalue(), err.getvalue()


def _sgnlp(command: str, whole: bool) -> tuple[int, str, str]:
    """Exit code and output of `sgnlp`, run in this process: so the functions of a hand are built once for all pages."""
    words = shlex.split(command)[1:]
    words, target = (words[:-2], words[-1]) if ">" in words else (words, None)
    assert not set("|;&<>*?$`") & set("".join(words)), "needs a shell"
    more = []
    if words[0] in ("solve", "batch") and not whole:
        more = CHEAP
    out, err = (TextIOWrapper(BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with redirect_stdout(out), redirect_stderr(err):
        code = cli.run([*words, *more])
    printed, said = (stream.buffer.getvalue().decode() for stream in (out, err))  # type: ignore[attr-defined]
    if target:
        Path(target).write_text(printed, encoding="utf-8")
    return code, "" if target else printed, said


def _shell(commands: str) -> tuple[int, str, str]:
    """Exit code and output of lines that are no commands of ours."""
    command = ["bash", "-euo", "pipefail", "-c", commands]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=900)
    return done.returncode, done.stdout, done.stderr


def compare(example: Any) -> str | None:
    """Compare a block `text` of the tutorial with what the last commands printed.

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
    return f"{', '.join(wrong)} in\n{printed}" if wrong else None


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
