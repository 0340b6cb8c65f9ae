"""Findings about a hand whose file can be read: its joints, tips, starts, spheres and kinematics."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.hand import geometry
from sgnlp.hand.description.mjcf_motors import shared_motors
from sgnlp.hand.hand import Hand
from sgnlp.hand.plausible import TURNING, kind

Verdict = Literal["ok", "look", "wrong"]

FREE_JOINTS = 3
"""Number of joints with which a fingertip can move in every direction."""
MAX_EFFORT = 5.0
"""A larger torque [N m] of a finger's joint, 50 N at 10 cm, is most likely a placeholder."""
MAX_TURN, MAX_SLIDE = 2 * np.pi, 0.5
"""Limits beyond this, one turn [rad] or [m], look like degrees or millimetres."""
ROW, THUMB = (("index", "fore"), ("middle",), ("ring",), ("little", "pinky", "small")), "thumb"
"""Words in the names of the fingers besides the thumb, in their order from the thumb."""
LEAST_STEP = 0.001
"""Least distance of the thumb from the middle of the row of fingers that decides at which end the row begins [m]."""
MAX_PAD_GAP, MAX_PAD = 0.005, 0.03
"""Largest gap between a pad and its finger, and largest radius of a pad [m]. The package's touch and have 12 mm."""
MAX_PROTRUSION = 0.015
"""Largest distance of a link outside its spheres without a warning [m]; it is 12 mm for the Allegro's palm."""
MAX_BESIDE = 0.015
"""Largest gap between a sphere and its link without a warning [m]; it is 6 mm for the Allegro's palm."""
CUBE, MAX_OFFSET = 0.06, 0.12
"""Edge of a test cube [m], and largest distance of the tips' middle from its middle at a start (Allegro: 11 cm)."""
SAMPLES, MAX_ERROR = 100, 1e-12
"""Number of random poses for the kinematics, and the largest error there [m]."""


@dataclass(frozen=True)
class Finding:
    """A finding, and what would be valid. The verdict "look" marks a likely mistake that does not prevent planning."""

    verdict: Verdict
    check: str
    found: str
    valid: str


def found_of(hand: Hand) -> list[Finding]:
    """All findings about a hand."""
    measures = (_joint_findings, _motor_findings, _tip_findings, _start_findings, _cover_findings, _kinematics_findings)
    return [finding for measure in measures for finding in measure(hand)]


def span(unit: str) -> Callable[[Array], str]:
    """A function that writes the range of values in a unit."""
    return lambda values: f"{np.min(values):.4g} to {np.max(values):.4g} {unit}"


def _finding(fine: bool, otherwise: Verdict, check: str, found: str, valid: str) -> Finding:
    return Finding("ok" if fine else otherwise, check, found, valid)


def _joint_findings(hand: Hand) -> list[Finding]:
    """Distance of the reference from the limits, the strongest joint, and the mimic joints."""
    room = np.minimum(hand.reference - hand.lower, hand.upper - hand.reference)
    i, strongest = int(room.argmin()), int(hand.effort.argmax())
    found = [
        Finding("ok", "room around the reference", f"{room[i]:.3g} rad at '{hand.joint_names[i]}'", "0 at least"),
        _finding(
            hand.effort[strongest] <= MAX_EFFORT,
            "look",
            "largest effort",
            f"{hand.effort[strongest]:g} N m of '{hand.joint_names[strongest]}'",
            f"what the motor gives; more than {MAX_EFFORT:g} N m is rare",
        ),
    ]
    found.append(_limit_finding(hand))
    for mimic in hand.mimics:
        law = f"{mimic.multiplier:g} · {hand.joint_names[mimic.joint]} + {mimic.offset:g}"
        found.append(Finding("ok", f"mimic '{mimic.name}'", law, "follows one of the joints"))
    return found


def _limit_finding(hand: Hand) -> Finding:
    """Whether the limits are in radians and metres; those in degrees and millimetres are larger than any finger's."""
    turning = np.array([kind(hand.model, joint) == TURNING for joint in hand.joint_names])
    widest = np.maximum(-hand.lower, hand.upper)
    i = int((widest / np.where(turning, MAX_TURN, MAX_SLIDE)).argmax())
    unit, most, others = ("rad", MAX_TURN, "degrees (times π/180)") if turning[i] else ("m", MAX_SLIDE, "mm")
    found = f"{hand.lower[i]:g} to {hand.upper[i]:g} {unit} of '{hand.joint_names[i]}'"
    if widest[i] > most:
        found += f"; in {others}?"
    return _finding(bool(widest[i] <= most), "look", "widest limits", found, f"{most:.3g} {unit} from 0 at most")


def _order_finding(hand: Hand) -> list[Finding]:
    """Whether fingers with the names of a human hand stand in its order, the index next to the thumb."""
    bases = dict(zip((finger.name for finger in hand.fingers), geometry.finger_bases(hand), strict=True))
    row = [name for words in ROW for name in bases if any(word in name.lower() for word in words)]
    thumb = next((name for name in bases if THUMB in name.lower()), None)
    if len(row) < 2:
        return []
    one, other = max(combinations(row, 2), key=lambda pair: float(np.linalg.norm(bases[pair[0]] - bases[pair[1]])))
    line = bases[other] - bases[one]
    length = float(np.linalg.norm(line))
    places = {name: float((place - bases[one]) @ line) / max(length, LEAST_STEP) for name, place in bases.items()}
    lean = 0.0 if thumb is None else places[thumb] - length / 2  # of the thumb, towards the other end of the row
    if abs(lean) < LEAST_STEP:
        lean = places[row[0]] - length / 2
    standing = sorted(row, key=places.__getitem__, reverse=lean > 0)
    told = f"{'from the thumb on ' if thumb is not None else ''}{', '.join(standing)}"
    if thumb is not None and standing[0] != row[0]:
        told = f"'{row[0]}' is not beside the thumb: {told}"
    return [_finding(standing == row, "look", "order of the fingers", told, ", ".join(row))]


