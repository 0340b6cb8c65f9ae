"""The anatomy of a study: which cases run, rows that are kept, failures, what is written, and the registry."""

import json
import sys
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scenes import ellipsoid

from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST
from sgnlp.cli import run
from sgnlp.experiments.studies import STUDIES
from sgnlp.experiments.studies.study import Setup, Study, over_views, view_sets
from sgnlp.planning import environment, results
from sgnlp.show import plots
from sgnlp.show.plots import Panel, Series, draw

VIEWS = (["0"], ["1", "2"], ["0", "1", "2"])
WORKED: list[tuple[str, str]] = []


@dataclass(frozen=True)
class Row:
    object: str
    views: str
    value: float


def work(setup: Setup, file: Path, views: list[str]) -> list[Row]:
    """Two rows for each case, unless the file says that it fails."""
    WORKED.append((file.stem, " ".join(views)))
    if file.stem == "bad":
        raise InputError("nothing to see")
    return [Row(file.stem, " ".join(views), setup.seed + value) for value in (0.5, 1.5)]


TOY = Study(
    question="how many rows are there?",
    row=Row,
    cases=partial(over_views, work),
    tables=lambda rows: {"Rows [1]": [{"rows": str(len(rows)), "sum [m]": f"{rows.value.sum():g}"}]},
    panels=lambda rows: [Panel("values", "row", "value", (Series("all", [0, 1], [0.0, 1.0]),))],
    caption="All values.",
)


def cloud(folder: Path, name: str, **more: object) -> Path:
    """A file of the ellipsoid as seen by three cameras."""
    points = ellipsoid()
    view = np.argmax(points @ [[1, -0.5, -0.5], [0, 0.87, -0.87], [0, 0, 0]], axis=1)
    np.savez(folder / f"{name}.npz", points=points, view=view, table_height=0.0, **more)
    return folder / f"{name}.npz"


@pytest.fixture
def toy(monkeypatch) -> str:
    """A study that runs in this process and draws nothing; its cases are in WORKED."""

    def inline(function, items, workers):
        for item in items:
            try:
                yield item, function(item)
            except InputError as error:
                yield item, str(error)

    WORKED.clear()
    monkeypatch.setattr(plots, "draw", lambda panels, caption: {"svg": caption.encode(), "png": b"drawn"})
    monkeypatch.setattr("sgnlp.experiments.studies.study.each", inline)
    monkeypatch.setitem(STUDIES, "convergence", TOY)
    return "convergence"


def study(name: str, *arguments: object) -> int:
    return run(["study", name, *map(str, arguments)])


def test_one_camera_two_and_all_as_in_the_paper():
    assert view_sets(["a", "b", "c"]) == [["a"], ["b", "c"], ["a", "b", "c"]]
    assert view_sets(("a", "b")) == [["a"], ["a", "b"]]
    assert view_sets(["a"]) == [["a"]]
    assert view_sets(list("abcd")) == [["a"], ["b", "c", "d"], ["a", "b", "c", "d"]]


def test_every_object_is_worked_on_from_one_two_and_three_cameras(tmp_path, toy, capfd):
    files, out = [cloud(tmp_path, "one"), cloud(tmp_path, "two")], tmp_path / "study"
    assert study(toy, *files, "--seed", 3, "--out", out) == 0
    assert [(name, " ".join(views)) for name in ("one", "two") for views in VIEWS] == WORKED
    assert sorted(file.name for file in out.iterdir()) == [
        *("figure.png", "figure.svg", "made.json", "rows.csv", "table.md", "table.txt")
    ]
    assert len(results.read_rows(out / "rows.csv", Row)) == 2 * 3 * 2
    table, figure = (out / "table.md").read_text(encoding="utf-8").split("\n\n## Figure\n\n")
    assert table.splitlines()[2:] == ["| rows | sum [m] |", "| --- | --- |", "| 12 | 48 |"]
    assert figure == "![how many rows are there?](figure.svg)\n\nAll values.\n"
    assert (out / "table.txt").read_text(encoding="utf-8").split("\n")[:2] == ["Rows [1]", "rows  sum [m]"]
    made = json.loads((out / "made.json").read_text(encoding="utf-8"))
    assert made["study"]["seed"] == 3
    assert list(made["inputs"]) == ["one", "two"]
    assert made["versions"]["numpy"] == np.__version__
    assert "[m]" in capfd.readouterr().out


