"""The hand: kinematic model, fingers, collision spheres, reference pose, wrist starts and gain bounds.

A hand is a folder of `urdf/` holding one `hand.yaml` (its keys are described in `urdf/README.md`). Nothing here
depends on the number of fingers or on the names of one hand.
"""

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.brief import brief
from sgnlp.base.checked import Typed, typed
from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import frozen, word
from sgnlp.hand import hand_file, library
from sgnlp.hand.arm import Arm, base_pose, load_arm, with_base, with_mount
from sgnlp.hand.description import description
from sgnlp.hand.description.source import source_file
from sgnlp.hand.description.xml_file import content
from sgnlp.hand.hand_file import Finger, Sphere, WristStart
from sgnlp.hand.model import Mimic, joint_model, mimics, own_joints
from sgnlp.hand.placements import Backend, backend, usable

HAND_FILE = "hand.yaml"
POSITION = 3
"""Joints that it takes to bring a fingertip to a place; one more lets it press from another side."""


@dataclass(frozen=True, eq=False)
class Hand(Typed):
    """A multi-fingered hand with n joints and m fingers; every joint array follows `joint_names`."""

    called = "a hand"
    __repr__ = brief

    name: str
    folder: Path
    """The folder with its `hand.yaml`."""
    urdf: Path
    """Its URDF or MJCF file."""
    description: str
    """The hand from the root on, as the text of a URDF for Pinocchio and MuJoCo, by `sgnlp.hand.description`."""
    model: pin.Model
    """The tree of joints with the root link fixed at the origin (no free flyer)."""
    root: str
    joint_names: tuple[str, ...]
    """The n joints in Pinocchio's order, which sorts by name and not by finger, without mimic joints."""
    mimics: tuple[Mimic, ...]
    """The mimic joints, which follow others."""
    lower: Array  # (n,) [rad or m]
    upper: Array  # (n,) [rad or m]
    effort: Array  # (n,) [N m or N]
    reference: Array  # (n,) [rad or m]
    fingers: tuple[Finger, ...]
    spheres: tuple[Sphere, ...]
    tip_spheres: tuple[int, ...]
    """Index into `spheres` of each finger's pad, in finger order."""
    pairs: tuple[tuple[int, int], ...]
    """Indices into `spheres` of the pairs checked for self-collision."""
    wrist_starts: tuple[WristStart, ...]
    palm: Array  # (3,) the direction that the palm faces, in the root's frame
    gain_lower: Array  # (m,) [N/m]
    gain_upper: Array  # (m,) [N/m]
    gain_initial: Array  # (m,) [N/m]
    digest: str
    """SHA-256 of the hand's file, its description, the preset of spheres and, on an arm, the arm's digest."""
    kinematics: Backend
    """The backend of the joint placements, its own and its arm's, as expressions."""
    arm: Arm | None = None
    """The arm that carries the hand; None without one."""
    alone: "Hand | None" = None
    """The hand without the arm that carries it."""

    @property
    def models(self) -> tuple[pin.Model, ...]:
        """The joint trees of the hand and of its arm."""
        return (self.model, self.arm.model) if self.arm else (self.model,)

    @property
    def few_joints(self) -> bool:
        """Whether it has fewer than four joints for each finger: none is left once a tip stands at a place."""
        return len(self.joint_names) < (POSITION + 1) * len(self.fingers)

    @property
    def tip_radii(self) -> Array:
        """Radius of each finger's pad (m,) [m]."""
        return np.array([finger.radius for finger in self.fingers])

    @property
    def moving_joints(self) -> tuple[str, ...]:
        """All moving joints: the hand's own joints, then the mimic joints."""
        return (*self.joint_names, *(mimic.name for mimic in self.mimics))

    def moving_angles(self, joints: Array) -> Array:
        """Positions of the `moving_joints` [rad or m] at the joints (n,)."""
        return np.array([*joints, *(mimic.angle(joints[mimic.joint]) for mimic in self.mimics)])


def available_hands() -> tuple[str, ...]:
    """The sorted names of the hands that come with the package."""
    return library.names(HAND_FILE)


