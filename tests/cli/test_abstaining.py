"""`--min-confidence`: a command abstains, says so, and still writes the result."""

import json
from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest
from here import Here
from plans import SMALL_FLAGS, small_plan
from scenes import ellipsoid

from sgnlp import load_grasps
from sgnlp.cli import codes, run
from sgnlp.planning.plan import Plan

CLOUD = "ellipsoid.npz"


@pytest.fixture(autouse=True)
def told(tmp_path, monkeypatch) -> dict[str, float]:
    """The confidence that plans get; nothing is solved."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    np.savez(CLOUD, points=ellipsoid(), table_height=0.0)
    given = {"confidence": nan}

    def fake(observation, *_, **__) -> Plan:
        plan = small_plan()
        solutions = tuple(replace(s, confidence=given["confidence"]) for s in plan.solutions)
        return replace(plan, observation=observation, solutions=solutions)

    monkeypatch.setattr("sgnlp.cli.solve.solve", fake)
    monkeypatch.setattr("sgnlp.planning.batch.solve", fake)
    return given


def solve(*flags: object) -> int:
    return run(["solve", CLOUD, "--starts", "2", *SMALL_FLAGS, *map(str, flags)])


def batch(*flags: object) -> int:
    return run(["batch", CLOUD, "--starts", "2", "--jobs", "1", *SMALL_FLAGS, *map(str, flags)])


@pytest.mark.parametrize(
    ("confidence", "least", "code", "said"),
    [
        (0.7, 0.8, codes.NONE_FEASIBLE, "its confidence 0.7 is below 0.8"),
        (nan, 0.8, codes.NONE_FEASIBLE, "its confidence is unknown"),
        (0.8, 0.8, codes.FEASIBLE, ""),
        (0.7, 0, codes.FEASIBLE, ""),
        (nan, 0, codes.FEASIBLE, ""),
    ],
)
def test_solve_abstains_below_the_least_confidence_and_says_why(told, capfd, confidence, least, code, said):
    told["confidence"] = confidence
    assert solve("--min-confidence", least) == code
    out = " ".join(capfd.readouterr().out.split())
    assert ("abstained:" in out) == bool(said)
    assert said in out
    assert np.allclose(load_grasps("results/ellipsoid").confidence, confidence, equal_nan=True)


def test_the_line_of_the_confidence_is_printed_and_the_summary_has_the_number(told, capfd):
    told["confidence"] = 0.93
    assert solve() == codes.FEASIBLE
    assert "confidence 0.93: of 100 such grasps, about 93 held in simulation" in capfd.readouterr().out
    summary = json.loads(Path("results/ellipsoid/summary.json").read_text(encoding="utf-8"))
    assert summary["best"]["confidence"] == 0.93
    assert [start["confidence"] for start in summary["starts_table"]] == [0.93, 0.93]


def test_an_unknown_confidence_is_told_as_such_and_is_null_in_the_summary(capfd):
    assert solve() == codes.FEASIBLE
    assert "confidence unknown" in capfd.readouterr().out
    assert json.loads(Path("results/ellipsoid/summary.json").read_text(encoding="utf-8"))["best"]["confidence"] is None


@pytest.mark.parametrize("least", ["-0.1", "1.1", "nan"])
def test_a_confidence_that_is_no_probability_is_refused(capfd, least):
    assert solve("--min-confidence", least) == codes.BAD_INPUT
    assert "--min-confidence must be" in capfd.readouterr().err
    assert not Path("results").exists()


@pytest.mark.parametrize(("least", "code"), [(0.8, codes.NONE_FEASIBLE), (0.6, codes.FEASIBLE)])
def test_a_batch_names_the_objects_that_it_abstains_from(told, monkeypatch, capfd, least, code):
    monkeypatch.setattr("sgnlp.cli.batch.Workers", lambda jobs, scheduler: Here())
    told["confidence"] = 0.7
    assert batch("--min-confidence", least) == code
    out = " ".join(capfd.readouterr().out.split())
    assert "1 of 1 objects have a feasible grasp" in out
    assert ("abstained" in out) == (code != codes.FEASIBLE)
    assert out.endswith("rows.csv, results/batch/made.json")
    assert "0.70" in out
