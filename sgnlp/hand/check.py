"""Checks of a hand's folder, before anything is planned with it.

Every part of the file is read separately, so that one mistake does not hide another. Then the whole hand is compared
with its meshes and with numeric Pinocchio.
"""

from collections.abc import Callable, Sized
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin

from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import any_mapping, frozen, sequence, word
from sgnlp.hand import hand_file
from sgnlp.hand.description import Changes, description
from sgnlp.hand.description.source import source_file
from sgnlp.hand.findings import Finding, found_of, span
from sgnlp.hand.hand import HAND_FILE, Hand, load_hand
from sgnlp.hand.model import joint_model, mimics, own_joints

Part = TypeVar("Part")


@dataclass(frozen=True, eq=False)
class Examination:
    """All findings, and the hand if its file can be read."""

    findings: tuple[Finding, ...]
    hand: Hand | None

    @property
    def wrong(self) -> int:
        """Number of findings with the verdict "wrong"."""
        return sum(finding.verdict == "wrong" for finding in self.findings)


def examine(folder: Path, preset: str = "cover") -> Examination:
    """Check a folder with a hand.yaml, with one preset of its spheres.

    Raises:
        InputError: the folder or the file does not exist.
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
        findings += found_of(hand)
    return Examination(tuple(findings), hand)


class _Reading:
    """The parts of a file; each is read if the parts that it needs could be read."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.findings: list[Finding] = []

    def part(self, check: str, valid: str, read: Callable[[], Part], say: Callable[[Part], str]) -> Part | None:
        """Read a part and add a finding; None if the part is wrong."""
        try:
            part = read()
        except InputError as error:
            self.findings.append(Finding("wrong", check, str(error), valid))
            return None
        self.findings.append(Finding("ok", check, say(part), valid))
        return part

    def file(self) -> None:
        """All of it."""
        text = self.part("file", "text", lambda: hand_file.text(self.folder / HAND_FILE), lambda t: HAND_FILE)
        data = text and self.part("keys", ", ".join(hand_file.KEYS), lambda: hand_file.entries(text), _count("keys"))
        if not data:
            return
        self.part("wrist", "a start or more", lambda: hand_file.wrist_starts(data["wrist"]), _count("starts"))
        place = "a file beside this one, or the path of one in a package"
        urdf = self.part("URDF", place, lambda: source_file(data["urdf"], self.folder), lambda u: u.name)
        valid = "a tree of links, among them the root, finite numbers, meshes that are there"
        changes = self.part("changes", ", ".join(hand_file.OPTIONAL), lambda: hand_file.changes(data), _changes)
        if urdf is None or changes is None:
            return
        described = self.part(
            "links",
            valid,
            lambda: description(urdf, word(data["root"], "root"), changes),
            lambda d: f"{d.count('<link ')} links from '{data['root']}' on",
        )
        model = described and self.part(
            "joints",
            "limits that leave those of mimic joints",
            lambda: joint_model(described),
            lambda m: f"{len(own_joints(m))} under '{data['root']}', {len(mimics(m))} more mimic one of them",
        )
        if model:
            self.joints(data, model)
            self.fingers(data, model)

    def joints(self, data: dict[str, Any], model: pin.Model) -> None:
        """The values of each joint."""
        names = own_joints(model)
        low, high = frozen(model.lowerPositionLimit), frozen(model.upperPositionLimit)
        self.part("effort", "positive", lambda: hand_file.effort(data["effort"], names, model), span("N m"))
        inside = "an angle a joint, inside its limits"
        self.part(
            "reference",
            inside,
            lambda: hand_file.posture(data["reference"], "reference", names, low, high),
            span("rad"),
        )

    def fingers(self, data: dict[str, Any], model: pin.Model) -> None:
        """The fingers one by one, then the values of each finger."""
        nodes = self.part("fingers", "a list", lambda: sequence(data["fingers"], "fingers"), _count("entries"))
        for i, node in enumerate(nodes or (), 1):
            tip = "the tip a link behind a joint, the radius positive"
            self.part(f"finger {i}", tip, partial(hand_file.finger, node, model), lambda f: f.name)
        least = f"{hand_file.MIN_FINGERS} or more, of different names"
        fingers = self.part("their number", least, lambda: hand_file.fingers(data["fingers"], model), _count("fingers"))
        if not fingers:
            return
        names = [finger.name for finger in fingers]
        order = "0 < lower ≤ initial ≤ upper"
        self.part("gains", order, lambda: np.array(hand_file.gains(data["gains"], names)), span("N/m"))
        presets = self.part("spheres", "presets", lambda: any_mapping(data["spheres"], "spheres"), ", ".join)
        for preset in presets or {}:
            read = partial(hand_file.spheres, data["spheres"], preset, model, names)
            valid = "spheres on links, a pad a finger, pairs"
            self.part(f"preset {preset}", valid, read, _preset)


def _count(kind: str) -> Callable[[Sized], str]:
    return lambda things: f"{len(things)} {kind}"


def _changes(found: Changes) -> str:
    told = [f"{len(found.limits)} limits", f"{len(found.couplings)} couplings", *(["mirrored"] if found.mirror else [])]
    return ", ".join(told)


def _preset(found: hand_file.SphereSet) -> str:
    radii = [1e3 * sphere.radius for sphere in found.spheres]
    return f"{len(radii)} spheres of {min(radii):g} to {max(radii):g} mm, {len(found.pairs)} pairs"
