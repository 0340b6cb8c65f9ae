"""The parts of a hand's file `hand.yaml`, each read and checked separately. `urdf/README.md` describes the keys."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError, unknown
from sgnlp.base.yaml_nodes import (
    Loader,
    any_mapping,
    check_order,
    frozen,
    mapping,
    numbers,
    positive,
    sequence,
    unknown_name,
    word,
)
from sgnlp.hand import plausible
from sgnlp.hand.description import Changes
from sgnlp.hand.model import coordinates, link

KEYS = ("name", "urdf", "root", "effort", "fingers", "reference", "gains", "wrist", "spheres")
OPTIONAL = ("limits", "couplings", "mirror")
"""Keys with which a hand's file changes its description."""
POSE_KEYS = ("position", "euler_deg")
MIN_FINGERS = 3  # fewer frictional point contacts cannot hold a rigid body against every wrench


@dataclass(frozen=True, eq=False)
class Finger:
    """A finger whose tip is a sphere of `radius` [m] centred at `offset` (3,) [m] in the link `frame`."""

    name: str
    frame: str
    offset: Array
    radius: float
    joints: tuple[int, ...]
    """Indices into `Hand.joint_names` of the joints that move the tip, root first; mimic joints count as their
    leaders."""


@dataclass(frozen=True, eq=False)
class Sphere:
    """A collision sphere of `radius` [m] fixed to `link`, with its `centre` (3,) [m] in the link's frame."""

    name: str
    link: str
    centre: Array
    radius: float


@dataclass(frozen=True, eq=False)
class SphereSet:
    """A preset: its spheres, the index of each finger's pad among them, and the pairs checked for self-collision."""

    spheres: tuple[Sphere, ...]
    pads: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class WristStart:
    """An initial pose of the hand's root link, relative to the bounding box of the observed points."""

    position: Array
    """(3,) [m], from the middle of the box's top face, world axes."""
    quaternion: Array
    """(4,) x y z w, the orientation of the root link in the world."""

    def pose(self, centre: Array, extents: Array) -> Array:
        """The root link's pose (7,), x y z qx qy qz qw, for a box of `centre` (3,) and `extents` (3,) [m]."""
        top = np.asarray(centre, float) + np.array([0.0, 0.0, 0.5 * float(extents[2])])
        return np.concatenate([top + self.position, self.quaternion])


def text(file: Path) -> str:
    """The text of the file."""
    try:
        return file.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{file} is not YAML: {error}") from None
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}") from None


def entries(content: str, keys: Sequence[str] = KEYS, optional: Sequence[str] = OPTIONAL) -> dict[str, Any]:
    """The entries of the file from its text: exactly those of `keys`, and any of the optional ones."""
    try:
        return mapping(yaml.load(content, Loader), "the file", keys, optional)
    except (yaml.YAMLError, ValueError, TypeError) as error:
        line = mark.line + 1 if (mark := getattr(error, "problem_mark", None)) else 0
        if line and "\t" in "".join(content.splitlines()[line - 1 : line]):
            raise InputError(f"line {line} of the file has a tab; YAML is indented by spaces") from None
        raise InputError(f"the file is not YAML: {' '.join(str(error).split())}") from None


def changes(data: Mapping[str, Any]) -> Changes:
    """The changes to the description in the entries of a file."""
    limits, couplings = (any_mapping(data.get(key, {}), key) for key in ("limits", "couplings"))
    mirror = data.get("mirror", False)
    if not isinstance(mirror, bool):
        raise InputError(f"mirror must be true or false, not {mirror}")
    return Changes(
        limits={name: _pair(ends, f"limits of joint '{name}'") for name, ends in limits.items()},
        couplings={name: _coupling(law, f"coupling of joint '{name}'") for name, law in couplings.items()},
        mirror=mirror,
    )


def _pair(node: Any, where: str) -> tuple[float, float]:
    if len(sequence(node, where)) != 2:
        raise InputError(f"{where} must be two numbers, [lower, upper], not {node}")
    lower, upper = numbers(node, (2,), where)
    return float(lower), float(upper)


