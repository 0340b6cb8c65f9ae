"""The hand: kinematic model, fingers, collision spheres, reference pose, wrist starts and gain bounds.

A hand is a folder of `urdf/` holding one `hand.yaml` (its keys are described in `urdf/README.md`). Nothing here
depends on the number of fingers or on the names of one hand.
"""

import functools
import hashlib
import importlib.metadata
import importlib.resources
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

from sgnlp.errors import InputError, unknown
from sgnlp.nodes import Array, any_mapping, check_order, frozen, mapping, numbers, positive, sequence

HAND_FILE = "hand.yaml"
MIN_FINGERS = 3  # fewer frictional point contacts cannot hold a rigid body against every wrench


@dataclass(frozen=True, eq=False)
class Finger:
    """A finger whose tip is a sphere of `radius` [m] centred at `offset` (3,) [m] in the link `frame`."""

    name: str
    frame: str
    offset: Array
    radius: float
    joints: tuple[int, ...]
    """Indices into `Hand.joint_names` of the joints between the root and the tip, root first."""


@dataclass(frozen=True, eq=False)
class Sphere:
    """A collision sphere of `radius` [m] fixed to `link`, with its `centre` (3,) [m] in the link's frame."""

    name: str
    link: str
    centre: Array
    radius: float


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


@dataclass(frozen=True, eq=False)
class Hand:
    """A multi-fingered hand with n joints and m fingers; every joint array follows `joint_names`."""

    name: str
    urdf: Path
    model: pin.Model
    """The tree of joints with the root link fixed at the origin (no free flyer)."""
    root: str
    joint_names: tuple[str, ...]
    """The n joints in Pinocchio's order, which sorts by name and not by finger."""
    lower: Array  # (n,) [rad or m]
    upper: Array  # (n,) [rad or m]
    effort: Array  # (n,) [N m or N]
    velocity: Array  # (n,) [rad/s or m/s]
    reference: Array  # (n,) [rad or m]
    fingers: tuple[Finger, ...]
    spheres: tuple[Sphere, ...]
    tip_spheres: tuple[int, ...]
    """Index into `spheres` of each finger's pad, in finger order."""
    pairs: tuple[tuple[int, int], ...]
    """Indices into `spheres` of the pairs checked for self-collision."""
    wrist_starts: tuple[WristStart, ...]
    gain_lower: Array  # (m,) [N/m]
    gain_upper: Array  # (m,) [N/m]
    gain_initial: Array  # (m,) [N/m]
    digest: str
    """SHA-256 of the description, the URDF and the preset of spheres."""


def available_hands() -> tuple[str, ...]:
    """The names that `load_hand` knows, sorted."""
    return tuple(sorted(file.parent.name for file in _library().glob(f"*/{HAND_FILE}")))


def load_hand(name_or_folder: str | Path, spheres: str = "cover") -> Hand:
    """The hand of that name in `urdf/`, or of a folder holding `hand.yaml`, with one preset of its spheres.

    Raises `InputError`, in one line, for an unknown hand, preset, key, link or joint and for values that contradict
    each other or the URDF.
    """
    file = Path(name_or_folder) / HAND_FILE
    if str(name_or_folder) in available_hands():
        file = _library() / str(name_or_folder) / HAND_FILE
    if not file.is_file():
        raise unknown("hand", str(name_or_folder), [*available_hands(), f"a folder holding {HAND_FILE}"])
    try:
        return _loaded(file, file.read_text(), spheres)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"{file} is not YAML: {' '.join(str(error).split())}") from None
    except InputError as error:
        raise InputError(f"{file.parent.name}/{file.name}: {error}") from None


@functools.lru_cache(maxsize=16)
def _loaded(file: Path, text: str, preset: str) -> Hand:
    """The same text gives the same hand, so what is built for a hand is built once."""
    return _build(file, yaml.safe_load(text), preset, text)


def _library() -> Path:
    """The folder of the hand descriptions: in the installed package, else beside it in the source tree."""
    try:
        return Path(str(importlib.resources.files("sgnlp.urdf")))
    except ModuleNotFoundError:
        return Path(__file__).parents[1] / "urdf"


