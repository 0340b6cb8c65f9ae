"""The convergence study: what is counted, and failures that stay in the table."""

import math
from dataclasses import replace

import pytest
from processes import hang
from scenes import SMALL, hand, observation

from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import convergence
from sgnlp.experiments.studies.convergence import Row, case, judged, panels, table
from sgnlp.planning import results

GOOD = Row("mug", "a b", 0, True, True, 0.1, 1e-8, 60, 1.5, "Solve_Succeeded", -30.0, True, 40, -20.0, -20.0)
FAILED = Row(
    "mug", "a b", 1, False, False, *[math.nan] * 2, 0, math.nan, "", math.nan, False, 0, *[math.nan] * 2, "killed"
)


def rows(*changes: dict) -> list[Row]:
    return [replace(GOOD, start=i, **change) for i, change in enumerate(changes)]


def test_a_row_is_lower_only_where_ipopt_is_below_the_first_order_energy():
    ends = [GOOD, replace(GOOD, penalty_energy=-20.0), replace(GOOD, penalty_energy=-19.0), FAILED]
    assert list(judged(frame(ends)).below) == [True, False, False, False]


def test_a_first_order_point_off_the_bounds_counts_only_in_its_own_column():
    off = replace(GOOD, first_order_anywhere=-1e3)
    never = replace(GOOD, first_order_energy=float("inf"))  # nothing to be compared with
    found = judged(frame([off, never]))
    assert list(zip(found.below, found.below_anywhere, strict=True)) == [(True, False), (False, True)]
    line = table(frame([GOOD, off]))[0]
    assert (line["below AdamW there"], line["below AdamW anywhere"]) == ("2", "1")


def test_the_table_counts_each_case_and_all_of_them():
    found = rows({}, {"solved": False, "feasible": False}, {"feasible": False, "iterations": 90, "seconds": 3.0})
    found += rows({"view_names": "c", "penalty_solved": False}, {"view_names": "c", "penalty_energy": 0.0})
    lines = table(frame(found))
    assert [(line["object"], line["views"]) for line in lines] == [("mug", "a b"), ("mug", "c"), ("all", "")]
    assert lines[0] == {
        "object": "mug",
        "views": "a b",
        "starts": "3",
        "solved": "2",
        "feasible": "1",
        "median iterations": "60",
        "median time [s]": "1.50",
        "penalty solved": "3",
        "AdamW meets the rows": "3",
        "below AdamW there": "3",
        "below AdamW anywhere": "3",
    }
    assert [lines[1][key] for key in ("starts", "solved", "penalty solved", "below AdamW there")] == list("2211")
    assert [lines[2][key] for key in ("starts", "solved", "feasible", "penalty solved")] == list("5434")


def test_objects_of_the_same_views_are_cases_of_their_own():
    lines = table(frame([GOOD, replace(GOOD, object="can")]))
    assert [line["object"] for line in lines] == ["mug", "can", "all"]


def test_a_failed_start_is_counted_among_the_starts_and_in_nothing_else():
    line = table(frame([GOOD, FAILED, FAILED]))[0]
    assert line["starts"] == "3"
    assert {line[key] for key in ("solved", "feasible", "penalty solved", "below AdamW there")} == {"1"}


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (0, 2, 1)])
def test_the_medians_are_those_of_the_starts_that_gave_a_solution(order):
    several = [GOOD, FAILED, replace(GOOD, start=2, iterations=80, seconds=2.5)]
    line = table(frame([several[i] for i in order]))[0]
    assert line["median time [s]"] == "2.00"
    assert float(line["median iterations"]) == 70


def test_a_case_of_nothing_but_failures_still_has_its_line():
    line = table(frame([FAILED, FAILED]))[0]
    assert (line["starts"], line["solved"]) == ("2", "0")


def test_a_real_case_has_a_row_for_every_start(monkeypatch):
    monkeypatch.setattr(convergence, "STEPS", 3)
    found = case(observation(), hand(), SMALL, count=2, seed=0, timeout=100)
    assert [row.start for row in found] == [0, 1]
    for row in found:
        assert (row.object, row.view_names, row.failure) == ("ellipsoid", "0", "")
        assert row.solved
        assert row.feasible
        assert row.penalty_solved
        assert row.penalty_energy < row.first_order_energy  # three steps of AdamW lead nowhere
        assert min(row.iterations, row.penalty_iterations) > 5
        assert row.seconds > 0


def test_a_start_that_overruns_its_limit_is_a_row_with_the_reason(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(convergence, "compare", hang)
    found = case(observation(), hand(), SMALL, count=2, seed=0, timeout=0.1)
    assert [(row.start, row.failure) for row in found] == [(0, "stopped after 0.1 s"), (1, "stopped after 0.1 s")]
    assert {(row.object, row.view_names, row.solved, row.feasible) for row in found} == {
        ("ellipsoid", "0", False, False)
    }
    assert all(math.isnan(row.worst_margin) for row in found)


def test_rows_of_failures_survive_the_file(tmp_path):
    results.write_rows(tmp_path / "rows.csv", [GOOD, FAILED])
    assert repr(results.read_rows(tmp_path / "rows.csv", Row)) == repr([GOOD, FAILED])


def test_the_figure_shows_the_shares_by_number_of_cameras():
    (panel,) = panels(frame(rows({}, {"feasible": False}) + rows({"view_names": "c"}, {"view_names": "c"})))
    assert panel.bars
    assert list(panel.series[0].x) == [1, 2]
    assert list(panel.series[0].y) == [100.0, 50.0]
