"""A hand alone as a scene: its meshes and, over them, its spheres, at the reference pose and at the joint limits."""

import numpy as np

from sgnlp import palette
from sgnlp.hand import Hand
from sgnlp.handcheck import Examination
from sgnlp.handgeometry import ORIGIN
from sgnlp.handmeshes import link_poses
from sgnlp.kinematics import frames
from sgnlp.scene3d import links
from sgnlp.scene_parts import Label, Scene, Stage, View
from sgnlp.scene_shapes import spheres
from sgnlp.sheets import Sheet

SPHERE_OPACITY = 0.25
"""The meshes are seen through the spheres."""


def hand_scene(hand: Hand, examination: Examination) -> Scene:
    """The scene, with the findings as its table.

    Raises:
        InputError: a mesh of the URDF is not there, or is none.
    """
    lines = [(finding.check, finding.found, finding.verdict) for finding in examination.findings]
    sheet = Sheet("Checks", (("check", "found", ""), *lines))
    poses = {"reference": hand.reference, "lower limits": hand.lower, "upper limits": hand.upper}
    views = tuple(_view(hand, name, joints, sheet) for name, joints in poses.items())
    names = tuple(finger.name for finger in hand.fingers)
    return Scene(hand.name, links(hand, 1.0), (), views, (), hidden=(), kind="Pose", fingers=names)


def _view(hand: Hand, name: str, joints: np.ndarray, sheet: Sheet) -> View:
    tips = frames(hand, ORIGIN, joints)[0]
    labels = tuple(
        Label(finger.name, (float(x), float(y), float(z)), palette.finger(i))
        for i, (finger, (x, y, z)) in enumerate(zip(hand.fingers, tips, strict=True))
    )
    still = Stage("without object", np.eye(3), np.zeros(3), ())
    balls = tuple(spheres(hand, ORIGIN, joints, SPHERE_OPACITY))
    return View(name, link_poses(hand, ORIGIN, joints), balls, (still,), labels, (sheet,))
