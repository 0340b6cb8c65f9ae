"""Elements of a URDF with numbers, and poses as a URDF writes them."""

import math
import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike


def add(parent: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
    """Append a new element with these attributes to its parent."""
    return ElementTree.SubElement(parent, tag, attributes)


def words(*values: float) -> str:
    """Numbers as the text of an attribute, with all digits."""
    return " ".join(repr(float(value)) for value in values)


def pose(translation: ArrayLike, quaternion: ArrayLike) -> pin.SE3:
    """The pose of a translation (3,) [m] and of MuJoCo's quaternion w x y z."""
    w, x, y, z = np.asarray(quaternion, float)
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized(), np.array(translation, float))


def place(stands: pin.SE3) -> dict[str, str]:
    """The attributes of the <origin> of a pose.

    A URDF writes R = Rz(c) Ry(b) Rx(a) as rpy = a b c. Near b = ±90° only c ∓ a matters; c is computed from R, a and b,
    so that R is restored with all digits there, too.
    """
    rotation = stands.rotation
    a = math.atan2(rotation[2, 1], rotation[2, 2])
    b = math.atan2(-rotation[2, 0], math.hypot(rotation[2, 1], rotation[2, 2]))
    left = rotation @ pin.utils.rotate("x", -a) @ pin.utils.rotate("y", -b)
    c = math.atan2(left[1, 0], left[0, 0])
    return {"xyz": words(*stands.translation), "rpy": words(a, b, c)}
