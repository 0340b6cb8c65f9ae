"""The study of confidence: which grasps it carries out and under which load, and what its tables say of rows."""

from dataclasses import fields, replace
from math import isnan
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST, preset
from sgnlp.experiments.frames import frame, percent
from sgnlp.experiments.studies import STUDIES, confidence, trials
from sgnlp.experiments.studies.confidence import NAMES, STUDY, Row, chosen, coefficients, fit, reliability, tried
from sgnlp.experiments.studies.study import Setup
from sgnlp.experiments.studies.trials import NO_PLAN
from sgnlp.perception.observation import load
from sgnlp.planning.confidence import MODEL

CAN = Path(__file__).parents[2] / "problems" / "can_1.npz"
SETUP = Setup((CAN,), "allegro_left", ROBUST, 1, 0, 60.0)
TITLES = [
    "Grasps",
    "Coefficients, fitted on the tuning half",
    "Reliability on the held-out half",
    "Scores on the held-out half",
    "Which grasp of a plan holds, on the held-out half",
]


def some(half: str, count: int = 60, seed: int = 0) -> list[Row]:
    """Grasps of ten bodies, three of each plan, of which those of a large margin hold more often."""
    rng, rows = np.random.default_rng(seed), []
    for i in range(count):
        numbers = rng.normal(size=len(NAMES))
        held = bool(rng.random() < 1 / (1 + np.exp(-0.5 - 2 * numbers[0])))
        row = Row(f"body{i // 3 % 10}_{i // 30}", "1 view" if i % 2 else "2 views", half, "0", 3, i % 3)
        rows.append(replace(row, **dict(zip(NAMES, numbers, strict=True)), held=held, score=float(held)))
    return rows


def test_it_is_a_study_and_its_rows_have_the_features_of_the_model_by_their_names():
    assert STUDIES["confidence"] is STUDY
    names = [f.name for f in fields(Row)]
    assert names[names.index("rank") + 1 : names.index("ending")] == NAMES


def test_every_object_is_planned_for_from_one_view_and_from_two():
    assert [case.key for case in STUDY.cases(SETUP, [load(CAN)])] == [("can_1", "1 view"), ("can_1", "2 views")]


def test_it_simulates_the_load_that_the_plan_counts_on():
    settings = replace(ROBUST, contact=replace(ROBUST.contact, mass=0.2, friction=0.7))
    simulation = confidence.load(settings)
    assert (simulation.mass, simulation.friction, simulation.push_weights) == (0.2, 0.7, 0.0)
    assert STUDY.facts(replace(SETUP, settings=settings))["load"]["mass"] == 0.2


def test_settings_and_clouds_whose_plans_have_no_confidence_are_refused_before_any_work():
    with pytest.raises(InputError, match="'can_1': confidence unknown"):
        STUDY.cases(replace(SETUP, settings=preset("robust+no-contact")), [load(CAN)])
    with pytest.raises(InputError, match="'can_1': confidence unknown"):
        STUDY.cases(SETUP, [replace(load(CAN), camera_positions=None)])


def plan(places: list[float], feasible: int) -> SimpleNamespace:
    """A plan of grasps whose contacts lie at these places [m], best first."""
    grasps = [SimpleNamespace(contacts=np.full((4, 3), place)) for place in places]
    return SimpleNamespace(solutions=[SimpleNamespace(feasible=i < feasible, grasp=g) for i, g in enumerate(grasps)])


@pytest.mark.parametrize(
    ("places", "feasible", "ranks"),
    [
        ([0.0, 0.1, 0.2, 0.3, 0.4], 5, [0, 2, 4]),
        ([0.0, 0.1, 0.2, 0.3, 0.4], 4, [0, 1, 3]),
        ([0.0, 0.0, 0.0, 0.1, 0.1], 5, [0, 3]),
        ([0.0, 0.0], 2, [0]),
        ([0.0, 0.1], 0, []),
    ],
)
def test_the_first_the_middle_and_the_last_of_the_feasible_grasps_that_differ_are_carried_out(places, feasible, ranks):
    assert chosen(plan(places, feasible)) == ranks


def test_each_grasp_has_a_row_with_its_features_and_how_it_ended(monkeypatch):
    outcomes = {0: ("held", 1.0), 2: ("slid", 0.5)}
    asked = []

    def carried_out(plan, load, rank):
        asked.append((load, rank))
        ending, score = outcomes[rank]
        return SimpleNamespace(ending=ending, score=score)

    made = SimpleNamespace(
        observation=load(CAN), problem=SimpleNamespace(settings=ROBUST), solutions=[SimpleNamespace(feasible=True)] * 3
    )
    monkeypatch.setattr(trials, "planned", lambda *_: made)
    monkeypatch.setattr(trials, "carried_out", carried_out)
    monkeypatch.setattr(confidence, "chosen", lambda plan: [0, 2])
    monkeypatch.setattr(confidence, "values", lambda s, points: np.arange(len(NAMES)) + 0.5)
    first, last = tried(SETUP, CAN, confidence.CONDITIONS[0], ["0"])
    assert asked == [(confidence.load(ROBUST), 0), (confidence.load(ROBUST), 2)]
    assert (first.rank, first.ending, first.held, last.rank, last.ending, last.held) == (
        0,
        "held",
        True,
        2,
        "slid",
        False,
    )
    assert [getattr(first, name) for name in NAMES] == [i + 0.5 for i in range(len(NAMES))]
    assert (first.object, first.condition, first.half, first.feasible) == ("can_1", "1 view", load(CAN).half, 3)


