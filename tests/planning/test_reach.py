"""Which starts an arm can begin from: they hold the hand where they say, and those out of reach are told apart."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import CROWD, SMALL, impossible, observation, posed

from sgnlp.base.errors import InputError
from sgnlp.hand.arm_kinematics import wrist_pose
from sgnlp.hand.hand import load_hand
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.reach import OUT_OF_REACH, reachable, within_reach
from sgnlp.planning.solve import solve
from sgnlp.planning.starts import starts

LEAN = replace(SMALL, spheres="paper", solver=replace(SMALL.solver, formulation="penalty"))
"""Of one program, with few spheres."""


def on_arm(base: list[float], around=CROWD) -> Problem:
    """The ellipsoid, and a hand on a Panda that stands somewhere."""
    return build_problem(observation(), load_hand("allegro_left", "paper", "panda", base), SMALL, surroundings=around)


def test_a_hand_on_a_free_wrist_begins_at_the_first_starts():
    found, missed = reachable(posed(SMALL), 9, 3)
    assert missed == []
    for ours, theirs in zip(found, starts(posed(SMALL), 9, 3), strict=True):
        np.testing.assert_array_equal(ours.wrist, theirs.wrist)
        assert ours.arm is None


def test_each_start_holds_the_hand_where_the_arm_does_near_the_wrist_that_was_asked_for():
    problem = on_arm([-0.5, 0.0, 0.0])
    found, missed = reachable(problem, 8, 0)
    asked = {start.index: start for start in starts(problem, 48, 0)}
    assert len(found) == 8
    assert not {start.index for start in found} & set(missed)
    for start in found:
        np.testing.assert_allclose(wrist_pose(problem.hand.arm, start.arm), start.wrist, atol=1e-9)
        assert np.linalg.norm(start.wrist[:3] - asked[start.index].wrist[:3]) <= 0.08
        assert (start.arm >= problem.hand.arm.lower).all()
        assert (start.arm <= problem.hand.arm.upper).all()


def test_the_same_seed_gives_the_same_starts():
    first, second = (reachable(on_arm([-0.5, 0.0, 0.0]), 3, 1)[0] for _ in range(2))
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.arm, other.arm)


def test_an_arm_that_stands_too_far_reaches_nothing():
    problem = on_arm([-3.0, 0.0, 0.0])
    found, missed = reachable(problem, 2, 0)
    assert found == []
    assert missed == list(range(12))
    assert not within_reach(problem, 5, 0)
    assert within_reach(on_arm([-0.5, 0.0, 0.0]), 20, 0)


def test_starts_out_of_reach_are_failures_of_the_plan_with_their_reason():
    hand = load_hand("allegro_left", "paper", "panda", [-3.0, 0.0, 0.0])
    plan = solve(observation(), hand, LEAN, count=2, jobs=1)
    assert [failure.reason for failure in plan.failures] == [OUT_OF_REACH] * 2
    assert plan.solutions == ()
    assert len(plan.arrays().arm_joint_names) == 7
    assert plan.arrays().arm.shape == (0, 3, 7)


def test_an_arm_moves_with_a_cloud_that_lies_far_from_the_origin():
    seen, shift = observation(), np.array([1000.0, -500.0, 20.0])
    moved = replace(seen, points=seen.points + shift, table_height=seen.table_height + shift[2])
    hand = load_hand("allegro_left", "paper", "panda", (shift - np.array([0.5, 0.0, 0.0])).tolist())
    plan = solve(moved, hand, impossible(LEAN), count=1, jobs=1, rounds=1)
    (found,) = plan.solutions
    assert np.linalg.norm(found.wrist[:3] - shift) < 0.4
    error = next(check for check in found.checks if check.name == "wrist").value
    assert np.linalg.norm(wrist_pose(hand.arm, found.arm[0])[:3] - found.wrist[:3]) < 0.05 + abs(error)


def test_an_arm_that_stands_too_far_off_for_metres_is_refused_by_name():
    with pytest.raises(
        InputError, match=r"the base of the arm 'panda' is 550 m from the object, more than 10 m; is it"
    ):
        on_arm([-550, 0, 0])


def test_an_arm_that_stands_in_the_object_is_refused_and_one_beside_it_is_not():
    with pytest.raises(InputError, match=r"the arm 'panda' stands in \d+% of the object's points; is it in metres"):
        on_arm([0, 0, 0])
    on_arm([-0.3, 0, 0])
