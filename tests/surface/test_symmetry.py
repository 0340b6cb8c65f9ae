"""The hidden side, guessed by half a turn: the axis of round bodies, its cost in other words, a better guess."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from views import BOX, EYES, MIDDLE, RADIUS, ball, box_seen

from sgnlp.base.surface_settings import FreeSpace, GpisSettings
from sgnlp.perception.free_space import free
from sgnlp.perception.observation import observe
from sgnlp.surface.gpis import fit
from sgnlp.surface.hull import cameras_of
from sgnlp.surface.symmetry import APART, FRONT, NARROW, axis, cost, half_turn, hidden_side
from sgnlp.surface.training import training_set

GPIS, ALONE = GpisSettings(), EYES[:1]


def box(eye):
    """A box seen by one camera."""
    points = box_seen(eye)
    return observe(points, view=np.zeros(len(points), int), camera_positions=eye[None], table_height=0.0, name="box")


@given(st.integers(0, 2**32 - 1))
def test_half_a_turn_is_that_of_a_rotation_and_two_are_none(seed):
    rng = np.random.default_rng(seed)
    points, about = rng.normal(size=(7, 3)), rng.normal(size=(4, 2))
    pole = np.pad(about, ((0, 0), (0, 1)))[:, None]
    turned = half_turn(points, about[:, None])
    np.testing.assert_allclose(turned, (points - pole) @ np.diag([-1.0, -1, 1]) + pole, atol=1e-12)
    np.testing.assert_allclose(half_turn(turned, about[:, None]), np.broadcast_to(points, (4, 7, 3)), atol=1e-12)


def test_the_cost_is_the_share_of_free_points_and_the_width_of_the_whole():
    seen = ball(ALONE)
    sights, points = cameras_of(seen), seen.points[::40]
    for about in ([0.0, 0.0], [0.03, -0.02], [-0.06, 0.05]):
        turned = half_turn(points, np.array(about))
        share = np.mean([free(sights, point[None], FRONT)[0] for point in turned])
        part, whole = (
            np.cov(xy[:, :2].T, bias=True) + FRONT**2 * np.eye(2) for xy in (points, np.concatenate([points, turned]))
        )
        width = (np.linalg.det(whole) / np.linalg.det(part)) ** 0.25
        found = cost(np.array([about]), points, sights)
        assert found == pytest.approx(share + NARROW * width, rel=0.01)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.4, -0.7, 0.2)])
def test_the_axis_of_a_ball_and_a_box_is_theirs(place):
    for body, within in ((ball(ALONE), 0.005), (box(np.array([0.5, 0.3, 0.4])), 0.005)):
        there = replace(body, points=body.points + place, camera_positions=body.camera_positions + place)
        np.testing.assert_allclose(axis(there.points, cameras_of(there), 0), place[:2], atol=within)


def test_points_of_the_hidden_side_lie_on_the_ball_where_no_camera_saw_it():
    seen = ball(ALONE)
    hidden = hidden_side(seen.points, cameras_of(seen), 0)
    assert len(hidden) > 300
    assert np.abs(np.linalg.norm(hidden - MIDDLE, axis=1) - RADIUS).max() < 0.009
    assert not free(cameras_of(seen), hidden).any()
    apart = np.linalg.norm(hidden[:, None] - seen.points, axis=2).min(axis=1)
    assert apart.min() > APART
    facing = ((ALONE[0] - hidden) * (hidden - MIDDLE)).sum(axis=1) > 0
    assert facing.mean() < 0.1


def with_handle(count):
    """The ball with a handle of so many points, seen by one camera, from the side."""
    seen = ball(ALONE)
    side = np.array([-ALONE[0, 1], ALONE[0, 0], 0.0]) / np.linalg.norm(ALONE[0, :2])
    handle = MIDDLE + np.linspace(RADIUS, RADIUS + 0.03, count)[:, None] * side
    return observe(np.concatenate([seen.points, handle]), camera_positions=ALONE, table_height=0.0, name="mug")


def test_a_handle_is_not_guessed_where_a_camera_saw_none():
    mug = with_handle(30)
    points, sights = mug.points, cameras_of(mug)
    hidden = hidden_side(points, sights, 0)
    assert free(sights, half_turn(points, axis(points, sights, 0))).sum() > 10
    assert len(hidden) > 300
    assert not free(sights, hidden).any()


def test_nothing_is_guessed_of_what_is_not_symmetric():
    mug = with_handle(300)
    assert len(hidden_side(mug.points, cameras_of(mug), 0)) == 0


def test_what_was_seen_all_around_has_no_hidden_side():
    eyes = np.array([[0.5 * np.cos(a), 0.5 * np.sin(a), z] for a in np.arange(4) * np.pi / 2 for z in (0.05, 0.4)])
    seen = ball(eyes)
    assert len(hidden_side(seen.points, cameras_of(seen), 0)) < 0.02 * len(seen.points)


def test_the_guessed_side_is_nearer_to_the_truth_with_the_symmetry():
    seen = box(np.array([0.5, 0.1, 0.35]))
    y, z = np.meshgrid(np.linspace(-0.02, 0.02, 9), np.linspace(0.02, 0.08, 9))
    hidden = np.stack([np.full(81, -BOX[0] / 2), y.ravel(), z.ravel()], axis=1)
    settings = FreeSpace(used=True)
    without, with_it = (
        np.abs(fit(training_set(seen, GPIS, 0, free_space=changed)).distance(hidden)).mean()
        for changed in (replace(settings, symmetry_points=0), settings)
    )
    assert with_it < 0.5 * without


def test_the_training_set_ends_with_the_points_of_the_hidden_side():
    settings = FreeSpace(used=True)
    t, without = (
        training_set(ball(ALONE), GPIS, 0, free_space=replace(settings, symmetry_points=count))
        for count in (settings.symmetry_points, 0)
    )
    guessed = slice(len(without.X), None)
    np.testing.assert_array_equal(t.X[: len(without.X)], without.X)
    assert len(t.X[guessed]) == settings.symmetry_points
    assert (t.y[guessed] == 0).all()
    assert np.unique(t.noise[guessed]).tolist() == [settings.symmetry_noise]
