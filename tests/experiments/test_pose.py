"""The study of E_pose: which motion is meant, for which mass is planned, and what the tables say."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import SMALL, impossible, random_rotation

from sgnlp.base.presets import ROBUST
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import pose, trials
from sgnlp.experiments.studies.pose import WITH, WITHOUT, Row
from sgnlp.experiments.studies.study import Setup
from sgnlp.experiments.studies.trials import LOADS, NO_PLAN
from sgnlp.perception.observation import load

CAN = Path(__file__).parents[2] / "problems" / "can_1.npz"
ORANGE = CAN.with_name("orange_1.npz")
"""It is convex, so that nothing takes it into pieces before it is simulated."""
FAILED = Row("can_2", WITH, 0)


def test_the_motion_is_that_of_the_point_and_not_of_the_origin():
    R = random_rotation(np.random.default_rng(0))
    c = np.array([0.4, -0.2, 0.1])
    assert pose.motion(R, c + np.array([0.003, -0.004, 0.01]) - R @ c, c) == pytest.approx((10.0, 5.0))


def test_both_conditions_plan_for_the_mass_that_is_simulated():
    lift, plain = (condition.change(ROBUST) for condition in pose.CONDITIONS)
    assert lift.contact.mass == plain.contact.mass == min(load.mass for load in LOADS.values())
    assert (lift.weights.pose > 0, plain.weights.pose > 0) == (True, False)
    assert lift.contact.displacement == (0.0, 0.0, 0.01)


def test_every_object_is_grasped_with_and_without():
    cases = pose.STUDY.cases(Setup((CAN,), "allegro_left", SMALL, 1, 0, 60.0), [load(CAN)])
    assert [case.key for case in cases] == [("can_1", WITH), ("can_1", WITHOUT)]


def test_an_object_that_is_to_rise_is_planned_to_and_its_motion_is_simulated(monkeypatch):
    simulated = []

    def simulate(command, body, *rest):
        simulated.append((trials_simulate(command, body, *rest), body))
        return simulated[-1][0]

    trials_simulate = trials.execute
    monkeypatch.setattr(trials, "execute", simulate)
    setup = Setup((ORANGE,), "allegro_left", SMALL, 1, 0, 60.0)
    (row,) = pose.risen(setup, ORANGE, pose.CONDITIONS[0], ["0", "1", "2"])
    ((outcome, body),) = simulated
    assert (row.object, row.condition, row.feasible, row.ending) == ("orange_1", WITH, 1, outcome.ending)
    assert row.planned_rise == pytest.approx(10.0, abs=3.0)
    a, b, c = np.moveaxis(body.vertices[body.faces], 1, 0)
    parts = np.einsum("fi,fi->f", a, np.cross(b, c))  # six volumes of tetrahedra, whose centres are (a + b + c)/4
    centre = parts @ (a + b + c) / (4 * parts.sum())
    shift = 1e3 * (outcome.closing.rotation @ centre + outcome.closing.translation - centre)
    assert (row.rise, row.drift) == pytest.approx((shift[2], np.hypot(*shift[:2])))
    assert 0 < row.rise < 20


def test_a_plan_without_a_feasible_grasp_stays_in_the_table():
    setup = Setup((CAN,), "allegro_left", SMALL, 1, 0, 60.0)
    (row,) = pose.risen(setup, CAN, replace(pose.CONDITIONS[0], change=impossible), ["0"])
    assert (row.ending, row.feasible, row.rise == row.rise) == (NO_PLAN, 0, False)


def test_means_are_over_what_was_simulated_and_count_the_rest():
    held = Row("can_1", WITH, 7, "held", 9.0, 1.0, 6.0, 2.0, 0.5)
    rows = [held, replace(held, object="pear_0", planned_rise=11.0, rise=12.0), FAILED]
    line, without = pose.means(frame(rows))
    assert (line["objects"], without["objects"]) == ("2 of 3", "0 of 0")
    assert (line["planned rise [mm]"], line["simulated rise [mm]"], line["|error| [mm]"]) == ("10.0", "9.0", "2.0")
    assert without["|error| [mm]"] == "-"
    by_object = {line["object"]: line for line in pose.by_object(frame(rows))}
    assert (by_object["can_1"][f"{WITH}: planned"], by_object["can_1"][f"{WITH}: simulated"]) == ("9.0", "6.0")
    assert by_object["can_2"][f"{WITH}: ending"] == NO_PLAN
    assert by_object["can_1"][f"{WITHOUT}: ending"] == "-"
    (panel,) = pose.panels(frame(rows))
    assert list(panel.series[0].y) == [6.0, 12.0]
