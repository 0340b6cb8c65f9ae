"""Cameras and obstacles in another unit or frame than the points are refused."""

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.perception.observation import observe
from sgnlp.perception.plausible import check_cameras, check_obstacles

POINTS = np.random.default_rng(0).uniform([-0.05, -0.05, 0.0], [0.05, 0.05, 0.1], (500, 3))
"""A cloud of 10 cm on a table at height 0."""


def test_cameras_half_a_metre_away_and_none_at_all_are_taken():
    assert check_cameras(np.array([[0.3, 0.0, 0.4], [-0.3, 0.2, 0.5]]), POINTS, 0.0) == []
    assert check_cameras(None, POINTS, 0.0) == []


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ([0.0, 0.0, 0.05], "mm from the cloud, nearer than 70 mm"),
        ([0.0, 0.0, 0.16], "mm from the cloud, nearer than 70 mm"),
        ([300.0, 0.0, 400.0], "499.9 m from the cloud, more than the 5 m that depth cameras measure"),
        ([3.0, 0.0, 4.5], "5.3 m from the cloud, more than the 5 m"),
        ([0.5, 0.0, 0.004], "4.0 mm above the table, less than the 10 mm of its housing"),
        ([0.3, 0.0, -0.1], "below the table"),
    ],
)
def test_a_camera_in_the_cloud_far_from_it_or_below_the_table_is_refused(place, said):
    with pytest.raises(InputError, match=said):
        check_cameras(np.array([[0.3, 0.0, 0.4], place]), POINTS, 0.0)


@pytest.mark.parametrize(("place", "away"), [([3.0, 0.0, 3.0], "4.1"), ([0.0, 0.0, 0.22], "0.12")])
def test_a_camera_at_an_unusual_distance_is_noted_also_by_what_observes(place, away):
    (said,) = check_cameras(np.array([[0.3, 0.0, 0.4], place]), POINTS, 0.0)
    assert said.startswith(f"A camera is {away} m from the cloud, not 0.2 to 1.5 m as usual")
    assert said in observe(POINTS, camera_positions=[place], table_height=0.0).notes


def test_obstacles_beside_the_object_and_some_of_its_points_among_them_are_taken():
    check_obstacles(np.vstack([POINTS[:100], np.add(POINTS, [0.2, 0.0, 0.0])]), POINTS)
    check_obstacles(np.zeros((0, 3)), POINTS)
    check_obstacles(None, POINTS)


@pytest.mark.parametrize(
    ("obstacles", "said"),
    [
        (1e3 * POINTS + 2e4, "from the object, more than 10 m"),
        (POINTS, "100% of the object's own"),
        (POINTS + np.random.default_rng(0).normal(0, 1e-4, POINTS.shape), "100% of the object's own"),
        (np.vstack([POINTS.round(3), np.add(POINTS, 0.2)]), "of the object's own points; leave those out"),
        (POINTS[:40] + 5e-4, "100% of their points on the object"),
    ],
)
def test_obstacles_in_another_unit_or_the_object_itself_are_refused(obstacles, said):
    with pytest.raises(InputError, match=said):
        check_obstacles(obstacles, POINTS)
