"""Initial guesses: those of the hand's file, then seeded turns of them about the object."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scenes import SMALL, hand, oracle, posed

from sgnlp.hand.kinematics import frames
from sgnlp.planning.starts import initial, starts

FILE = len(hand().wrist_starts)


@pytest.fixture
def problem():
    return posed(SMALL)


def test_the_first_starts_are_those_of_the_file_from_the_middle_of_the_top_of_the_cloud(problem):
    top = [*problem.box.mean(axis=0)[:2], problem.box[1, 2]]
    for start, wrist in zip(starts(problem, FILE, 0), hand().wrist_starts, strict=True):
        np.testing.assert_allclose(start.wrist[:3], top + wrist.position, atol=1e-12)
        np.testing.assert_allclose(start.wrist[3:], wrist.quaternion)
        np.testing.assert_array_equal(start.joints, hand().reference)


@pytest.mark.parametrize("count", [0, 1, 3, FILE, FILE + 5])
def test_as_many_starts_come_back_as_are_asked_for(problem, count):
    assert [s.index for s in starts(problem, count, 0)] == list(range(count))


def test_the_seed_decides_the_starts_beyond_the_file_and_only_those(problem):
    a, b, c = (np.array([s.wrist for s in starts(problem, FILE + 6, seed)]) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(a[:FILE], c[:FILE])
    assert not np.isclose(a[FILE:], c[FILE:]).all(axis=1).any()


def test_more_starts_keep_the_first_ones(problem):
    few, many = starts(problem, FILE + 2, 3), starts(problem, FILE + 9, 3)
    for a, b in zip(few, many, strict=False):
        np.testing.assert_array_equal(a.wrist, b.wrist)


def test_a_seeded_start_is_one_of_the_file_turned_about_the_vertical_through_the_cloud(problem):
    centre = problem.box.mean(axis=0)
    every = starts(problem, FILE + 10, 4)
    for turned in every[FILE:]:
        pose, found = pin.XYZQUATToSE3(turned.wrist), []
        for original in every[:FILE]:
            there = pin.XYZQUATToSE3(original.wrist)
            turn = pose.rotation @ there.rotation.T
            around_z = np.allclose(turn @ [0, 0, 1], [0, 0, 1], atol=1e-9)
            arm = turn @ (there.translation - centre)
            found.append(around_z and np.allclose(arm, pose.translation - centre, atol=1e-9))
        assert any(found)


def likeness(wrist: np.ndarray, centre: np.ndarray) -> tuple[float, ...]:
    """What a turn about the vertical leaves of a pose: height, distance from the axis, the vertical seen from it."""
    pose = pin.XYZQUATToSE3(wrist)
    x, y, z = pose.translation - centre
    return tuple(np.round([z, np.hypot(x, y), *pose.rotation[2]], 6) + 0.0)


def test_seeded_starts_are_turns_of_all_those_of_the_file_all_around(problem):
    centre = problem.box.mean(axis=0)
    every = starts(problem, FILE + 80, 0)
    file, seeded = ([likeness(start.wrist, centre) for start in some] for some in (every[:FILE], every[FILE:]))
    assert set(seeded) == set(file)
    assert len(set(file)) >= FILE - 1  # two of them are mirror images
    headings = [np.arctan2(*(start.wrist[:2] - centre[:2])[::-1]) for start in every]
    once = {like: headings[i] for i, like in enumerate(file) if file.count(like) == 1}
    yaws = [h - once[like] for h, like in zip(headings[FILE:], seeded, strict=True) if like in once]
    counts, _ = np.histogram(np.mod(yaws, 2 * np.pi), bins=4, range=(0, 2 * np.pi))
    assert counts.min() >= 6


def test_targets_beyond_the_cube_in_the_models_ball_begin_on_its_faces(problem):
    small = replace(problem, gpis=replace(problem.gpis, radius=0.05))
    side = 0.05 / np.sqrt(3)
    outside = 0
    for start in starts(small, FILE, 0):
        tips, _ = frames(hand(), start.wrist, start.joints)
        for target, offset in zip(start.targets, (tips + tips.mean(axis=0)) / 2 - small.gpis.centre, strict=True):
            nearest = [max(-side, min(side, x)) for x in offset]
            np.testing.assert_allclose(target - small.gpis.centre, nearest, atol=1e-12)
            outside += max(abs(offset)) > side
    assert outside > 0


def test_targets_lie_halfway_from_the_tips_to_their_middle_and_inside_the_models_ball(problem):
    for start in starts(problem, FILE, 0):
        tips, _ = frames(hand(), start.wrist, start.joints)
        halfway = (tips + tips.mean(axis=0)) / 2
        inside = np.abs(halfway - problem.gpis.centre).max(axis=1) < problem.gpis.radius / np.sqrt(3)
        assert inside.any()
        np.testing.assert_allclose(start.targets[inside], halfway[inside], atol=1e-12)
        assert (np.linalg.norm(start.targets - problem.gpis.centre, axis=1) <= problem.gpis.radius * (1 + 1e-9)).all()


def test_gains_are_those_of_the_file_within_the_limits(problem):
    start = starts(problem, 1, 0)[0]
    np.testing.assert_array_equal(start.gains, np.clip(hand().gain_initial, 100.0, 400.0))
    wide = replace(problem, settings=replace(SMALL, limits=replace(SMALL.limits, gain_min=1.0)))
    np.testing.assert_array_equal(starts(wide, 1, 0)[0].gains, hand().gain_initial)


def test_the_scaled_variables_of_a_start_stand_for_it(problem):
    nlp = oracle(SMALL, "penalty").nlp
    for start in starts(problem, FILE, 0):
        x = initial(nlp, start)
        p = problem.parameters(nlp, start.wrist, start.joints)
        Z, m = np.array(nlp.points(x, p)[0]), len(hand().fingers)
        tips, spheres = frames(hand(), start.wrist, start.joints)
        np.testing.assert_allclose(Z[-m:], start.targets, atol=1e-12)
        np.testing.assert_allclose(Z[:m], start.targets + 0.7 * (tips - start.targets), atol=1e-12)
        np.testing.assert_allclose(Z[-m - len(spheres) : -m], spheres, atol=1e-12)
        low, high = problem.variable_bounds(nlp, start.joints)
        assert (x >= low - 1e-12).all()
        assert (x <= high + 1e-12).all()