def _motor_findings(hand: Hand) -> Iterator[Finding]:
    """Independent joints that one motor moves: a plan could give them angles that the motor cannot hold."""
    for joints in shared_motors(hand.urdf):
        free = [name for name in joints if name in hand.joint_names]
        if len(free) > 1:
            law = f"{{{free[1]}: {{joint: {free[0]}, multiplier: 1, offset: 0}}}}"
            valid = f"one of them follows the other, in the hand's file: couplings: {law}"
            yield Finding("look", "shared motor", f"one motor moves {' and '.join(free)}", valid)


def _tip_findings(hand: Hand) -> list[Finding]:
    """Initial targets, joints and pad of each finger."""
    tips = geometry.tips(hand)
    reach = 1e3 * np.linalg.norm(tips - tips.mean(axis=0), axis=1) / 2
    found = [
        Finding("ok", "initial targets", f"{span('mm')(reach)} behind the tips", "half the way to the tips' middle")
    ]
    for finger, index in zip(hand.fingers, hand.tip_spheres, strict=True):
        chain, sphere = ", ".join(hand.joint_names[j] for j in finger.joints), hand.spheres[index]
        free = f"{FREE_JOINTS} joints or more: less cannot follow the spring everywhere"
        found.append(_finding(len(finger.joints) >= FREE_JOINTS, "look", f"chain of {finger.name}", chain, free))
        same = sphere.link == finger.frame and np.array_equal(sphere.centre, finger.offset)
        found.append(
            _finding(
                same and sphere.radius == finger.radius,
                "look",
                f"pad of {finger.name}",
                f"{1e3 * finger.radius:g} mm, sphere '{sphere.name}' {1e3 * sphere.radius:g} mm at '{sphere.link}'",
                f"the same at '{finger.frame}'",
            )
        )
    return [*found, *_order_finding(hand), *_pad_findings(hand)]


def _pad_findings(hand: Hand) -> list[Finding]:
    """Whether each pad is at the skin of its finger."""
    try:
        gaps = geometry.pad_gaps(hand)
    except InputError:
        return []  # `_cover_findings` reports a mesh that cannot be read
    found = []
    for finger, gap in zip(hand.fingers, gaps, strict=True):
        off = f"{1e3 * gap:.0f} mm off the finger" if gap > 0 else "at the finger"
        fine = bool(gap <= MAX_PAD_GAP) and finger.radius <= MAX_PAD
        valid = f"{1e3 * MAX_PAD_GAP:g} mm off at most, {1e3 * MAX_PAD:g} mm of radius at most"
        text = f"{off}, {1e3 * finger.radius:g} mm of radius"
        found.append(_finding(fine, "look", f"place of the pad of {finger.name}", text, valid))
    return found


def _start_findings(hand: Hand) -> list[Finding]:
    """How near the wrist starts bring the tips to an object."""
    far = geometry.start_offsets(hand, CUBE)
    found = f"{1e3 * far.min():.0f} to {1e3 * far.max():.0f} mm, start {int(far.argmax()) + 1} the farthest"
    check = f"middle of the tips to that of a {1e3 * CUBE:g} mm cube"
    return [_finding(bool(far.max() <= MAX_OFFSET), "look", check, found, f"{1e3 * MAX_OFFSET:g} mm at most")]


def _cover_findings(hand: Hand) -> list[Finding]:
    """Whether the spheres cover the meshes, and leave each other free."""
    gaps = geometry.pair_gaps(hand)
    found = []
    if len(gaps):
        pair = " and ".join(hand.spheres[i].name for i in hand.pairs[int(gaps.argmin())])
        closest = f"{1e3 * gaps.min():.1f} mm between {pair}"
        found.append(_finding(gaps.min() > 0, "wrong", "pairs at the reference", closest, "none overlaps"))
    else:
        found.append(Finding("look", "pairs at the reference", "none", "those of fingers that can meet"))
    try:
        out = geometry.protrusions(hand)
    except InputError as error:
        return [*found, Finding("wrong", "meshes", str(error), "STL, OBJ or DAE files that are there")]
    beside = geometry.sphere_gaps(hand)
    for name, gap in beside.items():
        if gap > MAX_BESIDE:
            valid = f"{1e3 * MAX_BESIDE:g} mm at most"
            found.append(Finding("look", f"sphere '{name}'", f"{1e3 * gap:.0f} mm beside the mesh of its link", valid))
    limit = f"{1e3 * MAX_PROTRUSION:g} mm at most"
    for link, height in out.items():
        text = f"{1e3 * height:.1f} mm out of the spheres" if height > 0 else "covered"
        found.append(_finding(height <= MAX_PROTRUSION, "look", f"mesh of '{link}'", text, limit))
    if not out:
        found.append(Finding("look", "meshes", "none", "visual geometry, to hold the spheres against"))
    return found


def _kinematics_findings(hand: Hand) -> list[Finding]:
    """Whether the symbolic kinematics are numeric Pinocchio's."""
    error = geometry.kinematics_error(hand, SAMPLES)
    found = f"off Pinocchio by {error:.1e} m"
    return [_finding(error <= MAX_ERROR, "wrong", "symbolic kinematics", found, f"{MAX_ERROR:g} m at most")]