def _build(file: Path, tree: Any, preset: str, text: str) -> Hand:
    required = ("name", "urdf", "root", "effort", "fingers", "reference", "gains", "wrist", "spheres")
    data = mapping(tree, "the file", required)
    urdf = _urdf(data["urdf"], file.parent)
    model = _model(urdf, data["root"])
    names = tuple(model.names)[1:]
    fingers = tuple(_finger(node, model) for node in sequence(data["fingers"], "fingers"))
    if len({finger.name for finger in fingers}) < max(MIN_FINGERS, len(fingers)):
        raise InputError(f"{len(fingers)} fingers given; at least {MIN_FINGERS} of different names are needed")
    spheres, tips, pairs = _spheres(data["spheres"], preset, model, fingers)
    lower, upper = frozen(model.lowerPositionLimit), frozen(model.upperPositionLimit)
    gains = mapping(data["gains"], "gains", ("lower", "upper", "initial"))
    gain_lower, gain_upper, gain_initial = (
        numbers(gains[key], (len(fingers),), f"gains {key}") for key in ("lower", "upper", "initial")
    )
    check_order(gain_lower, gain_initial, gain_upper, [finger.name for finger in fingers], "gain")
    angles = mapping(data["reference"], "reference", names)
    reference = numbers([angles[name] for name in names], (len(names),), "reference")
    check_order(lower, reference, upper, names, "reference angle")
    return Hand(
        name=str(data["name"]),
        urdf=urdf,
        model=model,
        root=data["root"],
        joint_names=names,
        lower=lower,
        upper=upper,
        effort=numbers(data["effort"], (len(names),), "effort"),
        velocity=frozen(model.velocityLimit),
        reference=reference,
        fingers=fingers,
        spheres=spheres,
        tip_spheres=tips,
        pairs=pairs,
        wrist_starts=_wrist_starts(data["wrist"]),
        gain_lower=gain_lower,
        gain_upper=gain_upper,
        gain_initial=gain_initial,
        digest=hashlib.sha256(b"\0".join([text.encode(), urdf.read_bytes(), preset.encode()])).hexdigest(),
    )


def _urdf(source: Any, folder: Path) -> Path:
    """The URDF: a file beside the YAML, or a path inside an installed package that carries no Python module."""
    if isinstance(source, str):
        path: Path | None = folder / source
    else:
        source = mapping(source, "urdf", ("package", "path"))
        path = _packaged(source["package"], source["path"])
    if path is None or not path.is_file():
        raise InputError(f"the URDF {source} is not there; is its package installed?")
    return path


@functools.cache
def _packaged(package: str, path: str) -> Path | None:
    shared = Path(sys.prefix) / "share" / package / path  # where conda and source builds put it
    if shared.is_file():
        return shared
    try:
        files = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    return next((Path(str(f.locate())) for f in files if str(f).endswith(f"{package}/{path}")), None)


def _model(urdf: Path, root: str) -> pin.Model:
    try:
        joints = ElementTree.parse(urdf).iter("joint")
        mimics = [joint.get("name") for joint in joints if joint.find("mimic") is not None]
        model = pin.buildModelFromUrdf(str(urdf))
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(f"{urdf.name} is not a URDF: {error}") from None
    if mimics:
        raise InputError(f"{urdf.name} has mimic joints ({', '.join(map(str, mimics))}), which are not supported")
    base = model.frames[1].name  # the frame after 'universe' is the URDF's root link
    if root != base:
        raise InputError(f"the root must be the URDF's root link '{base}', not '{root}'")
    for name, joint in zip(model.names[1:], model.joints[1:], strict=True):
        if joint.nq != 1 or joint.nv != 1:
            raise InputError(f"joint '{name}' is {joint.shortname()}; only bounded revolute and prismatic joints work")
    for name, low, high in zip(model.names[1:], model.lowerPositionLimit, model.upperPositionLimit, strict=True):
        if not -np.inf < low < high < np.inf:
            raise InputError(f"joint '{name}' has the limits [{low:g}, {high:g}]; they must be finite and ordered")
    return model


