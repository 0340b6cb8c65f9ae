"""A command is one of the planned grasps."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from commands import aimed

from sgnlp.base.errors import InputError
from sgnlp.control import Controller, command
from sgnlp.control.command import ARRAYS
from sgnlp.hand.hand import load_hand

LEFT = load_hand("allegro_left")
OWN = tuple(name for name in ARRAYS if name != "tips")
DEFAULTS: dict[str, Any] = {"settings": {}}


def planned(count: int, meta: dict[str, Any] = DEFAULTS) -> SimpleNamespace:
    """Grasps whose arrays (count, 2) all differ."""
    names = (*OWN, "tips_pregrasp")
    rows = {name: np.arange(2.0 * count).reshape(count, 2) + 100 * i for i, name in enumerate(names)}
    return SimpleNamespace(**rows, joint_names=np.array(["a", "b"]), meta=meta)


def test_a_command_is_the_grasp_of_its_rank():
    closing = {"seconds": 0.5, "posture": 0.2, "joint_stiffness": 3.0}
    grasps = planned(3, {"settings": {"closing": closing}})
    for rank in range(3):
        told = command(grasps, rank)
        for name in OWN:
            np.testing.assert_array_equal(getattr(told, name), getattr(grasps, name)[rank])
        np.testing.assert_array_equal(told.tips, grasps.tips_pregrasp[rank])
        assert (told.closing_seconds, told.posture, told.joint_stiffness) == (0.5, 0.2, 3.0)
        assert told.joint_names == ("a", "b")
    np.testing.assert_array_equal(command(grasps).wrist, command(grasps, 0).wrist)


def test_a_result_without_settings_of_closing_gives_a_command_with_the_default_ones():
    told = command(planned(1))
    assert (told.closing_seconds, told.posture, told.joint_stiffness) == (1.0, 0.1, 1.0)


@pytest.mark.parametrize(
    ("count", "rank", "message"),
    [
        (2, 9, "no grasp of rank 9: the result has 2 grasps, of ranks 0 to 1"),
        (2, -1, "no grasp of rank -1"),
        (1, 1.0, "no grasp of rank 1.0: the result has 1 grasp, "),
        (0, 0, "no grasp of rank 0: the result has 0 grasps$"),
    ],
)
def test_a_rank_that_no_grasp_has_is_refused_with_their_number(count, rank, message):
    with pytest.raises(InputError, match=message):
        command(planned(count), rank)


@pytest.mark.parametrize("plan", [SimpleNamespace(best=None), None])
def test_a_plan_is_no_grasps_and_is_refused_with_what_is(plan):
    with pytest.raises(InputError, match=r"command takes sgnlp.load_grasps\(folder\) or plan.arrays\(\)"):
        command(plan)


def test_a_grasp_that_was_planned_for_the_other_hand_is_refused():
    told = aimed(LEFT, joint_names=LEFT.joint_names)
    Controller(LEFT, told)
    with pytest.raises(InputError, match=r"another hand than 'allegro_right': a tip is \d+ mm off"):
        Controller(load_hand("allegro_right"), told)


def test_a_grasp_whose_joints_are_in_another_order_is_refused_with_the_valid_one():
    told = aimed(LEFT, joint_names=LEFT.joint_names[::-1])
    with pytest.raises(InputError, match=f"valid: {', '.join(LEFT.joint_names)}"):
        Controller(LEFT, told)


@pytest.mark.parametrize("name", ["closing_seconds", "posture", "joint_stiffness"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf, None, "1"])
def test_a_time_or_stiffness_that_makes_no_sense_is_refused(name, value):
    with pytest.raises(InputError, match=f"the grasp's {name} must be a finite number and not negative"):
        Controller(LEFT, aimed(LEFT, **{name: value}))


def test_targets_in_another_unit_or_frame_than_the_tips_are_refused():
    told = aimed(LEFT)
    with pytest.raises(InputError, match=r"a target is .* m from its tip, more than 1 m; are both in metres"):
        Controller(LEFT, replace(told, targets=1e3 * told.targets))


def test_lists_in_a_command_are_taken_for_arrays_and_what_holds_no_numbers_is_refused():
    told = aimed(LEFT)
    listed = replace(told, **{name: getattr(told, name).tolist() for name in ARRAYS[:7]})
    state = (0.2, told.wrist, told.joints, 0.1 * told.joints)
    np.testing.assert_array_equal(Controller(LEFT, listed).torques(*state), Controller(LEFT, told).torques(*state))
    with pytest.raises(InputError, match="the grasp's joints must be an array of numbers"):
        replace(told, joints=["thumb"])
    with pytest.raises(InputError, match="the grasp's gains must be an array of numbers"):
        replace(told, gains=[[1.0], [1.0, 2.0]])


@pytest.mark.parametrize("wrist", [np.zeros(7), np.full(7, 0.7)])
def test_a_wrist_without_an_orientation_is_refused(wrist):
    with pytest.raises(InputError, match=r"the grasp's wrist must be .* unit quaternion"):
        Controller(LEFT, aimed(LEFT, wrist=wrist))