def test_a_plan_without_a_feasible_grasp_has_a_row_that_no_fit_counts(monkeypatch):
    made = SimpleNamespace(
        observation=load(CAN), problem=SimpleNamespace(settings=ROBUST), solutions=[SimpleNamespace(feasible=False)]
    )
    monkeypatch.setattr(trials, "planned", lambda *_: made)
    (row,) = tried(SETUP, CAN, confidence.CONDITIONS[0], ["0"])
    assert (row.rank, row.ending, row.held, isnan(row.margin)) == (-1, NO_PLAN, False, True)
    rows = some("tuning")
    assert fit(frame([*rows, replace(row, half="tuning")])) == fit(frame(rows))
    line = next(iter(confidence.counts(frame([replace(row, half="tuning")]))))
    assert (line["plans"], line["none feasible"], line["grasps"], line["held [%]"]) == ("1", "1", "0", "-")


def test_the_model_is_fitted_to_the_tuning_half_alone():
    tuning = some("tuning")
    alone, both = fit(frame(tuning)), fit(frame(tuning + some("held_out", seed=1)))
    assert alone == both
    assert alone is not None
    assert alone[0].features[0].weight > 0
    assert [f.name for f in alone[0].features] == NAMES


def test_the_table_of_coefficients_has_every_number_of_the_model():
    lines = {line["name"]: line for line in coefficients(replace(MODEL, intercept=1.25), 3.0)}
    assert list(lines) == [*NAMES, "intercept", "ridge λ"]
    assert (lines["intercept"]["weight"], lines["ridge λ"]["weight"]) == ("1.25", "3")
    assert lines["margin"]["unit"] == "0.05"


def test_the_reliability_of_rows_made_by_hand():
    p = np.array([0.1, 0.2, 0.3, 0.4, 0.55, 0.65, 0.7, 0.8, 0.9, 0.95])
    held = np.array([False, False, True, False, True, False, True, True, True, True])
    first, *_, last = lines = reliability(p, held)
    assert [line["grasps"] for line in lines] == ["2"] * 5
    assert first == {"told": "0.10 to 0.20", "mean told [%]": "15", "held [%]": percent(0, 2), "grasps": "2"}
    assert (last["told"], last["held [%]"]) == ("0.90 to 0.95", percent(2, 2))
    assert [line["held [%]"].split()[0] for line in lines] == ["0", "50", "50", "100", "100"]


def test_scores_stand_beside_those_of_the_constant_that_the_tuning_half_holds():
    rows = frame(some("held_out", 4)).assign(held=[True, False, True, True])
    p = np.array([0.9, 0.1, 0.8, 0.6])
    line, constant, *views = confidence.scores(rows, p, 0.75)
    assert (line["grasps"], line["told"], line["Brier"]) == (
        "all: 4",
        "confidence",
        f"{(0.01 + 0.01 + 0.04 + 0.16) / 4:.3f}",
    )
    assert (constant["told"], constant["Brier"]) == ("always 0.75", f"{(3 * 0.0625 + 0.5625) / 4:.3f}")
    assert (line["area under the ROC"], constant["area under the ROC"]) == ("1.00", "0.50")
    assert [view["grasps"] for view in views] == ["1 view: 2", "1 view: 2", "2 views: 2", "2 views: 2"]


def test_ranking_by_confidence_is_compared_with_ranking_by_margin_on_the_same_plans():
    plain = Row("a_0", "1 view", "held_out", "0", 2)
    rows = [
        replace(plain, rank=0, margin=0.3, held=False),
        replace(plain, rank=1, margin=0.2, held=True),
        replace(plain, object="b_0", rank=0, margin=0.3, held=True),
        replace(plain, object="b_0", rank=1, margin=0.2, held=True),
        replace(plain, object="c_0", rank=0, margin=0.1, held=False),  # has nothing to choose from
    ]
    margin, told = confidence.rankings(frame(rows), np.array([0.4, 0.9, 0.7, 0.6, 0.9]))
    assert (margin["first by"], margin["held [%]"]) == ("margin", percent(1, 2))
    assert (told["first by"], told["held [%]"], told["better"], told["worse"]) == (
        "confidence",
        percent(2, 2),
        "1",
        "0",
    )


def test_all_tables_and_the_diagram_are_made_of_both_halves():
    rows = frame(some("tuning") + some("held_out", 90, seed=1))
    tables = STUDY.tables(rows)
    assert list(tables) == TITLES
    assert all(lines and len({tuple(line) for line in lines}) == 1 for lines in tables.values())
    (panel,) = STUDY.panels(rows)
    (series,) = panel.series
    assert panel.diagonal
    assert list(series.x) == sorted(series.x)
    assert all(low <= y <= high for low, y, high in zip(series.low, series.y, series.high, strict=True))
    told = tables["Scores on the held-out half"]
    assert float(told[0]["Brier"]) < float(told[1]["Brier"])


@pytest.mark.parametrize("rows", [some("tuning"), some("held_out"), [replace(r, held=True) for r in some("tuning")]])
def test_what_cannot_be_told_of_some_rows_is_left_out(rows):
    tables = STUDY.tables(frame(rows))
    assert next(iter(tables)) == "Grasps"
    assert "Reliability on the held-out half" not in tables
    assert len(STUDY.panels(frame(rows))) == 1


def test_the_page_of_the_confidence_names_every_feature_with_its_unit():
    page = (Path(__file__).parents[2] / "docs" / "pages" / "results" / "confidence.md").read_text(encoding="utf-8")
    lines = [line for line in page.splitlines() if line.startswith("| `")]
    for feature in MODEL.features:
        (line,) = (line for line in lines if f"`{feature.name}`" in line)
        assert float(line.split("|")[2].split()[0]) == feature.unit
