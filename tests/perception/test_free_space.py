"""What cameras saw to be free: in front of the object and beside it, never in it or behind it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import sphere_points
from views import EYES, MIDDLE, RADIUS, ball_seen

from sgnlp.perception.free_space import CLOSED, FRONT, background, doubt, free, sight, sights

EYE = EYES[0]


def along(eye, offsets):
    """Points (n, 3) on the ray from the eye through the ball's middle, `offsets` (n,) [m] behind it."""
    ahead = (MIDDLE - eye) / np.linalg.norm(MIDDLE - eye)
    return MIDDLE + np.asarray(offsets)[:, None] * ahead


def test_free_is_what_is_in_front_of_the_ball_and_not_what_is_in_it_or_behind_it():
    offsets = [-0.2, -RADIUS - 2 * FRONT, -RADIUS, 0.0, RADIUS, 0.2]
    seen = sight(EYE, ball_seen(EYE)).free(along(EYE, offsets))
    assert seen.tolist() == [True, True, False, False, False, False]


def test_free_is_what_is_beside_the_ball_at_any_distance():
    side = np.cross(MIDDLE - EYE, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    beside = MIDDLE + np.outer([0.06, 0.1, 1.0, -0.06, -1.0], side)
    assert sight(EYE, ball_seen(EYE)).free(beside).all()


def test_what_is_behind_the_camera_is_not_free():
    assert not sight(EYE, ball_seen(EYE)).free(EYE + (EYE - MIDDLE) * [[0.1], [1.0]]).any()


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.floats(0, 2 * np.pi),
    st.floats(0.2, 1.4),
    st.floats(0.3, 1.5),
    st.integers(0, 10**6),
    st.sampled_from([300, 1000, 5000]),
)
def test_no_camera_sees_through_the_ball_and_hardly_one_with_few_points(azimuth, elevation, distance, seed, count):
    flat = np.cos(elevation)
    eye = MIDDLE + distance * np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])
    points = ball_seen(eye, count, seed)
    inside = MIDDLE + 0.98 * RADIUS * sphere_points(2000, seed) * np.random.default_rng(seed).random((2000, 1))
    seen = sight(eye, points).free(inside)
    assert seen.mean() <= (0.01 if count == 300 else 0.0)


def test_a_block_of_pixels_without_return_opens_no_hole():
    points = ball_seen(EYE, 20000)
    front = along(EYE, [-RADIUS])[0]
    holed = points[np.linalg.norm(points - front, axis=1) > 0.8 * CLOSED]
    assert len(holed) < len(points) - 20
    assert not sight(EYE, holed).free(along(EYE, [-RADIUS + 0.002, 0.0, 0.05])).any()


def test_a_part_that_only_another_camera_measured_is_not_free():
    points = ball_seen(EYE)
    lower = points[:, 2] < RADIUS
    missed = MIDDLE + 0.95 * (points[lower] - MIDDLE)
    assert sight(EYE, points[~lower]).free(missed).mean() > 0.3
    assert sight(EYE, points[~lower], others=points[lower]).free(missed).mean() < 0.01


def wall(gap=None):
    """Points of a wall behind the ball, seen from the eye; none where `gap` (n, 3) -> (n,) says so."""
    middle = along(EYE, [0.3])[0]
    ahead = (MIDDLE - EYE) / np.linalg.norm(MIDDLE - EYE)
    right = np.cross(ahead, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    u = np.linspace(-0.25, 0.25, 400)
    points = middle + (u[:, None, None] * right + u[None, :, None] * np.cross(ahead, right)).reshape(-1, 3)
    return points if gap is None else points[~gap(points)], right


def test_with_a_background_free_is_what_is_in_front_of_it_and_not_what_returned_nothing():
    behind, right = wall()
    seen = sight(EYE, ball_seen(EYE), background=behind)
    beside = MIDDLE + 0.08 * right
    ray = (beside - EYE) / np.linalg.norm(beside - EYE)
    assert seen.free(np.array([beside, beside + 0.15 * ray])).all()
    assert not seen.free((beside + 0.4 * ray)[None]).any()  # behind the wall
    silent, _ = wall(lambda points: (points - along(EYE, [0.3])[0]) @ right > 0)
    half = sight(EYE, ball_seen(EYE), background=silent)
    assert not half.free(beside[None]).any()
    assert half.free((MIDDLE - 0.08 * right)[None]).all()


def test_what_stands_before_the_object_ends_the_free_space():
    _, right = wall()
    beside = MIDDLE + 0.08 * right
    ray = (beside - EYE) / np.linalg.norm(beside - EYE)
    occluder = beside - 0.2 * ray + 0.02 * sphere_points(4000, 0)
    seen = sight(EYE, ball_seen(EYE), background=np.concatenate([wall()[0], occluder]))
    assert seen.free((beside - 0.3 * ray)[None]).all()
    assert not seen.free(beside[None]).any()


def test_a_background_of_one_point_a_cell_tells_the_same():
    behind, right = wall()
    points = ball_seen(EYE)
    few = background(EYE, points, np.concatenate([behind, behind + 1e-4, along(EYE, [-1.0, -0.7])]))
    assert len(few) < 0.5 * len(behind)
    places = MIDDLE + 0.12 * sphere_points(500, 3)
    every, thinned = (sight(EYE, points, background=some) for some in (behind, few))
    assert (every.free(places) == thinned.free(places)).mean() > 0.99
    assert thinned.free(MIDDLE + np.outer([0.07, 0.1, 0.13], right)).all()


def test_one_camera_that_saw_through_is_enough():
    views = [ball_seen(eye) for eye in EYES]
    both = sights(np.concatenate(views), np.repeat([0, 1], [len(v) for v in views]), EYES)
    behind = along(EYES[0], [0.12])
    assert not both[0].free(behind).any()
    assert both[1].free(behind).all()
    assert free(both, behind).all()
    assert not free((), behind).any()


def test_a_camera_with_a_few_points_has_no_sight():
    points = ball_seen(EYE)[:5]
    assert sights(points, np.zeros(5, int), EYE[None]) == ()


@pytest.mark.parametrize("turned", [90, 180])
def test_cameras_that_stood_elsewhere_are_doubted(turned):
    views = [ball_seen(eye) for eye in EYES]
    points, view = np.concatenate(views), np.repeat([0, 1], [len(v) for v in views])
    assert doubt(sights(points, view, EYES)) == ""
    a = np.radians(turned)
    R = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    assert "camera 0" in doubt(sights(points, view, np.stack([R @ EYES[0], EYES[1]])))


def test_a_camera_beside_what_it_saw_is_doubted_by_its_own_points():
    points = ball_seen(EYE)
    alone = np.zeros(len(points), int)
    assert doubt(sights(points, alone, EYE[None])) == ""
    beside = MIDDLE + np.cross(EYE - MIDDLE, [0, 0, 1.0])
    assert "hide behind others" in doubt(sights(points, alone, beside[None]))
