"""Starts of hands with few joints: the wrist stands where the closing fingers meet the object and can hold it."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scenes import observation, sphere_points

from sgnlp.base.presets import ROBUST
from sgnlp.hand.hand import load_hand
from sgnlp.hand.kinematics import frames, tips
from sgnlp.hand.opening import ORIGIN
from sgnlp.perception.shape import Shape
from sgnlp.planning.placing.balance import balance
from sgnlp.planning.placing.closing import CLOSED, OPENED, closing, nudged
from sgnlp.planning.placing.placed import chooses
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.starts import starts
from sgnlp.planning.surroundings import NOWHERE, Surroundings

FEW = "dlr_hit_right"
"""A hand of five fingers with three motors each."""


@lru_cache
def posed(hand: str = FEW, around: Surroundings = NOWHERE, arm: str | None = None) -> Problem:
    return build_problem(observation(), load_hand(hand, ROBUST.spheres, arm), ROBUST, surroundings=around)


def contacts(problem: Problem, start) -> np.ndarray:
    ends = tips(problem.hand, start.wrist, start.joints)
    return start.targets + problem.settings.contact.c * (ends - start.targets)


def test_a_hand_with_four_joints_for_each_finger_keeps_the_starts_of_its_file():
    problem = posed("allegro_left")
    assert not chooses(problem)
    centre, extents = problem.box.mean(axis=0), problem.box[1] - problem.box[0]
    for start, wrist in zip(starts(problem, 7, 0), problem.hand.wrist_starts, strict=True):
        np.testing.assert_array_equal(start.wrist, wrist.pose(centre, extents))


def test_only_where_the_hand_at_contact_is_planned_and_no_arm_carries_it_are_starts_chosen():
    assert chooses(posed())
    assert not chooses(posed(arm="panda"))
    pregrasp = replace(ROBUST, closing=replace(ROBUST.closing, planned=False))
    assert not chooses(replace(posed(), settings=pregrasp))


def test_at_the_chosen_starts_most_pads_touch_the_object_and_no_link_does():
    problem = posed()
    hand, radii = problem.hand, np.array([sphere.radius for sphere in problem.hand.spheres])
    links = np.delete(np.arange(len(radii)), hand.tip_spheres)
    gaps, clear = [], []
    for start in starts(problem, 7, 0):
        gaps.append(abs(problem.gpis.distance(contacts(problem, start)) - hand.tip_radii))
        spheres = frames(hand, start.wrist, start.joints)[1][links]
        clear.append((problem.gpis.distance(spheres) - radii[links]).min())
        assert (start.joints >= hand.lower).all()
        assert (start.joints <= hand.upper).all()
    assert np.median(gaps) < 0.002
    assert np.median(clear) > 0.005


def test_the_seed_decides_the_chosen_starts_and_more_of_them_keep_the_first():
    few, again, other = starts(posed(), 2, 0), starts(posed(), 4, 0), starts(posed(), 2, 1)
    for a, b, c in zip(few, again, other, strict=False):
        np.testing.assert_array_equal(a.wrist, b.wrist)
        np.testing.assert_array_equal(a.joints, b.joints)
        assert not np.allclose(a.wrist, c.wrist)


def test_a_start_is_chosen_with_its_contacts_off_a_region_to_avoid():
    plain = contacts(posed(), starts(posed(), 1, 0)[0])
    kept = posed(around=Surroundings(avoid=(Shape.sphere(plain[-1], 0.02),)))
    distances = kept.fields.avoid.distance(contacts(kept, starts(kept, 1, 0)[0]))
    assert kept.fields.avoid.distance(plain).min() == pytest.approx(-0.02)
    assert distances.min() > -0.005


def test_the_way_of_a_hand_goes_from_the_widest_posture_to_a_closed_one_through_the_reference():
    hand, way = load_hand(FEW), closing(load_hand(FEW))
    assert len(way.joints) == OPENED + 1 + CLOSED
    np.testing.assert_array_equal(way.joints[OPENED], hand.reference)
    away = np.linalg.norm(way.tips - way.middle, axis=2).mean(axis=1)
    assert (np.diff(away[: OPENED + 1]) < 0).all()
    assert away[-1] < 0.6 * away[OPENED]


@pytest.mark.parametrize(("hand", "most"), [(FEW, (3, 3, 3, 3, 3)), ("dex3_right", (2, 2, 3))])
def test_the_spans_are_projections_on_no_more_directions_than_a_finger_has_motors(hand, most):
    way = closing(load_hand(hand))
    np.testing.assert_allclose(way.spans @ way.spans, way.spans, atol=1e-12)
    sizes = np.trace(way.spans, axis1=2, axis2=3)
    assert (sizes >= 1 - 1e-9).all()
    assert (sizes <= np.array(most) + 1e-9).all()


def test_fingers_at_the_same_place_give_the_posture_of_that_place_and_one_ahead_moves_alone():
    hand, way = load_hand(FEW), closing(load_hand(FEW))
    at, ahead = np.full(5, 7.0), np.array([9.0, 7.0, 7.0, 7.0, 7.0])
    np.testing.assert_allclose(way.between(at), way.joints[7], atol=1e-12)
    moved = way.between(ahead) - way.joints[7]
    assert {name.split("_")[0] for name, step in zip(hand.joint_names, moved, strict=True) if step} == {"index"}


def test_a_nudge_brings_the_tips_to_points_within_reach():
    hand = load_hand(FEW)
    wanted = tips(hand, ORIGIN, hand.reference) + 0.004 * sphere_points(5, 0)
    found = nudged(hand, ORIGIN, hand.reference, wanted)
    assert np.linalg.norm(tips(hand, ORIGIN, found) - wanted, axis=1).max() < 1e-3


def around(angles_deg: list[float]) -> np.ndarray:
    """Normals (1, m, 3) of contacts around a vertical cylinder."""
    angles = np.radians(angles_deg)
    return np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)[None]


BOUNDS = np.array([4.0, 10.0])
FREE = np.tile(np.eye(3), (1, 3, 1, 1))


def test_three_fingers_around_an_object_balance_its_weight_within_their_cones():
    normals = around([0, 120, 240])
    found = balance(0.03 * normals, normals, FREE, 0.6, BOUNDS, np.array([0, 0, 3.0]))
    assert found.left[0] < 0.05
    np.testing.assert_allclose(found.forces[0].sum(axis=0), [0, 0, 3.0], atol=0.05)
    sizes = np.linalg.norm(found.forces[0], axis=1)
    assert (-(found.forces * normals).sum(axis=2)[0] / sizes > 1 / np.hypot(1, 0.6)).all()


def test_fingers_on_one_side_balance_nothing_and_press_no_harder_than_they_may():
    normals = around([0, 20, 340])
    found = balance(0.03 * normals, normals, FREE, 0.6, BOUNDS, np.zeros(3))
    assert found.left[0] > 8.0
    assert (np.linalg.norm(found.forces[0], axis=1) <= 10.0 + 1e-9).all()
    assert (found.off == 0).all()


def test_a_finger_that_moves_along_one_line_presses_along_it_and_is_off_where_that_leaves_its_cone():
    normals, along = around([0, 120, 240]), np.array([np.cos(0.9), np.sin(0.9), 0.0])
    spans = FREE.copy()
    spans[0, 0] = np.outer(along, along)
    found = balance(0.03 * normals, normals, spans, 0.6, BOUNDS, np.zeros(3))
    np.testing.assert_allclose(np.cross(found.forces[0, 0], along), 0, atol=1e-9)
    assert found.off[0, 0] > 0.2
    assert (found.off[0, 1:] == 0).all()