@typed
def load_hand(
    name_or_folder: str | Path,
    spheres: str = "cover",
    arm: str | Path | None = None,
    arm_base: Sequence[float] = (),
    kinematics: Backend | None = None,
) -> Hand:
    """The hand with this name in `urdf/`, or in a folder with a `hand.yaml`, with one preset of its spheres.

    `arm` is the name or the folder of the arm that carries it. `arm_base` is the pose of the arm's root link in the
    world, by default that in the arm's file: x y z [m], these and intrinsic XYZ angles [deg], or these and a quaternion
    x y z w. `kinematics` is the backend of the joint placements, by default the best that runs on this machine.

    Raises:
        InputError: the hand, preset, a key, link or joint is unknown, values contradict each other or the description,
            or the backend does not run on this machine. The message is one line.
    """
    file = library.find("hand", name_or_folder, HAND_FILE)
    try:
        hand = _loaded(file, hand_file.text(file), spheres)
    except InputError as error:
        raise error.within(f"{file.parent.name}/{file.name}") from None
    if arm is None and len(arm_base):
        raise InputError("the base of an arm is given, but no arm")
    hand = hand if arm is None else _carried(hand, load_arm(arm), tuple(arm_base))
    return _moving(hand, usable(kinematics, *hand.models) if kinematics else backend(*hand.models))


@functools.lru_cache(maxsize=16)
def _moving(hand: Hand, kinematics: Backend) -> Hand:
    alone = hand.alone and replace(hand.alone, kinematics=kinematics)
    return replace(hand, kinematics=kinematics, alone=alone)


@functools.lru_cache(maxsize=16)
def _carried(hand: Hand, arm: Arm, base: tuple[float, ...]) -> Hand:
    return on_arm(hand, with_base(arm, base_pose(base)) if base else arm)


def told(hand: Hand) -> dict[str, Any] | None:
    """The arm of a hand in plain values, as for `load_hand`; None without one."""
    if hand.arm is None:
        return None
    return {"name": library.called(hand.arm.folder), "base": hand.arm.base.tolist()}


def on_arm(hand: Hand, arm: Arm) -> Hand:
    """The hand carried by an arm, at the arm's mount for this hand.

    Raises:
        InputError: the hand is on an arm already, or the two share a name of a joint or sphere.
    """
    if hand.arm is not None:
        raise InputError(f"the hand '{hand.name}' is on the arm '{hand.arm.name}' already; give the hand alone")
    for kind, ours, theirs in (
        ("joint", arm.joint_names, hand.moving_joints),
        ("sphere", [s.name for s in arm.spheres], [s.name for s in hand.spheres]),
    ):
        if both := sorted(set(ours) & set(theirs)):
            raise InputError(f"the arm '{arm.name}' and the hand '{hand.name}' both have a {kind} '{both[0]}'")
    arm = with_mount(arm, hand.name)
    digest = hashlib.sha256(f"{hand.digest} {arm.digest}".encode()).hexdigest()
    return replace(hand, arm=arm, digest=digest, kinematics=backend(hand.model, arm.model), alone=hand)


@functools.lru_cache(maxsize=16)
def _loaded(file: Path, text: str, preset: str) -> Hand:
    """The same text gives the same hand, so what is built for a hand is built once."""
    return _build(file, hand_file.entries(text), preset, text)


def _build(file: Path, data: dict[str, Any], preset: str, text: str) -> Hand:
    urdf = source_file(data["urdf"], file.parent)
    root = word(data["root"], "root")
    described = description(urdf, root, hand_file.changes(data))
    model = joint_model(described)
    names = own_joints(model)
    fingers = hand_file.fingers(data["fingers"], model)
    finger_names = [finger.name for finger in fingers]
    spheres = hand_file.spheres(data["spheres"], preset, model, finger_names)
    lower, upper = frozen(model.lowerPositionLimit), frozen(model.upperPositionLimit)
    gain_lower, gain_upper, gain_initial = hand_file.gains(data["gains"], finger_names)
    return Hand(
        name=word(data["name"], "name"),
        folder=file.parent,
        urdf=urdf,
        description=described,
        model=model,
        root=root,
        joint_names=names,
        mimics=mimics(model),
        lower=lower,
        upper=upper,
        effort=hand_file.effort(data["effort"], names, model),
        reference=hand_file.posture(data["reference"], "reference", names, lower, upper),
        fingers=fingers,
        spheres=spheres.spheres,
        tip_spheres=spheres.pads,
        pairs=spheres.pairs,
        wrist_starts=hand_file.wrist_starts(data["wrist"]),
        palm=hand_file.palm_direction(data["wrist"]),
        gain_lower=gain_lower,
        gain_upper=gain_upper,
        gain_initial=gain_initial,
        digest=hashlib.sha256(b"\0".join([text.encode(), content(urdf), preset.encode()])).hexdigest(),
        kinematics=backend(model),
    )
