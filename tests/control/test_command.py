"""A command is one of the planned grasps."""

from types import SimpleNamespace

import numpy as np

from sgnlp.control.command import command


def test_a_command_is_the_grasp_of_its_rank():
    own = ("wrist", "joints", "targets", "gains", "contacts_eq", "forces_eq", "rotation_eq", "translation_eq")
    grasps = SimpleNamespace(**{name: [f"{name} {rank}" for rank in range(3)] for name in own})
    grasps.tips_pregrasp = ["tips 0", "tips 1", "tips 2"]
    grasps.joints_contact, grasps.joints_squeeze = np.arange(6.0).reshape(3, 2), np.arange(6.0, 12.0).reshape(3, 2)
    grasps.meta = {"settings": {"closing": {"seconds": 0.5, "posture": 0.2, "joint_stiffness": 3.0}}}
    for rank in range(3):
        told = command(grasps, rank)
        names = (*own, "tips")
        assert [getattr(told, name) for name in names] == [f"{name} {rank}" for name in names]
        np.testing.assert_array_equal(told.joints_contact, [2 * rank, 2 * rank + 1])
        np.testing.assert_array_equal(told.joints_squeeze, [2 * rank + 6, 2 * rank + 7])
        assert (told.closing_seconds, told.posture, told.joint_stiffness) == (0.5, 0.2, 3.0)
    assert command(grasps).wrist == "wrist 0"


def test_a_command_carries_the_joints_of_its_grasp_and_a_result_without_settings_of_closing_the_default_ones():
    names = ("wrist", "joints", "targets", "gains", "contacts_eq", "forces_eq", "rotation_eq", "translation_eq")
    grasps = SimpleNamespace(**{name: [0] for name in (*names, "tips_pregrasp")}, meta={"settings": {}})
    grasps.joints_contact, grasps.joints_squeeze = [1], [2]
    told = command(grasps)
    assert (told.joints_contact, told.joints_squeeze) == (1, 2)
    assert (told.closing_seconds, told.posture, told.joint_stiffness) == (1.0, 0.1, 1.0)
