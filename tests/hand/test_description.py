"""A description of a hand, however its file says it: cut to the part below a link, changed, checked."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hands import THREE, changed

from sgnlp.base.errors import InputError
from sgnlp.hand.description import Changes, description
from sgnlp.hand.model import joint_model, own_joints


def test_the_part_below_a_link_stands_as_in_the_whole_hand(tmp_path: Path):
    whole = joint_model(description(THREE / "hand.urdf"))
    part = joint_model(description(THREE / "hand.urdf", "b_link"))
    assert own_joints(part) == ("b_curl",)
    assert part.frames[1].name == "b_link"
    angles = np.zeros(whole.nq)
    angles[own_joints(whole).index("b_curl")] = 0.7
    from_root = [placement(whole, angles, name) for name in ("b_link", "b_tip")]
    ours = placement(part, np.array([0.7]), "b_tip")
    np.testing.assert_allclose((from_root[0].inverse() * from_root[1]).homogeneous, ours.homogeneous, atol=1e-15)


def test_a_joint_that_follows_one_above_the_root_is_refused(tmp_path: Path):
    axis = '<axis xyz="0 -1 0"/>'
    folder = changed(tmp_path, "hand.urdf", (axis, f'{axis}<mimic joint="a_slide"/>'))
    with pytest.raises(InputError, match=r"hand.urdf: joint 'a_curl' mimics 'a_slide', which is not below the root"):
        description(folder / "hand.urdf", "a_slide")


def test_limits_of_the_hands_file_end_a_joint_that_turns_without_end(tmp_path: Path):
    folder = changed(tmp_path, "hand.urdf", ('name="a_bend" type="revolute"', 'name="a_bend" type="continuous"'))
    with pytest.raises(InputError, match=r"'a_bend' is continuous, .* limits: {a_bend: \[lower, upper\]}"):
        description(folder / "hand.urdf")
    model = joint_model(description(folder / "hand.urdf", changes=Changes(limits={"a_bend": (-0.2, 0.4)})))
    bend = own_joints(model).index("a_bend")
    assert (model.lowerPositionLimit[bend], model.upperPositionLimit[bend]) == (-0.2, 0.4)


def placement(model: pin.Model, joints: np.ndarray, link: str) -> pin.SE3:
    """Where a link stands, in the root's frame."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, joints)
    return data.oMf[model.getFrameId(link, pin.FrameType.BODY)].copy()
