"""The study of hands: which objects fit, what load, and the table."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sgnlp.base.presets import ROBUST
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import hands
from sgnlp.experiments.studies.study import Setup
from sgnlp.hand.opening import Opening

PROBLEMS = Path(__file__).parents[2] / "problems"


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.2])
def test_the_width_of_a_turned_box_is_its_shorter_side(turn):
    corners = np.array([[x, y, z] for x in (0, 0.05) for y in (0, 0.12) for z in (0, 0.02)])
    c, s = np.cos(turn), np.sin(turn)
    assert hands.width(corners @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])) == pytest.approx(0.05)


def test_the_load_is_what_the_motors_press_and_never_more_than_the_plan_s():
    assert hands.loaded(ROBUST, 1e3) == (ROBUST.contact.mass, ROBUST.contact.friction)
    weak = 1.0  # [N]
    mass, friction = hands.loaded(ROBUST, weak)
    assert friction == hands.ROUGH
    weight, held = mass * hands.GRAVITY, 2 * friction * weak * hands.SHARE
    assert weight <= held < weight + hands.STEP * hands.GRAVITY
    assert hands.loaded(ROBUST, 2 * weak)[0] > mass
    assert hands.loaded(ROBUST, 5.0) == (hands.LIGHT, hands.ROUGH)


def test_an_object_is_asked_of_a_hand_only_if_it_fits_and_as_a_light_one_of_a_hand_that_can_carry_a_heavy_one(
    monkeypatch,
):
    files = tuple(PROBLEMS / f"{name}.npz" for name in ("orange_0", "plane_0"))
    monkeypatch.setattr(hands, "available_hands", lambda: ("small", "large"))
    gap = 2 * ROBUST.limits.place_error
    sizes = {"small": 0.080 + gap, "large": 0.110 + gap}
    monkeypatch.setattr(hands, "_gap", lambda setup, hand: gap / 2)
    monkeypatch.setattr(hands, "_opening", lambda hand, preset: Opening(sizes[hand], np.zeros(3), np.zeros(1)))
    monkeypatch.setattr(hands, "_press", lambda hand, preset: {"small": 1.0, "large": 1e3}[hand])
    setup = Setup(files, "small", ROBUST, 7, 0, 300.0)
    keys = [case.key for case in hands.cases(setup, setup.observations())]
    both = ["large", "large-light"]
    assert keys == [*(("orange_0", name) for name in ["small", *both]), *(("plane_0", name) for name in both)]


def test_a_light_object_has_the_mass_and_friction_of_weak_hands():
    contact = hands.light(ROBUST).contact
    assert hands.loaded(hands.light(ROBUST), 1e3) == (contact.mass, contact.friction) == (hands.LIGHT, hands.ROUGH)


def test_the_table_has_a_line_for_each_hand():
    row = hands.Row("a", "vice", "0.2 kg, μ 0.6", "held_out", "0 1", 7, 6, 2.0, ending="held", score=1.0)
    row = replace(row, fingers=3, joints=4, opening_mm=91.2)
    rows = [row, replace(row, object="b", feasible=0, ending=hands.NO_PLAN, score=0.0), replace(row, condition="yoke")]
    first, second = hands.table(frame(rows))
    assert (first["hand"], first["joints"], first["largest ball [mm]"], first["objects"]) == ("vice", "4", "91", "2")
    assert first["with a grasp [%]"].startswith("50 ")
    assert first["starts feasible [%]"].startswith("43 ")
    assert first["held [%]"].startswith("50 ")
    assert second["held [%]"].startswith("100 ")
