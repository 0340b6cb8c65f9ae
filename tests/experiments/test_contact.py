"""The study of the hand at first contact: its steps are the preset's way there, its trials those of the table."""

from dataclasses import replace
from pathlib import Path

import pytest
from test_trials import row

from sgnlp.base.presets import ROBUST
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import contact
from sgnlp.experiments.studies.contact import OFF, STEPS, TRIALS
from sgnlp.experiments.studies.study import Setup
from sgnlp.perception.observation import load

CAN = Path(__file__).parents[2] / "problems" / "can_1.npz"
SETUP = Setup((CAN,), "allegro_left", ROBUST, 7, 0, 60.0)


def test_one_step_is_the_preset_and_the_others_change_what_they_say():
    changed = {condition.name: condition.change(ROBUST) for condition in contact.CONDITIONS}
    assert changed["gap of 24 mm"] == ROBUST
    assert len(set(changed.values())) == len(STEPS)
    assert not changed["pregrasp alone"].closing.planned
    assert changed["c of each finger"].limits == changed["gap of 8 mm"].limits
    assert [case.key for case in contact.cases(SETUP, [load(CAN)])] == [("can_1", name) for name in STEPS]


def test_a_plan_is_carried_out_under_both_loads_and_beside_its_place():
    heavy, off = TRIALS["0.3 kg, μ 0.6"], TRIALS[OFF]
    assert off == replace(heavy, place_error=0.02)
    assert contact.STUDY.facts(SETUP)["off"] == 0.02


def test_the_tables_have_every_step_and_load_that_has_rows():
    rows = [replace(row(), condition=name, load=trial) for name in list(STEPS)[:2] for trial in TRIALS]
    tables = contact.STUDY.tables(frame(rows))
    assert len(tables["Success in percent with 95 % intervals"]) == 6
    assert [line["step"] for line in tables["Steps"]] == list(STEPS)


@pytest.mark.parametrize("name", STEPS)
def test_every_step_is_a_setting_that_can_be_planned(name):
    assert contact._step(name, ROBUST).closing.seconds == ROBUST.closing.seconds
