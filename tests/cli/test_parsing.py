"""Arguments give the same command whether the sections that they do not name are parsed or left out."""

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
