"""The convergence study: which views, what is counted, failures that stay in the table, cases that are not repeated."""

import json
import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from processes import hang
from scenes import SMALL, ellipsoid, hand, observation

from sgnlp import convergence, results
from sgnlp.cli import run
from sgnlp.convergence import Row, case, table, view_sets
from sgnlp.errors import InputError

GOOD = Row("mug", "a b", 0, True, True, 0.1, 1e-8, 60, 1.5, "Solve_Succeeded", -30.0, True, 40, -20.0, -20.0)
FAILED = Row(
    "mug", "a b", 1, False, False, *[math.nan] * 2, 0, math.nan, "", math.nan, False, 0, *[math.nan] * 2, "killed"
)
VIEWS = (["0"], ["1", "2"], ["0", "1", "2"])


def rows(*changes: dict) -> list[Row]:
    return [replace(GOOD, start=i, **change) for i, change in enumerate(changes)]


def cloud(folder: Path, name: str) -> Path:
    """A file of the ellipsoid as seen by three cameras."""
    points = ellipsoid()
    view = np.argmax(points @ [[1, -0.5, -0.5], [0, 0.87, -0.87], [0, 0, 0]], axis=1)
    np.savez(folder / f"{name}.npz", points=points, view=view, table_height=0.0)
    return folder / f"{name}.npz"


@pytest.fixture
def cases(monkeypatch) -> list[tuple[str, tuple[str, ...], int]]:
    """The cases that the command solves, with one made-up row a start."""
    solved = []

    def fake(observation, hand, settings, *, count, **rest):
        solved.append((observation.name, observation.view_names, count))
        views = " ".join(observation.view_names)
        return [replace(GOOD, object=observation.name, view_names=views, start=i) for i in range(count)]

    monkeypatch.setattr("sgnlp.cli.study.case", fake)
    return solved


def study(*arguments: object) -> int:
    return run(["study", "convergence", *map(str, arguments)])


def test_one_camera_two_and_all_as_in_the_paper():
    assert view_sets(["a", "b", "c"]) == [["a"], ["b", "c"], ["a", "b", "c"]]
    assert view_sets(("a", "b")) == [["a"], ["a", "b"]]
    assert view_sets(["a"]) == [["a"]]
    assert view_sets(list("abcd")) == [["a"], ["b", "c", "d"], ["a", "b", "c", "d"]]


def test_a_row_is_lower_only_where_ipopt_is_below_the_first_order_energy():
    assert GOOD.lower
    assert not replace(GOOD, penalty_energy=-20.0).lower
    assert not replace(GOOD, penalty_energy=-19.0).lower
    assert not FAILED.lower


def test_a_first_order_point_off_the_bounds_counts_only_in_its_own_column():
    off = replace(GOOD, first_order_anywhere=-1e3)
    assert off.lower
    assert not off.lower_than_anywhere
    assert replace(GOOD, first_order_energy=float("inf")).lower
    line = table([GOOD, off])[0]
    assert (line["below AdamW"], line["below AdamW off bounds"]) == ("2", "1")


def test_the_table_counts_each_case_and_all_of_them():
    lines = table(
        rows({}, {"solved": False, "feasible": False}, {"feasible": False, "iterations": 90, "seconds": 3.0})
        + rows({"view_names": "c", "penalty_solved": False}, {"view_names": "c", "penalty_energy": 0.0})
    )
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
        "below AdamW": "3",
        "below AdamW off bounds": "3",
    }
    assert [lines[1][key] for key in ("starts", "solved", "penalty solved", "below AdamW")] == list("2211")
    assert [lines[2][key] for key in ("starts", "solved", "feasible", "penalty solved")] == list("5434")


def test_objects_of_the_same_views_are_cases_of_their_own():
    lines = table([GOOD, replace(GOOD, object="can")])
    assert [line["object"] for line in lines] == ["mug", "can", "all"]


def test_a_failed_start_is_counted_among_the_starts_and_in_nothing_else():
    line = table([GOOD, FAILED, FAILED])[0]
    assert line["starts"] == "3"
    assert {line[key] for key in ("solved", "feasible", "penalty solved", "below AdamW")} == {"1"}


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (0, 2, 1)])
def test_the_medians_are_those_of_the_starts_that_gave_a_solution(order):
    several = [GOOD, FAILED, replace(GOOD, start=2, iterations=80, seconds=2.5)]
    line = table([several[i] for i in order])[0]
    assert line["median time [s]"] == "2.00"
    assert float(line["median iterations"]) == 70


def test_a_case_of_nothing_but_failures_still_has_its_line():
    line = table([FAILED, FAILED])[0]
    assert (line["starts"], line["solved"]) == ("2", "0")


def test_a_real_case_has_a_row_for_every_start(monkeypatch):
    monkeypatch.setattr(convergence, "STEPS", 3)
    heard = []
    found = case(observation(), hand(), SMALL, count=2, seed=0, jobs=2, timeout=100, progress=heard.append)
    assert [row.start for row in found] == [0, 1]
    assert len(heard) == 2
    for row in found:
        assert (row.object, row.view_names, row.failure) == ("ellipsoid", "0", "")
        assert row.solved
        assert row.feasible
        assert row.penalty_solved
        assert row.lower  # three steps of AdamW lead nowhere
        assert min(row.iterations, row.penalty_iterations) > 5
        assert row.seconds > 0


