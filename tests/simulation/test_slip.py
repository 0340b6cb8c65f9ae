"""The path of a pad over a surface: sliding counts, rolling does not."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sgnlp.simulation.slip import Frame, mark

RADIUS = 0.012
UP = np.array([0.0, 0.0, 1.0])
FLOOR = Frame(np.eye(3), np.zeros(3))


def ball(x: float, turn: float = 0.0) -> Frame:
    """A ball on the plane z = 0, turned about the y axis."""
    return Frame(Rotation.from_rotvec([0, turn, 0]).as_matrix(), np.array([x, 0.0, RADIUS]))


def path(poses: list[Frame], floors: list[Frame]) -> float:
    """Slip summed over poses of the ball and of the floor."""
    total = 0.0
    for before, after, floor, floor_after in zip(poses, poses[1:], floors, floors[1:], strict=False):
        touch = before.origin - RADIUS * UP
        total += mark(before, floor, touch, UP).slid(after, floor_after)
    return total


def test_a_ball_that_slides_covers_its_way():
    poses = [ball(x) for x in np.linspace(0, 0.02, 50)]
    assert path(poses, [FLOOR] * 50) == pytest.approx(0.02)


def test_a_ball_that_turns_on_the_spot_covers_its_circumference():
    poses = [ball(0.0, turn) for turn in np.linspace(0, 1.0, 200)]
    assert path(poses, [FLOOR] * 200) == pytest.approx(RADIUS, rel=1e-3)


def test_a_ball_that_rolls_covers_nothing():
    poses = [ball(RADIUS * turn, turn) for turn in np.linspace(0, 1.0, 100)]
    assert path(poses, [FLOOR] * 100) < 1e-4 * RADIUS


def test_a_ball_that_rolls_on_a_moving_floor_covers_nothing():
    times = np.linspace(0, 1.0, 100)
    floors = [Frame(np.eye(3), np.array([0.05 * t, 0.02 * t, 0.0])) for t in times]
    poses = [Frame(ball(0, t).rotation, f.origin + ball(RADIUS * t).origin) for t, f in zip(times, floors, strict=True)]
    assert path(poses, floors) < 1e-4 * RADIUS


def test_what_parts_along_the_normal_does_not_count():
    lifted = Frame(np.eye(3), np.array([0.003, 0.0, RADIUS + 0.004]))
    assert mark(ball(0), FLOOR, np.zeros(3), UP).slid(lifted, FLOOR) == pytest.approx(0.003)