def _coupling(node: Any, where: str) -> tuple[str, float, float]:
    law = mapping(node, where, ("joint", "multiplier", "offset"))
    multiplier, offset = (
        float(numbers(law[key], (1,), f"{key} of the {where}")[0]) for key in ("multiplier", "offset")
    )
    return word(law["joint"], where), multiplier, offset


def fingers(node: Any, model: pin.Model) -> tuple[Finger, ...]:
    """The fingers, in the file's order."""
    read = tuple(finger(entry, model) for entry in sequence(node, "fingers"))
    if len({one.name for one in read}) < max(MIN_FINGERS, len(read)):
        raise InputError(f"{len(read)} fingers given; at least {MIN_FINGERS} of different names are needed")
    for one, other in combinations(read, 2):
        if one.frame == other.frame:
            raise InputError(f"fingers '{one.name}' and '{other.name}' have one tip, '{one.frame}'; each has its own")
    return read


def finger(node: Any, model: pin.Model) -> Finger:
    """One finger."""
    data = mapping(node, "a finger", ("name", "tip", "offset", "radius"))
    name = word(data["name"], "the name of a finger")
    frame = link(data["tip"], model, f"tip of finger '{name}'")
    joints, tip = coordinates(model, frame), model.frames[frame].name
    if not joints:
        raise InputError(f"finger '{name}': no movable joint between the root and '{tip}'")
    offset = numbers(data["offset"], (3,), f"offset of finger '{name}'")
    radius = _radius(data["radius"], f"radius of finger '{name}'", plausible.PAD)
    plausible.check_beside(offset, radius, tip, model, f"the pad of finger '{name}'")
    return Finger(name, tip, offset, radius, joints)


def effort(node: Any, names: Sequence[str], model: pin.Model) -> Array:
    """The largest torque (n,) [N m] of each joint."""
    values = numbers(node, (len(names),), "effort")
    for name, value in zip(names, values, strict=True):
        positive(value, f"effort of joint '{name}'")
    plausible.check_joints(model, names, values, plausible.EFFORT, "effort of joint")
    return values


def posture(node: Any, where: str, names: Sequence[str], lower: Array, upper: Array) -> Array:
    """An angle for every joint by its name (n,) [rad or m], inside the limits."""
    angles = mapping(node, where, names)
    values = numbers([angles[name] for name in names], (len(names),), where)
    check_order(lower, values, upper, names, f"{where} angle")
    return values


def gains(node: Any, names: Sequence[str]) -> tuple[Array, Array, Array]:
    """Lower, upper and initial gains (m,) [N/m] of the fingers."""
    data = mapping(node, "gains", ("lower", "upper", "initial"))
    lower, upper, initial = (numbers(data[key], (len(names),), f"gains {key}") for key in ("lower", "upper", "initial"))
    positive(lower.min(), "gains lower")
    check_order(lower, initial, upper, names, "gain")
    for key, values in (("lower", lower), ("upper", upper)):
        for name, value in zip(names, values, strict=True):
            plausible.GAIN.check(value, f"gain {key} of finger '{name}'")
    return lower, upper, initial


def spheres(node: Any, preset: str, model: pin.Model, names: Sequence[str]) -> SphereSet:
    """The spheres of one preset, for fingers of these names."""
    presets = any_mapping(node, "spheres")
    if preset not in presets:
        raise unknown("preset of spheres", preset, presets)
    data = mapping(presets[preset], f"spheres {preset}", ("spheres", "pads", "pairs"))
    read = sphere_list(data["spheres"], model)
    pads = mapping(data["pads"], "pads", names)
    tips = tuple(_index(read, pads[name], f"sphere of the pad of finger '{name}'") for name in names)
    if len(set(tips)) < len(tips):
        twice = next(tip for tip in tips if tips.count(tip) > 1)
        raise InputError(f"pads: the sphere '{read[twice].name}' is the pad of two fingers; name each one's own")
    return SphereSet(read, tips, sphere_pairs(data["pairs"], read))


def sphere_list(node: Any, model: pin.Model) -> tuple[Sphere, ...]:
    """Spheres by name, in the file's order, on links of the model."""
    return tuple(_sphere(name, value, model) for name, value in any_mapping(node, "spheres").items())


