"""What a camera saw around the object as boxes: they cover it, leave the object free, and are few."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sgnlp.perception.clutter import INFLATION, boxes, seen_shapes, upright_box
from sgnlp.perception.observation import observe
from sgnlp.surface.shape_field import ShapeField

NOTHING = np.empty((0, 3))


def wall(low, high, count: int = 400, seed: int = 0) -> np.ndarray:
    """Points spread evenly in a box."""
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


def turned(points: np.ndarray, yaw: float) -> np.ndarray:
    c, s = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@settings(max_examples=30, deadline=None, derandomize=True)
@given(yaw=st.floats(-3.1, 3.1), seed=st.integers(0, 1000))
def test_every_point_is_inside_its_boxes(yaw, seed):
    points = turned(wall([0.0, 0.0, 0.0], [0.2, 0.05, 0.1], 50, seed), yaw)
    assert ShapeField(boxes(points, 0.0, NOTHING, "box")).distance(points).max() <= -INFLATION + 1e-9


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.2])
def test_a_box_on_the_table_gets_one_box_of_its_size(yaw):
    points = turned(wall([-0.1, -0.03, 0.005], [0.1, 0.03, 0.12], 3000), yaw)
    (found,) = boxes(points, 0.0, NOTHING, "box")
    np.testing.assert_allclose(sorted(2 * found.half[:2]), [0.06, 0.2], atol=4e-3)
    assert found.centre[2] - found.half[2] == pytest.approx(0.0, abs=1e-9)
    assert found.centre[2] + found.half[2] == pytest.approx(0.12, abs=2e-3)
    assert found.radius == INFLATION


def test_what_hangs_in_the_air_leaves_what_is_below_it_free():
    found = upright_box(wall([0.0, 0.0, 0.3], [0.1, 0.1, 0.32]), 0.0, "shelf")
    assert found.distance(np.array([[0.05, 0.05, 0.1]]))[0] > 0.19


def test_two_walls_leave_their_inner_corner_free():
    corner = np.vstack([wall([0.0, 0.0, 0.0], [0.3, 0.02, 0.2]), wall([0.0, 0.0, 0.0], [0.02, 0.3, 0.2], seed=1)])
    found = boxes(corner, 0.0, NOTHING, "walls")
    assert 2 <= len(found) <= 16
    assert ShapeField(found).distance(np.array([[0.15, 0.15, 0.1]]))[0] > 0.05


def test_a_ring_around_the_object_is_parted_until_the_object_is_free():
    angles = np.random.default_rng(0).uniform(0, 2 * np.pi, 2000)
    ring = np.column_stack([0.2 * np.cos(angles), 0.2 * np.sin(angles), 0.1 * np.random.default_rng(1).random(2000)])
    thing = wall([-0.03, -0.03, 0.0], [0.03, 0.03, 0.1], 200)
    found = ShapeField(boxes(ring, 0.0, thing, "ring"))
    assert found.distance(thing).min() > 0.05


def test_few_points_on_a_line_make_a_thin_box():
    found = upright_box(np.array([[0.0, 0.0, 0.1], [0.1, 0.1, 0.1]]), 0.0, "rod")
    np.testing.assert_allclose(sorted(2 * found.half)[:1], [0.002], atol=1e-9)
    assert found.distance(np.array([[0.05, 0.05, 0.1]]))[0] < 0


def test_shapes_of_an_observation_are_named_by_the_numbers_of_its_obstacles():
    rng = np.random.default_rng(0)
    cube = rng.uniform([-0.03, -0.03, 0.0], [0.03, 0.03, 0.06], (800, 3))
    beside = np.vstack([wall([0.1, 0.0, 0.0], [0.15, 0.1, 0.1]), wall([-0.2, 0.0, 0.0], [-0.1, 0.1, 0.1])])
    number = np.repeat([0, 3], 400)
    seen = observe(cube, table_height=0.0, obstacle_points=beside, obstacle=number)
    assert {shape.name for shape in seen_shapes(seen)} == {"what is around", "obstacle 3"}
    assert seen_shapes(observe(cube, table_height=0.0)) == ()


def test_the_inside_of_a_thing_whose_skin_was_seen_is_not_free():
    front, top = wall([0.0, 0.0, 0.0], [0.001, 0.1, 0.1]), wall([0.0, 0.0, 0.099], [0.1, 0.1, 0.1], seed=1)
    inside = wall([0.01, 0.01, 0.01], [0.09, 0.09, 0.09], 200, 2)
    assert ShapeField(boxes(np.vstack([front, top]), 0.0, NOTHING, "box")).distance(inside).max() < 0
