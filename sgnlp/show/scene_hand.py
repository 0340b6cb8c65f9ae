"""A hand alone as a scene: its meshes, spheres and wrist starts, at the reference pose and at the joint limits."""

import numpy as np
import pinocchio as pin

from sgnlp.base import palette
from sgnlp.hand.check import Examination
from sgnlp.hand.geometry import ORIGIN
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames
from sgnlp.hand.meshes import link_poses
from sgnlp.show.scene import links
from sgnlp.show.scene_parts import FRAMES, STARTS, Scene, Shape, Stage, View, named
from sgnlp.show.scene_shapes import spheres
from sgnlp.show.sheets import Sheet

SPHERE_OPACITY = 0.25
"""Opacity of the spheres, so that the meshes in them are visible."""
ROOT_AXIS, TIP_AXIS, UP = 0.06, 0.03, 0.03
"""Length of the axes at the root link and at the tips, and of the vertical at a wrist start [m]."""
AXIS_WIDTH = 8.0
"""Of an axis [pixel]."""


def hand_scene(hand: Hand, examination: Examination) -> Scene:
    """The scene, with the findings as its table.

    Raises:
        InputError: a mesh of the URDF is missing, or cannot be read.
    """
    lines = [(finding.check, finding.found, finding.verdict) for finding in examination.findings]
    sheet = Sheet("Checks", (("check", "found", ""), *lines))
    poses = {"reference": hand.reference, "lower limits": hand.lower, "upper limits": hand.upper}
    views = tuple(_view(hand, name, joints, sheet) for name, joints in poses.items())
    names = tuple(finger.name for finger in hand.fingers)
    return Scene(hand.name, links(hand, 1.0), (), views, (), hidden=(), kind="Pose", fingers=names)


def _view(hand: Hand, name: str, joints: np.ndarray, sheet: Sheet) -> View:
    tips = frames(hand, ORIGIN, joints)[0]
    labels = tuple(named([finger.name for finger in hand.fingers], tips))
    still = Stage("without object", np.eye(3), np.zeros(3), ())
    balls = tuple(spheres(hand, ORIGIN, joints, SPHERE_OPACITY))
    return View(
        name,
        link_poses(hand, ORIGIN, joints),
        (*balls, *_axes(hand, joints), *_starts(hand)),
        (still,),
        labels,
        (sheet,),
    )


def _axes(hand: Hand, joints: np.ndarray) -> list[Shape]:
    """The frames of the root link, at its origin, and of the tips' links, at the centres of the pads."""
    data = hand.model.createData()
    pin.framesForwardKinematics(hand.model, data, joints)
    links = [hand.model.getFrameId(finger.frame, pin.FrameType.BODY) for finger in hand.fingers]
    turns = [np.eye(3), *(data.oMf[link].rotation for link in links)]
    places = [np.zeros(3), *frames(hand, ORIGIN, joints)[0]]
    lengths = [ROOT_AXIS, *[TIP_AXIS] * len(links)]
    return [
        Shape(FRAMES, np.stack([place, place + length * turn[:, i]]), np.array([[0, 1]]), colour, width=AXIS_WIDTH)
        for place, turn, length in zip(places, turns, lengths, strict=True)
        for i, colour in enumerate(palette.AXES.values())
    ]


def _starts(hand: Hand) -> list[Shape]:
    """For each wrist start, the middle of the top face of the object's box and the world's z, in the root's frame."""
    poses = [pin.XYZQUATToSE3(start.pose(np.zeros(3), np.zeros(3))).inverse() for start in hand.wrist_starts]
    ends = [np.stack([pose.translation, pose.act(np.array([0.0, 0.0, UP]))]) for pose in poses]
    return [Shape(STARTS, line, np.array([[0, 1]]), palette.INK, width=AXIS_WIDTH) for line in ends]
