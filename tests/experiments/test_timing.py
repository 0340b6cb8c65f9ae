"""The study of time: plans one at a time, medians over repeats and objects, the paper's times beside them."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

from sgnlp import cli
from sgnlp.base.presets import ROBUST
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import STUDIES, timing
from sgnlp.experiments.studies.study import Setup
from sgnlp.experiments.studies.timing import PAPER, Row
from sgnlp.perception.observation import load

CAN = Path(__file__).parents[2] / "problems" / "can_1.npz"
SETUP = Setup((CAN,), "allegro_left", ROBUST, 7, 0, 60.0)


def rows(name: str, *seconds: float, condition: str = "ours", starts: int = 7) -> list[Row]:
    """A plan for each time, of which the fit takes a tenth."""
    return [Row(name, condition, starts, i, 0.1 * s, 0.9 * s, starts - 1) for i, s in enumerate(seconds)]


def test_every_object_is_planned_for_with_one_start_and_with_all_by_both():
    cases = timing.cases(SETUP, [load(CAN)])
    assert [case.key for case in cases] == [
        ("can_1", condition, count) for condition in ("ours", "bilevel") for count in ("1", "7")
    ]
    assert len(timing.cases(replace(SETUP, starts=1), [load(CAN)])) == 2


def test_the_first_plan_which_builds_the_functions_is_not_timed(monkeypatch):
    asked = []

    def planned(setup, file, condition, views, rounds):
        asked.append(setup.starts)
        solutions = [SimpleNamespace(feasible=start > 0) for start in range(setup.starts)]
        seconds = {"fit": 0.5, "solve": float(len(asked))}
        return SimpleNamespace(observation=load(file, views=views), solutions=solutions, seconds=seconds)

    monkeypatch.setattr(timing, "planned", planned)
    found = timing.repeated(SETUP, CAN, timing.CONDITIONS[0])
    assert asked == [1, 7, 7, 7]
    assert [(row.object, row.starts, row.repeat, row.feasible) for row in found] == [
        ("can_1", 7, i, 6) for i in range(3)
    ]
    assert [(row.fit, row.solve) for row in found] == [(0.5, 2.0), (0.5, 3.0), (0.5, 4.0)]


def test_an_object_counts_by_the_median_of_its_repeats():
    (line,) = timing.table(frame([*rows("a", 1, 2, 9), *rows("b", 4, 3, 4), *rows("c", 6, 6, 0)]))
    assert line["condition"] == "ours (7)"
    assert (line["objects"], line["median [s]"], line["range [s]"]) == ("3", "4.00", "2.00-6.00")
    assert line["quartiles [s]"] == "3.00-5.00"
    assert (line["fit [s]"], line["solve [s]"]) == ("0.40", "3.60")
    assert line["feasible"] == "54 of 63"
    assert line["paper [s]"] == "15.58"


def test_the_papers_times_stand_beside_the_same_number_of_starts_only():
    found = [row for name, count in [*PAPER, ("ours", 3)] for row in rows("a", 1.0, condition=name, starts=count)]
    lines = {line["condition"]: line["paper [s]"] for line in timing.table(frame(found))}
    assert lines == {
        "ours (7)": "15.58",
        "bilevel (7)": "34.97",
        "ours (3)": "-",
        "ours (1)": "7.02",
        "bilevel (1)": "9.17",
    }
    (panel,) = timing.panels(frame(found))
    assert [series.label for series in panel.series] == ["here", "paper, i7-13700K"]


def test_cases_that_are_timed_run_one_at_a_time(monkeypatch, tmp_path):
    asked = []

    class Workers:
        def __init__(self, jobs):
            asked.append(jobs)

        def close(self):
            pass

    monkeypatch.setattr("sgnlp.experiments.cli.collecting.Workers", Workers)
    monkeypatch.setattr("sgnlp.experiments.cli.collecting.collect", lambda *arguments: ([], {}))
    for name in ("time", "comparison"):
        assert cli.run(["study", name, str(CAN), "--jobs", "2", "--out", str(tmp_path / name)]) == 0
    assert asked == [1, 2]
    assert [name for name, study in STUDIES.items() if study.alone] == ["time"]
