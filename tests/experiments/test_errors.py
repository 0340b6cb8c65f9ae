"""The study of errors: what deviates from the nominal trial and what does not, one plan for all, tables and curves."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from readings import LIFTED, TOUCHED, Played, moved
from scenes import SMALL

from sgnlp.base.presets import PAPER, ROBUST
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import STUDIES, errors, trials
from sgnlp.experiments.studies.errors import AXES, CONDITIONS, NOMINAL, STUDY, Row
from sgnlp.experiments.studies.study import Setup, collect
from sgnlp.experiments.studies.trials import NO_PLAN, Condition
from sgnlp.perception.observation import load
from sgnlp.planning import results
from sgnlp.planning.workers import Workers
from sgnlp.simulation import Command, SimulationSettings
from sgnlp.simulation.judge import judge

CAN = Path(__file__).parents[2] / "problems" / "can_1.npz"
LEAN = replace(SMALL, spheres="paper", solver=replace(SMALL.solver, formulation="constrained"))
"""Of one program, with few spheres: the trials are made up."""
SETUP = Setup((CAN,), "allegro_left", LEAN, 1, 0, 60.0)
TRIALS = {"place": [0, 5, 10, 20], "turn": [0, 5, 10], "mass": [0.1, 0.3, 0.5, 1.0], "friction": [0.3, 0.6, 1.0]}
BARE = Command(np.zeros(7), np.zeros(16), np.zeros((2, 3)), np.zeros((2, 3)), np.ones(2))


HELD = Row(
    *("can_1", "robust", "place 0", "held_out", "1 2", 7, 6, 0.5, 0.1, 0.0, "held", 1.0, 1.0), axis="place", value=0.0
)


@pytest.fixture
def carried(monkeypatch) -> list[SimulationSettings]:
    """The settings of every trial that is carried out, in their order; each lifts by 3 cm and touches with a link."""
    seen: list[SimulationSettings] = []
    low = moved(TOUCHED, 0.0, 0.0, 0.03)
    played = Played(close=[replace(TOUCHED, links={"palm": 1.5})], lift=[LIFTED], hold=[low] * 3)

    def out(plan, settings):
        seen.append(settings)
        return judge(played, BARE)

    monkeypatch.setattr(trials, "carried_out", out)
    return seen


def test_it_is_a_study_of_every_object_with_five_presets_from_two_views():
    assert STUDIES["errors"] is STUDY
    cases = STUDY.cases(SETUP, [load(CAN)])
    presets = ["robust", "paper", "bilevel-high", "bilevel-low", "bilevel-heuristic"]
    assert [case.key for case in cases] == [("can_1", name) for name in presets]
    assert {tuple(case.work.args[-1]) for case in cases} == {("1", "2")}  # type: ignore[attr-defined]


def test_robust_is_as_the_flags_set_it_paper_is_the_papers_and_baselines_plan_force_closure():
    flagged = replace(ROBUST, rank_by="energy")
    planned = {condition.name: condition.change(flagged) for condition in CONDITIONS}
    assert planned.pop("robust") == flagged
    assert planned.pop("paper") == PAPER
    assert {settings.contact.metric for settings in planned.values()} == {"closure"}


def test_one_axis_deviates_at_a_time_from_the_nominal_trial_which_stands_on_each():
    found = list(errors.deviations(NOMINAL))
    assert {name: [value for axis, value, _ in found if axis == name] for name in AXES} == TRIALS
    for name, value, settings in found:
        field = {"place": "place_error", "turn": "turn_error"}.get(name, name)
        expected = value / 1000 if name == "place" else value
        assert getattr(settings, field) == pytest.approx(expected)
        assert replace(settings, **{field: getattr(NOMINAL, field)}) == NOMINAL
    assert [name for name, _, settings in found if settings == NOMINAL] == list(AXES)
    assert (NOMINAL.mass, NOMINAL.friction, NOMINAL.place_error, NOMINAL.turn_error) == (0.3, 0.6, 0.0, 0.0)


def test_a_plan_is_made_once_and_equal_trials_are_carried_out_once(carried, monkeypatch):
    made, real = [], trials.planned
    monkeypatch.setattr(trials, "planned", lambda *arguments: made.append(1) or real(*arguments))
    rows = errors.trial(SETUP, CAN, CONDITIONS[0], ["1", "2"])
    assert len(made) == 1
    assert len(carried) == len(set(carried)) == 11
    assert [(r.axis, r.value) for r in rows] == [(axis, float(value)) for axis in TRIALS for value in TRIALS[axis]]
    assert {(r.object, r.condition, r.views, r.ending, r.score, r.strict) for r in rows} == {
        ("can_1", "robust", "1 2", "held", 1.0, 0.0)
    }
    assert {(r.links_touched, r.links_force) for r in rows} == {(1, 1.5)}
    assert rows[2].load == "place 10"


def test_directions_are_those_of_the_object_and_the_seed_and_the_same_in_every_trial(carried):
    def seeds(file: Path, seed: int) -> set[int]:
        carried.clear()
        errors.trial(replace(SETUP, seed=seed), file, CONDITIONS[0], ["1", "2"])
        return {settings.seed for settings in carried}

    once, again, other, seeded = seeds(CAN, 0), seeds(CAN, 0), seeds(CAN.with_name("pear_0.npz"), 0), seeds(CAN, 1)
    assert len(once) == 1
    assert once == again
    assert once != other
    assert once != seeded


def test_without_a_plan_every_trial_has_failed(carried):
    def impossible(settings: Settings) -> Settings:
        few = replace(settings.solver, max_iterations=3)
        return replace(settings, limits=replace(settings.limits, table_margin=0.5), solver=few)

    rows = errors.trial(SETUP, CAN, Condition("none", 2, impossible), ["1", "2"])
    assert [(r.ending, r.score, r.strict) for r in rows] == [(NO_PLAN, 0.0, 0.0)] * 14
    assert carried == []


def test_rows_are_kept_and_not_made_again(tmp_path, carried):
    case = STUDY.cases(SETUP, [load(CAN)])[0]
    made = [replace(HELD, value=float(value)) for value in TRIALS["place"]]
    results.write_rows(tmp_path / "rows.csv", made)
    rows, failures = collect(Row, [case], tmp_path / "rows.csv", Workers(1), lambda *_: None)
    assert (len(rows), failures, carried) == (4, {}, [])
    assert [r.value for r in rows] == [0.0, 5.0, 10.0, 20.0]


def test_what_rows_depend_on_has_the_nominal_trial_and_every_value():
    facts = STUDY.facts(SETUP)
    assert facts["nominal"] == asdict(NOMINAL)
    assert facts["axes"] == {name: list(values) for name, values in TRIALS.items()}
    assert facts["conditions"]["bilevel-low"]["contact.metric"] == "closure"
    assert "loads" not in facts


def everything() -> list[Row]:
    """A row for each preset and deviation: twice held and once not, but the papers never hold."""
    return [
        replace(HELD, object=f"o{i}", condition=c.name, axis=axis, value=float(v), score=score, strict=score / 2)
        for c in CONDITIONS
        for axis, values in TRIALS.items()
        for v in values
        for i, score in enumerate([0.0] * 3 if c.name == "paper" else [1.0, v != 0.5, 0.0])
    ]


def test_tables_have_a_line_for_each_preset_and_a_column_for_each_value():
    tables = STUDY.tables(frame(everything()))
    assert len(tables) == 8
    first = tables["Success in percent, mass [kg]"]
    assert [line["preset"] for line in first] == [c.name for c in CONDITIONS]
    assert [first[0][value].split()[0] for value in ("0.1", "0.3", "0.5", "1")] == ["67", "67", "33", "67"]
    assert first[1]["0.3"].startswith("0 (")
    strict = tables["Risen by 4 cm in percent, error of the hand's place [mm]"]
    assert [strict[0][value].split()[0] for value in ("0", "5", "10", "20")] == ["33"] * 4


def test_curves_have_a_line_for_each_preset_over_the_values_with_intervals():
    panels = STUDY.panels(frame(everything()))
    assert [panel.x_label for panel in panels[:4]] == [axis.label for axis in AXES.values()]
    assert len(panels) == 8
    mass = panels[2].series[0]
    assert (mass.label, list(mass.x)) == ("robust", [0.1, 0.3, 0.5, 1.0])
    np.testing.assert_allclose(mass.y, [200 / 3, 200 / 3, 100 / 3, 200 / 3])
    assert all(low < y < high for low, y, high in zip(mass.low, mass.y, mass.high, strict=True))
