"""A solution of a plan carried out: with the obstacles that it was planned for, on the arm that it was planned on."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from grips import box
from plans import small_plan

from sgnlp.hand.arm import load_arm, with_base
from sgnlp.hand.arm_inverse import reach_all
from sgnlp.hand.hand import on_arm
from sgnlp.perception.shape import Shape
from sgnlp.simulation import simulate
from sgnlp.simulation.route import route

CRATE = Shape.box([0.3, 0.0, 0.1], [0.1, 0.1, 0.2], name="crate")


@pytest.fixture
def asked(monkeypatch) -> list:
    """The arguments with which a grasp would be carried out."""
    told = []
    module = sys.modules["sgnlp.simulation.simulate"]
    monkeypatch.setattr(module, "execute", lambda *arguments: told.append(arguments))
    monkeypatch.setattr(module, "true_body", lambda observation: box())
    return told


def test_a_hand_that_floats_has_no_motion_and_the_obstacles_of_its_plan(asked):
    plan = small_plan()
    simulate(replace(plan.best, obstacles=(CRATE,)), plan.observation)
    (command, _, hand, _, obstacles, motion) = asked[0]
    np.testing.assert_array_equal(command.wrist, plan.best.wrist)
    assert (hand.arm, obstacles, motion) == (None, (CRATE,), None)


def test_a_hand_on_an_arm_has_the_motion_of_its_plan(asked):
    plan = small_plan()
    hand = on_arm(plan.problem.hand, with_base(load_arm("panda"), np.array([-0.5, 0, 0, 0, 0, 0, 1.0])))
    joints = reach_all(hand.arm, plan.best.wrist, 0, 20)[0]
    asked_for = replace(plan.best.motion, standoff=0.07, lift=0.04)
    simulate(replace(plan.best, hand=hand, arm=np.tile(joints, (3, 1)), motion=asked_for), plan.observation)
    (command, _, found, _, _, motion) = asked[0]
    way = route(motion, command, found)
    np.testing.assert_allclose(way.approach.end, joints, atol=1e-12)
    ends = [motion.wrist[0, :3] - command.wrist[:3], motion.wrist[-1, :3] - command.wrist[:3]]
    assert np.linalg.norm(ends[0]) == pytest.approx(0.07)
    np.testing.assert_allclose(ends[1], [0, 0, 0.04], atol=1e-12)