def test_a_start_that_overruns_its_limit_is_a_row_with_the_reason(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(convergence, "compare", hang)
    found = case(observation(), hand(), SMALL, count=2, seed=0, jobs=2, timeout=0.1)
    assert [(row.start, row.failure) for row in found] == [(0, "stopped after 0.1 s"), (1, "stopped after 0.1 s")]
    assert {(row.object, row.view_names, row.solved, row.feasible) for row in found} == {
        ("ellipsoid", "0", False, False)
    }
    assert all(math.isnan(row.worst_margin) for row in found)


def test_rows_of_failures_survive_the_file(tmp_path):
    results.write_rows(tmp_path / "rows.csv", [GOOD, FAILED])
    assert repr(results.read_rows(tmp_path / "rows.csv", Row)) == repr([GOOD, FAILED])


def test_the_study_runs_every_object_from_one_two_and_three_cameras(tmp_path, cases, capfd):
    files = [cloud(tmp_path, "one"), cloud(tmp_path, "two")]
    assert study(*files, "--starts", 2, "--out", tmp_path / "study") == 0
    assert [(name, list(views)) for name, views, _ in cases] == [(n, v) for n in ("one", "two") for v in VIEWS]
    written = results.read_rows(tmp_path / "study" / "rows.csv", Row)
    assert len(written) == 2 * 3 * 2
    markdown = (tmp_path / "study" / "table.md").read_text().splitlines()
    assert len(markdown) == 2 + 6 + 1
    assert markdown[-1].startswith("| all |  | 12 | 12 | 12 |")
    assert json.loads((tmp_path / "study" / "made.json").read_text())["study"]["seed"] == 0
    assert "[s]" in capfd.readouterr().out


def test_a_study_goes_on_where_it_ended(tmp_path, cases):
    one, two, out = cloud(tmp_path, "one"), cloud(tmp_path, "two"), tmp_path / "study"
    assert study(one, "--out", out) == 0
    assert len(cases) == 3
    assert study(one, "--out", out) == 0
    assert len(cases) == 3
    assert study(one, two, "--out", out) == 0
    assert [name for name, _, _ in cases] == ["one"] * 3 + ["two"] * 3
    kept = [row for row in results.read_rows(out / "rows.csv", Row) if row.view_names != "1 2"]
    results.write_rows(out / "rows.csv", kept)
    assert study(one, two, "--out", out) == 0
    assert [(name, list(views)) for name, views, _ in cases[6:]] == [("one", ["1", "2"]), ("two", ["1", "2"])]
    assert len(results.read_rows(out / "rows.csv", Row)) == 6 * 7


def test_a_study_that_is_done_is_written_as_parquet_without_being_done_again(tmp_path, cases):
    parquet = pytest.importorskip("pyarrow.parquet")
    one, out = cloud(tmp_path, "one"), tmp_path / "study"
    for flags in ((), ("--parquet",)):
        assert study(one, "--out", out, *flags) == 0
        assert (out / "rows.parquet").exists() == bool(flags)
    assert len(cases) == 3
    found = parquet.read_table(out / "rows.parquet").to_pylist()
    assert repr([Row(**line) for line in found]) == repr(results.read_rows(out / "rows.csv", Row))


def test_rows_of_other_settings_or_of_a_changed_cloud_are_never_mixed(tmp_path, cases, capfd):
    one, out = cloud(tmp_path, "one"), tmp_path / "study"
    assert study(one, "--out", out) == 0
    before = (out / "rows.csv").read_bytes()
    for flags in (("--seed", 1), ("--starts", 3), ("--preset", "paper"), ("--weights.reg", 20)):
        assert study(one, "--out", out, *flags) == 3
        assert "holds rows of other settings or clouds" in capfd.readouterr().err
    assert (out / "rows.csv").read_bytes() == before


def test_what_was_solved_before_an_interrupt_is_kept(tmp_path, monkeypatch, cases, capfd):
    from sgnlp.cli import study as module

    fake = module.case

    def second_is_interrupted(observation, *rest, **options):
        if len(cases) == 1:
            raise KeyboardInterrupt
        return fake(observation, *rest, **options)

    monkeypatch.setattr(module, "case", second_is_interrupted)
    file, out = cloud(tmp_path, "one"), tmp_path / "study"
    assert study(file, "--out", out) == 130
    assert capfd.readouterr() == ("", "interrupted\n")
    assert sorted(path.name for path in out.iterdir()) == ["made.json", "rows.csv"]
    assert len(results.read_rows(out / "rows.csv", Row)) == 7
    monkeypatch.setattr(module, "case", fake)
    assert study(file, "--out", out) == 0
    assert [list(views) for _, views, _ in cases] == list(VIEWS)


def test_bad_input_of_a_study_is_told_before_any_work(tmp_path, cases, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    good = cloud(tmp_path, "one")
    calls = {
        "there is no such file": (good, "none.npz"),
        "unknown hand": (good, "--hand", "nope"),
        "cannot be written": (good, "--out", good),
    }
    for message, arguments in calls.items():
        assert study(*arguments) == 3
        out, err = capfd.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert message in err
    assert not cases
    assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]


def test_rows_of_another_study_are_refused(tmp_path, cases, capfd):
    out = tmp_path / "study"
    out.mkdir()
    (out / "rows.csv").write_text("object,other\nmug,1\n")
    assert study(cloud(tmp_path, "one"), "--out", out) == 3
    assert "does not hold rows of this study" in capfd.readouterr().err
    with pytest.raises(InputError):
        results.read_rows(out / "rows.csv", Row)


def test_every_field_of_a_row_is_of_a_type_that_the_file_can_hold():
    assert {field.type for field in fields(Row)} <= {str, int, float, bool}
