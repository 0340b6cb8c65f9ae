"""The wrist starts: the turn of the palm to the table, and the paper's seven poses for a hand of any shape."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.draft.body import Body
from sgnlp.hand.draft.reference import Reference
from sgnlp.hand.hand_file import euler_rotation

STARTS = (
    ((-0.026, -0.015, -0.023), (0, 0, 0)),
    ((-0.034, 0.002, -0.053), (0, 0, -45)),
    ((-0.012, -0.024, -0.053), (0, 0, 45)),
    ((0.017, 0.036, -0.035), (-90, 90, 0)),
    ((0.024, -0.023, 0.065), (-90, 0, 0)),
    ((0.015, -0.036, -0.053), (0, 0, 90)),
    ((0.014, -0.012, -0.053), (0, 0, 135)),
)
"""The paper's table of initial wrist poses, as positions of the grasp's middle [m] from the middle of the top face of
the cloud's box, and intrinsic XYZ angles [deg]: for an Allegro hand they give the table's own positions."""


@dataclass(frozen=True, eq=False)
class Wrist:
    """The turn of the root that makes the fingers point along +x and the palm face down, and the starts."""

    euler_deg: Array  # (3,) intrinsic XYZ
    palm: Array  # (3,) direction of the palm, in the root's frame
    fingers: Array  # (3,) direction from the thumb to the fingers, in the root's frame
    positions: Array  # (W, 3) [m]
    angles_deg: Array  # (W, 3) intrinsic XYZ


def wrist(body: Body, reference: Reference) -> Wrist:
    """The starts of a hand at its reference posture.

    The first direction goes from the thumb to the fingers. The palm's direction goes from the fingers' bases to the
    ball, perpendicular to the first.
    """
    m = len(body.chains)
    pads = body.centres(reference.joints)[:m]
    others = np.delete(pads, reference.thumb, axis=0).mean(axis=0)
    middle = (pads[reference.thumb] + others) / 2
    fingers = others - pads[reference.thumb]
    fingers = fingers / np.linalg.norm(fingers)
    ahead = middle - bases(body, reference.joints).mean(axis=0)
    palm = ahead - (ahead @ fingers) * fingers
    palm = palm / np.linalg.norm(palm)
    turn = np.stack([fingers, np.cross(fingers, palm), -palm])
    places = [place - euler_rotation(list(euler), "a start") @ turn @ middle for place, euler in STARTS]
    return Wrist(euler_deg(turn), palm, fingers, np.array(places), np.array([euler for _, euler in STARTS]))


def bases(body: Body, joints: Array) -> Array:
    """Position of the first joint of each finger (m, 3) [m], in the root's frame."""
    data = body.skeleton.model.createData()
    pin.forwardKinematics(body.skeleton.model, data, joints)
    return np.array([data.oMi[chain.joints[0]].translation for chain in body.chains])


def euler_deg(rotation: Array) -> Array:
    """The intrinsic XYZ angles (3,) [deg] of a rotation Rx(a) Ry(b) Rz(c) = (Rz(-c) Ry(-b) Rx(-a))ᵀ."""
    return np.degrees(-pin.rpy.matrixToRpy(rotation.T))