def test_a_study_goes_on_where_it_ended(tmp_path, toy):
    one, two, out = cloud(tmp_path, "one"), cloud(tmp_path, "two"), tmp_path / "study"
    assert study(toy, two, "--out", out) == 0
    assert study(toy, two, "--out", out) == 0
    assert len(WORKED) == 3
    assert study(toy, one, two, "--out", out) == 0
    assert [name for name, _ in WORKED] == ["two"] * 3 + ["one"] * 3
    rows = results.read_rows(out / "rows.csv", Row)
    results.write_rows(out / "rows.csv", [row for row in rows if row.views != "1 2"])
    assert study(toy, one, two, "--out", out) == 0
    assert WORKED[6:] == [("one", "1 2"), ("two", "1 2")]
    assert results.read_rows(out / "rows.csv", Row) == rows  # in the order of the cases, not of the work


def test_a_study_that_goes_on_at_another_commit_names_the_commits_of_all_its_rows(tmp_path, toy, monkeypatch):
    out, found = tmp_path / "study", []
    for i, commit in enumerate(["a", "b", "b", "c"]):
        monkeypatch.setattr(environment, "commit", lambda commit=commit: commit)
        assert study(toy, *[cloud(tmp_path, f"cloud{k}") for k in range(i + 1)], "--out", out) == 0
        made = json.loads((out / "made.json").read_text(encoding="utf-8"))
        found.append((made["commit"], made.get("earlier_commits")))
    assert found == [("a", None), ("b", ["a"]), ("b", ["a"]), ("c", ["a", "b"])]


def test_one_half_of_a_problem_set_can_be_chosen(tmp_path, toy, capfd):
    files = [cloud(tmp_path, half, half=half) for half in ("tuning", "held_out")] + [cloud(tmp_path, "neither")]
    assert study(toy, *files, "--half", "held_out", "--out", tmp_path / "study") == 0
    assert {name for name, _ in WORKED} == {"held_out"}
    assert study(toy, files[-1], "--half", "tuning", "--out", tmp_path / "none") == 3
    assert "none of the clouds is of the half 'tuning'" in capfd.readouterr().err


def test_tables_and_figure_are_made_anew_without_touching_the_rows(tmp_path, toy, capfd):
    out = tmp_path / "study"
    assert study(toy, cloud(tmp_path, "one"), "--out", out) == 0
    kept = {name: (out / name).read_bytes() for name in ("rows.csv", "made.json")}
    for name in ("figure.svg", "table.md"):
        (out / name).write_text("old", encoding="utf-8")
    assert study(toy, "--redraw", "--out", out, "--seed", 9) == 0
    assert (out / "figure.svg").read_bytes() == b"All values."
    assert (out / "table.md").read_text(encoding="utf-8").startswith("## Rows")
    assert {name: (out / name).read_bytes() for name in kept} == kept
    assert len(WORKED) == 3
    assert study(toy, "--redraw", "--out", tmp_path / "nothing") == 3
    assert "there are no rows to draw" in capfd.readouterr().err


def test_a_case_that_fails_is_named_and_tried_again(tmp_path, toy, capfd):
    out = tmp_path / "study"
    for _ in range(2):
        assert study(toy, cloud(tmp_path, "bad"), cloud(tmp_path, "good"), "--out", out) == 1
        assert "failed: bad 0: nothing to see" in capfd.readouterr().out
    assert len(WORKED) == 3 + 3 + 3
    assert {row.object for row in results.read_rows(out / "rows.csv", Row)} == {"good"}


def test_a_study_of_nothing_but_failures_writes_no_table(tmp_path, toy):
    out = tmp_path / "study"
    assert study(toy, cloud(tmp_path, "bad"), "--out", out) == 1
    assert [file.name for file in out.iterdir()] == ["made.json"]


def test_rows_of_other_settings_or_of_a_changed_cloud_are_never_mixed(tmp_path, toy, capfd):
    one, out = cloud(tmp_path, "one"), tmp_path / "study"
    assert study(toy, one, "--out", out) == 0
    before = (out / "rows.csv").read_bytes()
    for flags in (("--seed", 1), ("--starts", 3), ("--preset", "paper"), ("--weights.reg", 20)):
        assert study(toy, one, "--out", out, *flags) == 3
        assert "holds rows of other settings or clouds" in capfd.readouterr().err
    assert (out / "rows.csv").read_bytes() == before


