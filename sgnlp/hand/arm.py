"""The arm that carries a hand: kinematic model, limits, home, base, mount and collision spheres.

An arm is a folder of `urdf/` holding one `arm.yaml` (its keys are described in `urdf/README.md`).
"""

import functools
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.brief import brief
from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import frozen, numbers, word
from sgnlp.hand import arm_file, hand_file, library
from sgnlp.hand.description import description
from sgnlp.hand.description.source import source_file
from sgnlp.hand.hand_file import Sphere
from sgnlp.hand.model import check_unit, coordinates, joint_model, own_joints, places

ARM_FILE = "arm.yaml"
ROUNDING = 1e-12
"""A quaternion whose length is this near to 1 is kept bit for bit."""


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm with a joints, from its root link to its flange; every joint array follows `joint_names`."""

    __repr__ = brief

    name: str
    urdf: Path
    description: str
    """The URDF, by `sgnlp.hand.description` and `arm_file.chain`, without a gripper or anything else on the flange."""
    model: pin.Model
    """The joints with the root link fixed at the origin."""
    root: str
    joint_names: tuple[str, ...]
    """The a joints, from the root on."""
    lower: Array  # (a,) [rad or m]
    upper: Array  # (a,) [rad or m]
    velocity: Array  # (a,) [rad/s or m/s]
    effort: Array  # (a,) [N m or N]
    home: Array  # (a,) [rad or m]
    base: Array  # (7,) x y z qx qy qz qw, pose of the root link in the world
    flange: str
    mount: Array  # (7,) x y z qx qy qz qw, pose of the hand's root link in the flange's frame
    mounts: Mapping[str, Array]
    """The mount by the name of the hand; `default` for all others."""
    spheres: tuple[Sphere, ...]
    pairs: tuple[tuple[int, int], ...]
    """Indices into `spheres` of the pairs checked for self-collision."""
    folder: Path
    """Path of its `arm.yaml`."""
    digest: str
    """SHA-256 of the description and the URDF, and of a mount other than the default; the base is not included."""

    @functools.cached_property
    def free_spheres(self) -> list[int]:
        """Indices into `spheres` of those that can reach the table: at least two joints move them.

        Fixed links stand on the table, and the first joint only turns about a vertical axis.
        """
        links = [self.model.getFrameId(sphere.link, pin.FrameType.BODY) for sphere in self.spheres]
        return [i for i, link in enumerate(links) if len(coordinates(self.model, link)) > 1]


def available_arms() -> tuple[str, ...]:
    """The sorted names of the arms that come with the package."""
    return library.names(ARM_FILE)


def load_arm(name_or_folder: str | Path) -> Arm:
    """The arm with this name in `urdf/`, or in a folder with an `arm.yaml`, with the default mount.

    Raises `InputError`, in one line, for an unknown arm, key, link or joint and for values that contradict each other
    or the URDF.
    """
    file = library.find("arm", name_or_folder, ARM_FILE)
    try:
        return _loaded(file, hand_file.text(file))
    except InputError as error:
        raise error.within(f"{file.parent.name}/{file.name}") from None


def with_base(arm: Arm, pose: Array) -> Arm:
    """The arm with its root link at a pose (7,) in the world, x y z [m] qx qy qz qw.

    Raises:
        InputError: the pose is not seven finite numbers with a quaternion of length 1.
    """
    values = numbers(pose, (7,), "the base of an arm, x y z qx qy qz qw,")
    check_unit(values, "the base of an arm")
    length = float(np.linalg.norm(values[3:]))
    scale = 1.0 if abs(length - 1.0) <= ROUNDING else length
    return replace(arm, base=frozen([*values[:3], *values[3:] / scale]))


def base_pose(values: Sequence[float]) -> Array:
    """The pose (7,) of a base from x y z [m], from these and intrinsic XYZ angles [deg], or with a quaternion x y z w.

    Raises:
        InputError: it has another number of values.
    """
    if len(values) not in (3, 6, 7):
        said = f"3, 6 or 7 numbers: x y z, then angles [deg] or a quaternion; not {len(values)}"
        raise InputError(f"the base of an arm is given by {said}")
    if len(values) == 7:
        return np.asarray(values, float)
    return hand_file.pose({"position": list(values[:3]), "euler_deg": list(values[3:]) or [0, 0, 0]}, "arm base")


def with_mount(arm: Arm, hand: str) -> Arm:
    """The arm with its mount for the hand with this name."""
    mount = arm.mounts.get(hand, arm.mounts[arm_file.DEFAULT])
    return replace(arm, mount=mount, digest=_digest(arm.digest, "mount", *mount))


@functools.lru_cache(maxsize=16)
def _loaded(file: Path, text: str) -> Arm:
    """The same text gives the same arm."""
    arm = _build(file, hand_file.entries(text, arm_file.KEYS, arm_file.OPTIONAL), text)
    _check_home(arm)
    return arm


def _build(file: Path, data: dict[str, Any], text: str) -> Arm:
    urdf = source_file(data["urdf"], file.parent)
    root, flange = word(data["root"], "root"), word(data["flange"], "flange")
    described = arm_file.chain(description(urdf, root), flange)
    model = joint_model(described)
    names = own_joints(model)
    lower, upper = (
        numbers(ends, (len(names),), "limits") for ends in (model.lowerPositionLimit, model.upperPositionLimit)
    )
    spheres, mounts = hand_file.sphere_list(data["spheres"], model), arm_file.mounts(data["mount"])
    return Arm(
        name=word(data["name"], "name"),
        urdf=urdf,
        description=described,
        model=model,
        root=root,
        joint_names=names,
        lower=lower,
        upper=upper,
        velocity=arm_file.limits(data, "velocity", model.velocityLimit, names, model),
        effort=arm_file.limits(data, "effort", model.effortLimit, names, model),
        home=hand_file.posture(data["home"], "home", names, lower, upper),
        base=hand_file.pose(data["base"], "base"),
        flange=flange,
        mount=mounts[arm_file.DEFAULT],
        mounts=mounts,
        spheres=spheres,
        pairs=hand_file.sphere_pairs(data["pairs"], spheres),
        folder=file.parent,
        digest=_digest(text, urdf.read_bytes()),
    )


def _check_home(arm: Arm) -> None:
    """Refuse pairs of spheres that overlap at home: they would overlap at every posture near it, too."""
    centres = places(arm.model, arm.base, arm.home, [(sphere.link, sphere.centre) for sphere in arm.spheres])
    for i, j in arm.pairs:
        one, other = arm.spheres[i], arm.spheres[j]
        overlap = one.radius + other.radius - float(np.linalg.norm(centres[i] - centres[j]))
        if overlap >= 0:
            raise InputError(f"pairs: '{one.name}' and '{other.name}' overlap by {1e3 * overlap:.1f} mm at home")


def _digest(*parts: Any) -> str:
    encoded = [part if isinstance(part, bytes) else str(part).encode() for part in parts]
    return hashlib.sha256(b"\0".join(encoded)).hexdigest()
