"""The mirror image of a description."""

import xml.etree.ElementTree as ElementTree

from sgnlp.hand.description.poses import words

VECTOR, PSEUDOVECTOR = (1, -1, 1), (-1, 1, -1)
"""Signs of the reflection: for positions, directions and scales; and for rotation axes and angles."""


def mirror(robot: ElementTree.Element) -> None:
    """Reflect a robot in the plane y = 0 of its root link, so that equal joint values are mirror images.

    With S = diag(1, -1, 1), every pose T = (R, p) becomes S T S = (S R S, S p), so that the pose of each link in the
    root's frame does, too. What follows for the parts:

    * R = Rz(c) Ry(b) Rx(a): S Rz(c) S = Rz(-c), S Ry(b) S = Ry(b) and S Rx(a) S = Rx(-a), so rpy is (-a, b, -c).
    * A joint that turns by q about e: S exp(q [e]×) S = exp(q [det(S) S e]×), so its axis, a pseudovector, is -S e.
      One that slides moves by q S e.
    * A mesh point v of scale D at T: S T D v = (S T S) (S D) v, so its scale in y changes its sign. Boxes, cylinders,
      capsules and spheres are their own mirror images.
    * The inertia I about the centre of mass at T: S I S, so ixy and iyz change their signs.
    """
    for joint in robot.findall("joint"):
        axis = joint.find("axis")
        if axis is None and joint.get("type") != "fixed":
            axis = ElementTree.SubElement(joint, "axis", xyz="1 0 0")  # the URDF's default
        if axis is not None:
            _sign(axis, "xyz", PSEUDOVECTOR if joint.get("type") == "revolute" else VECTOR)
    for origin in robot.iter("origin"):
        _sign(origin, "xyz", VECTOR)
        _sign(origin, "rpy", PSEUDOVECTOR)
    for mesh in robot.iter("mesh"):
        mesh.set("scale", mesh.get("scale", "1 1 1"))
        _sign(mesh, "scale", VECTOR)
    for inertia in robot.iter("inertia"):
        for key in ("ixy", "iyz"):
            _sign(inertia, key, (-1,))


def _sign(element: ElementTree.Element, key: str, signs: tuple[int, ...]) -> None:
    """Multiply the numbers of an attribute, where there are any."""
    text = element.get(key)
    if text is not None:
        element.set(key, words(*(sign * float(word) for sign, word in zip(signs, text.split(), strict=True))))
