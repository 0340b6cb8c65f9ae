"""Arguments give the same command whether the sections that they do not name are parsed or left out."""

import subprocess
import sys
from itertools import pairwise

import pytest
import tyro

from sgnlp import cli
from sgnlp.base.presets import PRESETS
from sgnlp.cli import parsing

CASES = [
    ("solve", "cloud.npz"),
    ("solve", "contact.npz", "--preset", "paper", "--starts", "3"),
    ("solve", "cloud.npz", "--limits.force-max", "5", "--contact.no-pad", "--solver", "slsqp"),
    ("solve", "cloud.npz", "--free_space.far-from=0.04", "--spheres", "paper", "--table-height", "0"),
    ("batch", "a.npz", "b.npz", "--out", "limits", "--closing.planned", "--jobs", "1"),
    ("cache", "--build", "--solver.formulation", "penalty", "--hand", "leap_left"),
    ("simulate", "results/can"),
    ("hands",),
]


@pytest.mark.parametrize("arguments", CASES, ids=" ".join)
def test_what_is_left_out_is_as_the_preset_has_it(arguments, monkeypatch):
    kept = []
    parse = tyro.cli
    monkeypatch.setattr(tyro, "cli", lambda *given, **flags: kept.append(flags) or parse(*given, **flags))
    found = cli._parsed(list(arguments))
    assert len(kept) == 1, "refused without the sections"
    monkeypatch.setattr(parsing, "HELPFUL", ("",))  # every argument then asks for all flags
    assert found == cli._parsed(list(arguments))


@pytest.mark.parametrize("preset", PRESETS)
def test_so_it_is_for_every_preset(preset, monkeypatch):
    arguments = ["solve", "cloud.npz", "--preset", preset, "--weights.sp", "3"]
    found = cli._parsed(arguments)
    monkeypatch.setattr(parsing, "HELPFUL", ("",))  # every argument then asks for all flags
    assert found == cli._parsed(arguments)


def test_a_refusal_is_told_once_and_knows_the_flags_that_were_left_out(capfd):
    with pytest.raises(SystemExit):
        cli._parsed(["solve", "cloud.npz", "--limts.force-max", "3"])
    said = capfd.readouterr().err
    assert said.count("─ Unrecognized options") == 1
    assert "--limits.force-max" in said
    with pytest.raises(SystemExit):
        cli._parsed(["solve", "cloud.npz", "--limits.force-max", "x"])
    assert capfd.readouterr().err.count("Error parsing --limits.force-max") == 1


@pytest.mark.parametrize("command", ["solve", "simulate", "cloud"])
def test_the_text_of_a_flag_is_one_paragraph_wherever_its_lines_end_in_the_source(command):
    """In the help a line of a text ends early only where the next word does not fit."""
    asked = [sys.executable, "-m", "sgnlp", command, "--help"]  # in a process of its own: Tyro keeps what it has read
    told = subprocess.run(asked, capture_output=True, encoding="utf-8", check=True).stdout
    lines = [line.strip("│").rstrip() for line in told.splitlines() if line.startswith("│")]
    width = max(map(len, lines))
    pairs = [(a, b) for a, b in pairwise(lines) if a[:7].isspace() and b[:7].isspace() and "(default" not in a]
    assert len(pairs) > 10
    early = [(a, b) for a, b in pairs if b.strip() and len(a) + 1 + len(b.split()[0]) < width]
    assert not early