def test_what_was_worked_out_before_an_interrupt_is_kept(tmp_path, toy, monkeypatch, capfd):
    def third_is_interrupted(setup, file, views):
        if len(WORKED) == 2:
            raise KeyboardInterrupt
        return work(setup, file, views)

    file, out = cloud(tmp_path, "one"), tmp_path / "study"
    monkeypatch.setitem(STUDIES, toy, replace(TOY, cases=partial(over_views, third_is_interrupted)))
    assert study(toy, file, "--out", out) == 130
    assert capfd.readouterr() == ("", "interrupted\n")
    assert sorted(path.name for path in out.iterdir()) == ["made.json", "rows.csv"]
    monkeypatch.setitem(STUDIES, toy, TOY)
    assert study(toy, file, "--out", out) == 0
    assert [views for _, views in WORKED] == ["0", "1 2", "0 1 2"]


def test_bad_input_of_a_study_is_told_before_any_work(tmp_path, toy, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    good = cloud(tmp_path, "one")
    calls = {
        "there is no such file": (good, "none.npz"),
        "two of the clouds are called 'one'": (good, good),
        "unknown hand": (good, "--hand", "nope"),
        "--starts must be positive": (good, "--starts", 0),
        "--seed must be at least 0": (good, "--seed", -1),
        "--jobs must be positive": (good, "--jobs", 0),
        "--timeout must be a finite number": (good, "--timeout", "nan"),
        "cannot be written": (good, "--out", good),
        "needs clouds": (),
        "no trials to take pictures of": (good, "--pictures"),
    }
    for message, arguments in calls.items():
        assert study(toy, *arguments) == 3
        out, err = capfd.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert message in err
    assert study("triangles", good) == 3
    assert "takes no files" in capfd.readouterr().err
    assert not WORKED
    assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]


def test_rows_of_another_study_are_refused(tmp_path, toy, capfd):
    out = tmp_path / "study"
    out.mkdir()
    (out / "rows.csv").write_text("object,other\nmug,1\n", encoding="utf-8")
    assert study(toy, cloud(tmp_path, "one"), "--out", out) == 3
    assert "does not hold rows of this study" in capfd.readouterr().err


@pytest.mark.parametrize("command", [("study", "convergence", "one.npz"), ("compare", "one.npz")])
def test_without_pandas_a_study_is_refused_before_any_work_and_the_extra_is_named(
    command, tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "pandas", None)
    cloud(tmp_path, "one")
    assert run([*command, "--out", "out"]) == 3
    assert capfd.readouterr().err == ("error: studies and comparisons need pandas: pip install 'sgnlp[experiments]'\n")
    assert not (tmp_path / "out").exists()


def test_without_matplotlib_a_study_says_that_there_is_no_figure(tmp_path, toy, monkeypatch, capfd):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setattr(plots, "draw", draw)
    assert study(toy, cloud(tmp_path, "one"), "--out", tmp_path / "study") == 0
    assert "no figure: figures need Matplotlib: pip install 'sgnlp[plots]'" in capfd.readouterr().out
    with pytest.raises(InputError):
        draw(TOY.panels([]))


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_has_a_question_rows_that_a_file_can_hold_and_facts(name):
    found = STUDIES[name]
    assert found.question.endswith("?")
    assert {field.type for field in fields(found.row)} <= {str, int, float, bool}
    assert found.facts(Setup((), "allegro_left", ROBUST, 7, 5, 1.0))["seed"] == 5


def test_the_help_lists_every_study(capfd):
    assert run(["study", "--help"]) == 0
    out = capfd.readouterr().out
    assert all(f"{name}: " in out for name in STUDIES)


def test_cases_run_in_processes_of_their_own(tmp_path):
    file, out = Path(__file__).parents[2] / "problems" / "orange_0.npz", tmp_path / "study"
    small = ("--gpis.surface-points", 40, "--gpis.interior-points", 10, "--contact.samples", 2, "--spheres", "paper")
    assert study("calibration", file, "--jobs", 2, "--out", out, *small) == 0
    rows = results.read_rows(out / "rows.csv", STUDIES["calibration"].row)
    assert list(dict.fromkeys(row.views for row in rows)) == [" ".join(views) for views in VIEWS]
    assert (out / "figure.png").read_bytes().startswith(b"\x89PNG")
