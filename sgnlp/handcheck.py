"""What a hand's folder is examined for, before anything is planned with it.

Every part of the file is read on its own, so that one mistake hides no other; then the whole is held against its
meshes, against itself and against numeric Pinocchio.
"""

from collections.abc import Callable, Sized
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
import pinocchio as pin

from sgnlp import handfile, handgeometry
from sgnlp.errors import InputError
from sgnlp.hand import HAND_FILE, Hand, load_hand
from sgnlp.handmodel import joint_model, mimics, own_joints, urdf_file
from sgnlp.handurdf import description
from sgnlp.nodes import Array, any_mapping, frozen, sequence

Verdict = Literal["ok", "look", "wrong"]
Part = TypeVar("Part")

FREE_JOINTS = 3
"""Joints of a finger whose tip can go in every direction, as its spring pulls it."""
MAX_EFFORT = 5.0
"""A finger's joint with more torque [N m] would press with 50 N at 10 cm: a placeholder, most likely."""
MAX_PROTRUSION = 0.015
"""What of a link may reach out of the spheres [m] without a warning; the Allegro's palm does by 12 mm."""
CUBE, MAX_OFFSET = 0.06, 0.12
"""Edge of a cube to be grasped [m], and how far from its middle the tips' may start; the Allegro's farthest: 11 cm."""
SAMPLES, MAX_ERROR = 100, 1e-12
"""Random poses of the kinematics, and the error allowed there [m]."""


@dataclass(frozen=True)
class Finding:
    """What was found, beside what is valid. To be looked at is what can be planned with, but looks like a mistake."""

    verdict: Verdict
    check: str
    found: str
    valid: str


@dataclass(frozen=True, eq=False)
class Examination:
    """All findings, and the hand if its file can be read."""

    findings: tuple[Finding, ...]
    hand: Hand | None

    @property
    def wrong(self) -> int:
        """How many findings are wrong."""
        return sum(finding.verdict == "wrong" for finding in self.findings)


def examine(folder: Path, preset: str = "cover") -> Examination:
    """Examine a folder that holds a hand.yaml, with one preset of its spheres.

    Raises:
        InputError: there is no such folder or file.
    """
    if not (folder / HAND_FILE).is_file():
        raise InputError(f"'{folder}' is no folder holding {HAND_FILE}")
    reading = _Reading(folder)
    reading.file()
    findings = reading.findings
    if any(finding.verdict == "wrong" for finding in findings):
        return Examination(tuple(findings), None)
    hand = reading.part("all", "with this preset of spheres", lambda: load_hand(folder, preset), lambda h: h.name)
    if hand is not None:
        for measure in (_joint_findings, _tip_findings, _start_findings, _cover_findings, _kinematics_findings):
            findings += measure(hand)
    return Examination(tuple(findings), hand)


