"""The study of an object that moves: its clouds, and what is made of the rows."""

from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest

from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import stream
from sgnlp.experiments.studies.stream import AFRESH, REPLANNED, Row
from sgnlp.perception.observation import load

ORANGE = Path(__file__).parents[2] / "problems" / "orange_0.npz"


def test_the_object_goes_one_centimetre_a_step_and_turns_at_its_place():
    whole = load(ORANGE)
    middle = whole.mesh_vertices.mean(axis=0)
    places = np.array([stream.motion(whole, step, 3)(middle) for step in range(4)])
    np.testing.assert_allclose(np.linalg.norm(np.diff(places, axis=0), axis=1), 0.01)
    np.testing.assert_allclose(places[0], middle)
    assert abs(stream.motion(whole, 2, 3).yaw) == pytest.approx(np.radians(6.0))


def test_still_cameras_see_the_moved_object_with_new_noise():
    whole = load(ORANGE)
    before, after = (stream.cloud(whole, step, 3, ("0", "1")) for step in (0, 2))
    shift = np.median(after.points, axis=0) - np.median(before.points, axis=0)
    np.testing.assert_allclose(shift, stream.motion(whole, 2, 3).shift, atol=0.005)
    np.testing.assert_array_equal(after.camera_positions, before.camera_positions)
    assert set(after.view_names) == {"0", "1", "2"} or len(after.view_names) == 2
    again = stream.cloud(whole, 2, 3, ("0", "1"))
    np.testing.assert_array_equal(again.points, after.points)


def test_a_grasp_is_as_good_if_it_is_feasible_and_its_energy_is_no_higher_but_for_one_percent():
    row = Row("a", REPLANNED, 5, "held_out", "moved", 0.05, 3, True, -100.0, 0.1)
    fresh = replace(row, condition=AFRESH, how="", seconds=2.0)
    rows = [
        row,
        fresh,
        replace(row, object="b", energy=-98.0),  # two percent above
        replace(fresh, object="b"),
        replace(row, object="c", feasible=False, energy=nan),
        replace(fresh, object="c"),
        replace(row, object="d"),
        replace(fresh, object="d", feasible=False, energy=nan),  # nothing to be as good as
    ]
    (line,) = stream.against(frame(rows))
    assert line["steps"] == "3"
    assert line["feasible [%]"].startswith("67 ")
    assert line["as good [%]"].startswith("33 ")
    mine, other = stream.steps(frame(rows))
    assert (mine["moved"], mine["fitted"], mine["time, median [ms]"]) == ("4", "0", "50")
    assert other["moved"] == "0"


def test_success_counts_the_last_step_alone():
    row = Row("a", REPLANNED, stream.STEPS, "held_out", "moved", 0.05, 3, True, -100.0, 0.1, "held", 1.0)
    rows = [row, replace(row, object="b", ending="", score=nan), replace(row, step=5, score=0.0)]
    (line,) = stream.held(frame(rows))
    assert line["objects"] == "2"
    assert line["held [%]"].startswith("50 ")
