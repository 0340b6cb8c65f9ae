"""The study of the defaults: its steps lead from the paper to the robust preset, each by what it says."""

from dataclasses import asdict, replace
from pathlib import Path

import pytest
from test_trials import HEAVY, LIGHT, row

from sgnlp.base.errors import InputError
from sgnlp.base.presets import PAPER, ROBUST, VARIANTS
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import defaults
from sgnlp.experiments.studies.defaults import FINAL, STEPS, settings_of
from sgnlp.experiments.studies.study import Setup
from sgnlp.perception.observation import ObservationSettings, load

CAN = Path(__file__).parents[2] / "problems" / "can_1.npz"
SETUP = Setup((CAN,), "allegro_left", ROBUST, 7, 0, 60.0)


def flat(settings) -> dict[str, object]:
    """Every setting by its name, `limits.shift`."""
    found = {}
    for name, value in asdict(settings).items():
        found |= {f"{name}.{key}": v for key, v in value.items()} if isinstance(value, dict) else {name: value}
    return found


def test_the_steps_begin_with_the_paper_and_end_at_the_default():
    assert settings_of("paper") == PAPER
    assert settings_of(FINAL) == settings_of(f"{FINAL}, 1 view") == ROBUST


@pytest.mark.parametrize("name", STEPS)
def test_a_step_changes_what_it_says_and_nothing_else(name):
    if STEPS[name].before:
        now, before = flat(settings_of(name)), flat(settings_of(STEPS[name].before))
        assert {key: value for key, value in now.items() if value != before[key]} == STEPS[name].changes


def test_a_step_is_the_variant_of_the_same_name():
    assert settings_of("pad ignored") == VARIANTS["no-pad"](settings_of(STEPS["pad ignored"].before))


def test_every_object_is_tried_in_every_step_by_its_own_settings():
    cases = defaults.cases(SETUP, [load(CAN)])
    assert [case.key for case in cases] == [("can_1", name) for name in STEPS]
    for condition in defaults.CONDITIONS:
        assert condition.change(PAPER) == settings_of(condition.name)
    one = [condition.name for condition in defaults.CONDITIONS if condition.cameras == 1]
    assert one == [name for name in STEPS if name.endswith("1 view")]


def test_settings_of_the_command_line_are_refused():
    with pytest.raises(InputError, match="has its own settings"):
        defaults.cases(replace(SETUP, settings=PAPER), [load(CAN)])


def test_the_rows_depend_on_the_settings_of_every_step_and_on_the_loads():
    facts = defaults.STUDY.facts(SETUP)
    assert facts["settings"] == asdict(ROBUST)
    assert list(facts["conditions"]) == list(STEPS)
    assert facts["conditions"][FINAL] == {"cameras": 2}
    assert facts["conditions"]["ranked by energy"]["rank_by"] == "energy"
    assert facts["conditions"]["paper"]["limits.force_min"] == PAPER.limits.force_min
    assert [load["mass"] for load in facts["loads"].values()] == [0.1, 0.3]
    assert facts["cleaning"]["max_points"] == ObservationSettings().max_points


def test_a_gain_is_over_the_step_before_on_the_objects_that_have_both():
    scores = {"paper": (0.0, 0.5, 1.0), "whole hand covered": (1.0, 1.0)}
    rows = [
        row(object=f"can_{i}", condition=name, score=score, half="tuning")
        for name, values in scores.items()
        for i, score in enumerate(values)
    ]
    first, second = defaults.table(LIGHT, frame(rows))
    assert (first["gain, tuning"], second["gain, tuning"]) == ("-", "+75")
    assert (second["tuning"].split()[0], second["held out"]) == ("100", "-")
    assert second["gain, held out"] == "-"
    assert (second["step"], second["changes"]) == ("whole hand covered", "paper")


def test_the_tables_have_both_loads_the_endings_and_what_the_steps_are():
    rows = [row(condition=FINAL), row(condition=FINAL, load=HEAVY, score=0.0, ending="dropped")]
    found = defaults.tables(frame(rows))
    success = [lines for title, lines in found.items() if title.startswith("Success")]
    assert [lines[0]["held out"].split()[0] for lines in success] == ["100", "0"]
    assert len(found["Steps"]) == len(STEPS)
    assert {line["settings"] for line in found["Steps"]} >= {"contact.mass = 0.3", "contact.friction = 0.5"}
    assert len(defaults.STUDY.panels(frame(rows))) == 2