def sphere_pairs(node: Any, among: Sequence[Sphere]) -> tuple[tuple[int, int], ...]:
    """Pairs of names of spheres as indices into `among`."""
    pairs = []
    for pair in sequence(node, "pairs"):
        if len(sequence(pair, "a pair")) != 2 or pair[0] == pair[1]:
            raise InputError(f"a pair must be two different spheres, not {pair}")
        pairs.append((_index(among, pair[0], "sphere in a pair"), _index(among, pair[1], "sphere in a pair")))
    return tuple(pairs)


def _index(among: Sequence[Sphere], name: Any, kind: str) -> int:
    index = {sphere.name: i for i, sphere in enumerate(among)}
    if str(name) not in index:
        raise unknown_name(kind, str(name), index)
    return index[str(name)]


def _sphere(name: str, node: Any, model: pin.Model) -> Sphere:
    data = mapping(node, f"sphere '{name}'", ("link", "centre", "radius"))
    on = model.frames[link(data["link"], model, f"link of sphere '{name}'")].name
    centre = numbers(data["centre"], (3,), f"centre of sphere '{name}'")
    radius = _radius(data["radius"], f"radius of sphere '{name}'", plausible.RADIUS)
    plausible.check_beside(centre, radius, on, model, f"sphere '{name}'")
    return Sphere(name, on, centre, radius)


def _radius(node: Any, where: str, span: plausible.Span) -> float:
    found = positive(node, where)
    span.check(found, where)
    return found


def wrist_starts(node: Any) -> tuple[WristStart, ...]:
    """Wrist starts from `position` [m] and intrinsic XYZ `euler_deg`, followed by the fixed turn `root_euler_deg`."""
    data = mapping(node, "wrist", ("root_euler_deg", "starts"))
    turn = euler_rotation(data["root_euler_deg"], "root_euler_deg")
    starts = []
    for i, entry in enumerate(sequence(data["starts"], "wrist starts"), 1):
        start = mapping(entry, f"wrist start {i}", POSE_KEYS)
        rotation = euler_rotation(start["euler_deg"], f"euler_deg of wrist start {i}") @ turn
        quaternion = frozen(pin.Quaternion(rotation).normalized().coeffs())
        starts.append(WristStart(_near(start["position"], f"position of wrist start {i}"), quaternion))
    if not starts:
        raise InputError("wrist starts must be a list of one at least")
    return tuple(starts)


def _near(node: Any, where: str) -> Array:
    """A position (3,) [m] near the hand."""
    found = numbers(node, (3,), where)
    plausible.PLACE.check(float(np.linalg.norm(found)), where)
    return found


def palm_direction(node: Any) -> Array:
    """The unit vector (3,) that the palm faces, in the root's frame: with only `root_euler_deg` applied it is down."""
    turn = euler_rotation(mapping(node, "wrist", ("root_euler_deg", "starts"))["root_euler_deg"], "root_euler_deg")
    return frozen(turn.T @ [0.0, 0.0, -1.0])


def mount(node: Any, where: str) -> Array:
    """The pose (7,) of a hand on a flange, as `pose`; it is near."""
    found = pose(node, where)
    _near(list(found[:3]), f"position of {where}")
    return found


def pose(node: Any, where: str) -> Array:
    """The pose (7,), x y z qx qy qz qw, of a `position` [m] and intrinsic XYZ `euler_deg`."""
    data = mapping(node, where, POSE_KEYS)
    rotation = euler_rotation(data["euler_deg"], f"euler_deg of {where}")
    quaternion = pin.Quaternion(rotation).normalized().coeffs()
    return frozen([*numbers(data["position"], (3,), f"position of {where}"), *quaternion])


def euler_rotation(euler_deg: Any, where: str) -> Array:
    """The rotation Rx(a) Ry(b) Rz(c) of intrinsic XYZ angles (3,) [deg]."""
    angles = numbers(euler_deg, (3,), where)
    plausible.check_degrees(angles, where)
    rx, ry, rz = (pin.utils.rotate(axis, angle) for axis, angle in zip("xyz", np.radians(angles), strict=True))
    return rx @ ry @ rz
