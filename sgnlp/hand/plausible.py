"""What the numbers of a hand or an arm can be: those in other units, such as millimetres or degrees, lie far outside.

The largest of the hands and arms that come with the package stand behind each span.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.base.ranges import SOFTEST, STIFFEST


@dataclass(frozen=True)
class Span:
    """The plausible sizes of a quantity in its unit, and what to do about another size."""

    least: float
    most: float
    unit: str
    remedy: str

    def check(self, value: float, where: str) -> None:
        """Raise `InputError`, which calls the value `where`, if it is implausible."""
        if not self.least <= value <= self.most:
            bounds = f"{self.least:g} to {self.most:g}" if self.least else f"at most {self.most:g}"
            raise InputError(f"{where} must be {bounds} {self.unit}, not {value:g}; {self.remedy}")


METRES = "is it in metres?"
RADIANS = ((np.pi / 2, 0.005), (np.pi / 4, 0.0005))
"""Angles that are whole multiples of the first numbers, but for the rounding of the second [rad]: two digits tell a
quarter turn, three an eighth. No angle of the package's hands in degrees is one."""
RADIUS = Span(0.0, 0.5, "m", METRES)  # the UR10's elbow has 0.135 m, a finger's bone of 4 mm would be 4
PAD = Span(0.0, 0.1, "m", METRES)  # 0.012 m; one of 5 mm in centimetres would be 0.5
PLACE = Span(0.0, 1.0, "m from 0", METRES)  # wrist starts up to 0.21 m, mounts up to 0.1 m
GAIN = Span(SOFTEST, STIFFEST, "N/m", "is it in N/m?")
LEAST_SIZE = 0.25
"""Size [m] of a hand whose links have their frames at one place, as jaws that slide: that of the package's hands."""
TURNING, SLIDING = "R", "P"
EFFORT = {  # of a hand: 3 N m; the weakest, 0.45 N m, would be 450 N mm
    TURNING: Span(0.0, 100.0, "N m", "is it in N m?"),
    SLIDING: Span(0.0, 1e4, "N", "is it in N?"),
}
ARM_EFFORT = {  # UR10: 330 N m; the Panda's weakest joint, 12 N m, would be 12 000 N mm
    TURNING: Span(0.0, 5e3, "N m", "is it in N m?"),
    SLIDING: Span(0.0, 1e5, "N", "is it in N?"),
}
VELOCITY = {  # the fastest finger, Dex3's: 12 rad/s; the slowest arm, 2.16 rad/s, would be 124 deg/s
    TURNING: Span(0.0, 40.0, "rad/s", "is it in rad/s? Degrees are π/180 rad"),
    SLIDING: Span(0.0, 10.0, "m/s", "is it in m/s?"),
}


def kind(model: pin.Model, joint: str) -> str:
    """Whether a joint of one coordinate is `TURNING` or `SLIDING`."""
    return SLIDING if model.joints[model.getJointId(joint)].shortname().startswith("JointModelP") else TURNING


def check_joints(model: pin.Model, names: Sequence[str], values: Array, spans: dict[str, Span], where: str) -> None:
    """Raise `InputError` for the first joint whose value, called `where`, is implausible."""
    for name, value in zip(names, values, strict=True):
        spans[kind(model, name)].check(float(value), f"{where} '{name}'")


def size(model: pin.Model) -> float:
    """The diagonal [m] of the box around the frames of all links, with all joints at 0; `LEAST_SIZE` at least."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    frames = zip(data.oMf, model.frames, strict=True)
    places = [at.translation for at, frame in frames if frame.type == pin.FrameType.BODY]
    return max(LEAST_SIZE, float(np.linalg.norm(np.ptp(places, axis=0))))


def check_beside(point: ArrayLike, radius: float, link: str, model: pin.Model, where: str) -> None:
    """Raise `InputError` for a ball on a link, in the link's frame, that is farther off it than the links are apart.

    It is 0.81 of that at most in the package's hands (LEAP's left one, the others 0.36), and 0.41 in its arms.
    """
    away = float(np.linalg.norm(point))
    if away - radius > LEAST_SIZE and away - radius > (most := size(model)):  # which takes a third of a millisecond
        raise InputError(
            f"{where} is {away:g} m off its link '{link}', more than the {most:.2g} m that links are apart; "
            "is it in metres, in the frame of that link?"
        )


def check_degrees(angles: Array, where: str) -> None:
    """Raise `InputError`, which calls the angles (n,) `where`, if one of them is a part of π: 1.57, 3.1416, 0.785."""
    for angle in angles:
        for part, digits in RADIANS:
            parts = np.abs(angle) / part
            if (
                0 < np.round(parts) <= 2 * np.pi / part
                and np.abs(angle - np.sign(angle) * np.round(parts) * part) < digits
            ):
                raise InputError(
                    f"{where} must be degrees, not {angle:g}, which is a part of π: {np.degrees(angle):.0f}?"
                )