class _Reading:
    """The parts of a file, each read if what it needs could be read."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.findings: list[Finding] = []

    def part(self, check: str, valid: str, read: Callable[[], Part], say: Callable[[Part], str]) -> Part | None:
        """Read a part and say what was found; None where it is wrong."""
        try:
            part = read()
        except InputError as error:
            self.findings.append(Finding("wrong", check, str(error), valid))
            return None
        self.findings.append(Finding("ok", check, say(part), valid))
        return part

    def file(self) -> None:
        """All of it."""
        text = self.part("file", "text", lambda: handfile.text(self.folder / HAND_FILE), lambda t: HAND_FILE)
        data = text and self.part("keys", ", ".join(handfile.KEYS), lambda: handfile.entries(text), _count("keys"))
        if not data:
            return
        self.part("wrist", "a start or more", lambda: handfile.wrist_starts(data["wrist"]), _count("starts"))
        place = "a file beside this one, or the path of one in a package"
        urdf = self.part("URDF", place, lambda: urdf_file(data["urdf"], self.folder), lambda u: u.name)
        valid = "one tree of links, finite numbers, meshes that are there"
        described = urdf and self.part("links", valid, lambda: description(urdf), lambda d: f"{d.count('<link ')} links")
        model = described and self.part(
            "joints",
            "the root link as named, limits that leave those of mimic joints",
            lambda: joint_model(described, data["root"]),
            lambda m: f"{len(own_joints(m))} under '{data['root']}', {len(mimics(m))} more mimic one of them",
        )
        if model:
            self.joints(data, model)
            self.fingers(data, model)

    def joints(self, data: dict[str, Any], model: pin.Model) -> None:
        """What is said of each joint."""
        names = own_joints(model)
        low, high = frozen(model.lowerPositionLimit), frozen(model.upperPositionLimit)
        self.part("effort", "positive", lambda: handfile.effort(data["effort"], names), _span("N m"))
        inside = "an angle a joint, inside its limits"
        self.part("reference", inside, lambda: handfile.reference(data["reference"], names, low, high), _span("rad"))

    def fingers(self, data: dict[str, Any], model: pin.Model) -> None:
        """The fingers one by one, and what is said of each."""
        nodes = self.part("fingers", "a list", lambda: sequence(data["fingers"], "fingers"), _count("entries"))
        for i, node in enumerate(nodes or (), 1):
            tip = "the tip a link behind a joint, the radius positive"
            self.part(f"finger {i}", tip, partial(handfile.finger, node, model), lambda f: f.name)
        least = f"{handfile.MIN_FINGERS} or more, of different names"
        fingers = self.part("their number", least, lambda: handfile.fingers(data["fingers"], model), _count("fingers"))
        if not fingers:
            return
        names = [finger.name for finger in fingers]
        order = "0 < lower ≤ initial ≤ upper"
        self.part("gains", order, lambda: np.array(handfile.gains(data["gains"], names)), _span("N/m"))
        presets = self.part("spheres", "presets", lambda: any_mapping(data["spheres"], "spheres"), ", ".join)
        for preset in presets or {}:
            read = partial(handfile.spheres, data["spheres"], preset, model, names)
            valid = "spheres on links, a pad a finger, pairs"
            self.part(f"preset {preset}", valid, read, _preset)


def _count(kind: str) -> Callable[[Sized], str]:
    return lambda things: f"{len(things)} {kind}"


def _preset(found: handfile.SphereSet) -> str:
    radii = [1e3 * sphere.radius for sphere in found.spheres]
    return f"{len(radii)} spheres of {min(radii):g} to {max(radii):g} mm, {len(found.pairs)} pairs"


def _span(unit: str) -> Callable[[Array], str]:
    return lambda values: f"{np.min(values):.4g} to {np.max(values):.4g} {unit}"


def _finding(fine: bool, otherwise: Verdict, check: str, found: str, valid: str) -> Finding:
    return Finding("ok" if fine else otherwise, check, found, valid)


def _joint_findings(hand: Hand) -> list[Finding]:
    """How far the reference is from the limits, the strongest joint, and the mimic joints."""
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
    for mimic in hand.mimics:
        law = f"{mimic.multiplier:g} · {hand.joint_names[mimic.joint]} + {mimic.offset:g}"
        found.append(Finding("ok", f"mimic '{mimic.name}'", law, "follows one of the joints"))
    return found


def _tip_findings(hand: Hand) -> list[Finding]:
    """Initial targets, joints and pad of each finger."""
    tips = handgeometry.tips(hand)
    reach = 1e3 * np.linalg.norm(tips - tips.mean(axis=0), axis=1) / 2
    found = [
        Finding("ok", "initial targets", f"{_span('mm')(reach)} behind the tips", "half the way to the tips' middle")
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
    return found


def _start_findings(hand: Hand) -> list[Finding]:
    """How near the wrist starts bring the tips to an object."""
    far = handgeometry.start_offsets(hand, CUBE)
    found = f"{1e3 * far.min():.0f} to {1e3 * far.max():.0f} mm, start {int(far.argmax()) + 1} the farthest"
    check = f"middle of the tips to that of a {1e3 * CUBE:g} mm cube"
    return [_finding(bool(far.max() <= MAX_OFFSET), "look", check, found, f"{1e3 * MAX_OFFSET:g} mm at most")]


def _cover_findings(hand: Hand) -> list[Finding]:
    """Whether the spheres cover the meshes, and leave each other free."""
    gaps = handgeometry.pair_gaps(hand)
    found = []
    if len(gaps):
        pair = " and ".join(hand.spheres[i].name for i in hand.pairs[int(gaps.argmin())])
        closest = f"{1e3 * gaps.min():.1f} mm between {pair}"
        found.append(_finding(gaps.min() > 0, "wrong", "pairs at the reference", closest, "none overlaps"))
    else:
        found.append(Finding("look", "pairs at the reference", "none", "those of fingers that can meet"))
    try:
        out = handgeometry.protrusions(hand)
    except InputError as error:
        return [*found, Finding("wrong", "meshes", str(error), "STL, OBJ or DAE files that are there")]
    limit = f"{1e3 * MAX_PROTRUSION:g} mm at most"
    for link, height in out.items():
        text = f"{1e3 * height:.1f} mm out of the spheres" if height > 0 else "covered"
        found.append(_finding(height <= MAX_PROTRUSION, "look", f"mesh of '{link}'", text, limit))
    if not out:
        found.append(Finding("look", "meshes", "none", "visual geometry, to hold the spheres against"))
    return found


def _kinematics_findings(hand: Hand) -> list[Finding]:
    """Whether the symbolic kinematics are numeric Pinocchio's."""
    limit = f"{MAX_ERROR:g} m at most"
    return [
        _finding(error <= MAX_ERROR, "wrong", f"kinematics by {name}", f"off Pinocchio by {error:.1e} m", limit)
        for name, error in handgeometry.kinematics_errors(hand, SAMPLES).items()
    ]