def _finger(node: Any, model: pin.Model) -> Finger:
    data = mapping(node, "a finger", ("name", "tip", "offset", "radius"))
    name = str(data["name"])
    frame = model.frames[_link(data["tip"], model, f"tip of finger '{name}'")]
    chain = tuple(joint - 1 for joint in model.supports[frame.parentJoint] if joint > 0)
    if not chain:
        raise InputError(f"finger '{name}': no movable joint between the root and '{frame.name}'")
    offset = numbers(data["offset"], (3,), f"offset of finger '{name}'")
    return Finger(name, frame.name, offset, positive(data["radius"], f"radius of finger '{name}'"), chain)


def _spheres(
    node: Any, preset: str, model: pin.Model, fingers: tuple[Finger, ...]
) -> tuple[tuple[Sphere, ...], tuple[int, ...], tuple[tuple[int, int], ...]]:
    """The spheres of one preset, the index of each finger's pad among them, and the self-collision pairs."""
    presets = any_mapping(node, "spheres")
    if preset not in presets:
        raise unknown("preset of spheres", preset, presets)
    data = mapping(presets[preset], f"spheres {preset}", ("spheres", "pads", "pairs"))
    spheres = tuple(_sphere(name, value, model) for name, value in any_mapping(data["spheres"], "spheres").items())
    index = {sphere.name: i for i, sphere in enumerate(spheres)}

    def find(name: Any, kind: str) -> int:
        if name not in index:
            raise unknown(kind, str(name), index)
        return index[name]

    pads = mapping(data["pads"], "pads", [finger.name for finger in fingers])
    tips = tuple(find(pads[finger.name], f"sphere of the pad of finger '{finger.name}'") for finger in fingers)
    pairs = []
    for pair in sequence(data["pairs"], "pairs"):
        if len(sequence(pair, "a pair")) != 2 or pair[0] == pair[1]:
            raise InputError(f"a pair must be two different spheres, not {pair}")
        pairs.append((find(pair[0], "sphere in a pair"), find(pair[1], "sphere in a pair")))
    return spheres, tips, tuple(pairs)


def _sphere(name: str, node: Any, model: pin.Model) -> Sphere:
    data = mapping(node, f"sphere '{name}'", ("link", "centre", "radius"))
    link = model.frames[_link(data["link"], model, f"link of sphere '{name}'")].name
    centre = numbers(data["centre"], (3,), f"centre of sphere '{name}'")
    return Sphere(name, link, centre, positive(data["radius"], f"radius of sphere '{name}'"))


def _wrist_starts(node: Any) -> tuple[WristStart, ...]:
    """Wrist starts from `position` [m] and intrinsic XYZ `euler_deg`, followed by the fixed turn `root_euler_deg`."""
    data = mapping(node, "wrist", ("root_euler_deg", "starts"))
    turn = _rotation(data["root_euler_deg"], "root_euler_deg")
    starts = []
    for i, entry in enumerate(sequence(data["starts"], "wrist starts"), 1):
        start = mapping(entry, f"wrist start {i}", ("position", "euler_deg"))
        rotation = _rotation(start["euler_deg"], f"euler_deg of wrist start {i}") @ turn
        quaternion = frozen(pin.Quaternion(rotation).normalized().coeffs())
        starts.append(WristStart(numbers(start["position"], (3,), f"position of wrist start {i}"), quaternion))
    return tuple(starts)


def _rotation(euler_deg: Any, where: str) -> Array:
    """The rotation Rx(a) Ry(b) Rz(c) of intrinsic XYZ angles (3,) [deg]."""
    angles = np.radians(numbers(euler_deg, (3,), where))
    rx, ry, rz = (pin.utils.rotate(axis, angle) for axis, angle in zip("xyz", angles, strict=True))
    return rx @ ry @ rz


def _link(name: Any, model: pin.Model, kind: str) -> int:
    """The index of the link's frame in the model."""
    if not model.existFrame(str(name), pin.FrameType.BODY):
        raise unknown(kind, str(name), [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY])
    return model.getFrameId(str(name), pin.FrameType.BODY)
