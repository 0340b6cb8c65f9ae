"""A hand that stands beside its planned place: what moves with it, what stays, and in which directions."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from grips import box, faces, grip
from readings import turn

from sgnlp.control.command import Command
from sgnlp.hand.hand import load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.simulation import SimulationSettings
from sgnlp.simulation.displacement import displaced, erred

LEFT = load_hand("allegro_left")
GRIP = replace(grip(LEFT, *faces(0.06, 0.045)), translation_eq=np.array([0.0, 0.001, 0.0]))
SETTINGS = SimulationSettings()
SHIFT, TURN = np.array([0.01, -0.02, 0.003]), turn(0.1, -0.2, 0.3)
MOVED = displaced(GRIP, SHIFT, TURN)
MIDDLE = GRIP.tips.mean(axis=0)


def far(command: Command) -> float:
    """How far the middle of the tips has moved [m]."""
    return float(np.linalg.norm(command.tips.mean(axis=0) - MIDDLE))


def angle(command: Command) -> float:
    """By how much the wrist has turned [rad]."""
    before, after = (pin.XYZQUATToSE3(c.wrist).rotation for c in (GRIP, command))
    return float(np.linalg.norm(pin.log3(after @ before.T)))


def test_the_tips_are_where_the_moved_wrist_puts_them():
    np.testing.assert_allclose(frames(LEFT, MOVED.wrist, MOVED.joints)[0], MOVED.tips, atol=1e-9)


@pytest.mark.parametrize("name", ["tips", "targets", "contacts_eq"])
def test_places_of_the_tips_turn_about_their_middle_and_shift(name):
    expected = (getattr(GRIP, name) - MIDDLE) @ TURN.T + MIDDLE + SHIFT
    np.testing.assert_allclose(getattr(MOVED, name), expected, atol=1e-12)


def test_the_middle_of_the_tips_only_shifts():
    np.testing.assert_allclose(MOVED.tips.mean(axis=0) - MIDDLE, SHIFT, atol=1e-12)


def test_the_springs_pull_the_same_way_in_the_hand():
    pull = GRIP.forces_eq @ TURN.T
    np.testing.assert_allclose(MOVED.forces_eq, pull)
    np.testing.assert_allclose(MOVED.targets - MOVED.tips, (GRIP.targets - GRIP.tips) @ TURN.T, atol=1e-12)


def test_joints_gains_and_what_is_expected_of_the_object_stay():
    for name in ("joints", "gains", "rotation_eq", "translation_eq", "joints_contact"):
        assert getattr(MOVED, name) is getattr(GRIP, name)


def test_what_is_not_expected_stays_unknown():
    bare = displaced(replace(GRIP, forces_eq=None, contacts_eq=None), SHIFT, TURN)
    assert (bare.forces_eq, bare.contacts_eq) == (None, None)


def test_without_errors_the_command_is_the_same_to_the_bit():
    assert erred(GRIP, replace(SETTINGS, seed=5)) is GRIP


def test_the_error_of_the_place_is_horizontal_and_as_long_as_asked_for():
    for seed in range(5):
        moved = erred(GRIP, replace(SETTINGS, place_error=0.02, seed=seed))
        shift = moved.tips - GRIP.tips
        np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-12)
        assert np.linalg.norm(shift[0]) == pytest.approx(0.02)
        assert shift[0, 2] == pytest.approx(0.0, abs=1e-12)
        assert angle(moved) == pytest.approx(0.0, abs=1e-7)


def test_the_error_of_the_turn_is_as_large_as_asked_for_and_shifts_nothing():
    moved = erred(GRIP, replace(SETTINGS, turn_error=10.0))
    assert angle(moved) == pytest.approx(np.radians(10.0))
    assert far(moved) == pytest.approx(0.0, abs=1e-12)


def test_directions_are_those_of_the_seed_whatever_the_size():
    def heading(size, seed):
        return (erred(GRIP, replace(SETTINGS, place_error=size, seed=seed)).tips - GRIP.tips)[0] / size

    np.testing.assert_allclose(heading(0.005, 1), heading(0.02, 1), atol=1e-9)
    headings = np.array([heading(0.01, seed) for seed in range(200)])
    assert np.linalg.norm(headings.mean(axis=0)) < 0.15  # all around
    axes = np.array(
        [
            pin.log3(pin.XYZQUATToSE3(erred(GRIP, replace(SETTINGS, turn_error=5.0, seed=seed)).wrist).rotation)
            for seed in range(3)
        ]
    )
    assert np.linalg.norm(axes[0] - axes[1]) > 0.01


def test_a_hand_far_off_closes_elsewhere():
    pytest.importorskip("mujoco")
    from sgnlp.simulation import execute

    quick = replace(SETTINGS, push_weights=0.0, hold_time=0.2)
    missed = execute(GRIP, box(), LEFT, replace(quick, place_error=0.04))
    assert missed.score < execute(GRIP, box(), LEFT, quick).score == 1.0
    np.testing.assert_allclose(missed.trace.tips[0], erred(GRIP, replace(quick, place_error=0.04)).tips, atol=1e-9)
