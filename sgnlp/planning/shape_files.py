"""Shapes in a YAML file: obstacles, or regions of a surface.

    - {name: crate, box: [0.2, 0.3, 0.1], position: [0.3, 0, 0.05], euler_deg: [0, 0, 30]}
    - {sphere: 0.04, position: [0.1, 0.2, 0.04]}
    - {cylinder: {radius: 0.03, height: 0.2}, position: [0, 0.15, 0.1]}
    - {half_space: {normal: [1, 0, 0]}, position: [-0.3, 0, 0]}
    - {points: painted.npz, radius: 0.006}

Metres and degrees in the world frame; boxes and cylinders are turned by intrinsic XYZ angles. `points` is an npz beside
the YAML file with an array `points` (M, 3). Each point becomes a ball, which marks a part of a cloud.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sgnlp.base.arrays import Array, floats
from sgnlp.base.checked import typed
from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import Loader, any_mapping, mapping, positive, sequence, unknown_name, vector, word
from sgnlp.hand.hand_file import euler_rotation
from sgnlp.perception.shape import Shape
from sgnlp.planning.archive import read_archive

MOST_POINTS = 5000
"""Largest number of marked points: each is a shape of its own."""
POINTS = "an npz with an array 'points' (M, 3)"


@typed
def load_shapes(file: str | Path) -> tuple[Shape, ...]:
    """The shapes in a YAML file, in metres in the world frame.

    Raises:
        InputError: the file cannot be read or has a mistake; the message is one line that begins with its name.
    """
    path = Path(file)
    try:
        return tuple(shape for i, node in enumerate(_entries(path), 1) for shape in _shapes(node, f"shape {i}", path))
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


@typed
def painted(points: Array, radius: float, name: str = "marked points") -> tuple[Shape, ...]:
    """Balls of this radius [m] around points (M, 3) [m] in the world frame, such as the marked points of a cloud.

    Raises:
        InputError: the points are none, too many or not finite, or the radius is not positive.
    """
    P = floats(points, name, (None, 3))
    if not 0 < len(P) <= MOST_POINTS or not np.isfinite(P).all():
        raise InputError(f"'{name}' must be 1 to {MOST_POINTS} finite points (M, 3), not {P.shape}")
    return tuple(Shape.sphere(point, radius, name) for point in P)


def _entries(path: Path) -> list[Any]:
    try:
        node = yaml.load(path.read_text(encoding="utf-8"), Loader)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"is not YAML: {' '.join(str(error).split())}") from None
    found = sequence(node if isinstance(node, list) else [node], "the file")
    if node is None or not found:
        raise InputError("holds no shape")
    return found


def _shapes(node: Any, where: str, path: Path) -> tuple[Shape, ...]:
    entry = any_mapping(node, where)
    kinds = [kind for kind in KINDS if kind in entry]
    if len(kinds) != 1:
        found = " and ".join(map(repr, kinds or entry)) or "nothing"
        raise InputError(f"{where} must have one of {', '.join(KINDS)}; it has {found}")
    read, keys = KINDS[kinds[0]]
    for key in entry:
        if key not in (kinds[0], "name", *keys):
            raise unknown_name(f"key in {where}", key, (kinds[0], "name", *keys))
    name = word(entry.get("name", kinds[0].replace("_", "-")), f"the name of {where}")
    if "position" in keys and "position" not in entry:
        raise InputError(f"{where}: the key 'position' is missing")
    return read(entry, name, where, path)


def _place(entry: dict[str, Any], where: str) -> tuple[Array, Array]:
    """The position (3,) and rotation (3, 3) of an entry."""
    rotation = euler_rotation(entry.get("euler_deg", 0.0), f"euler_deg of {where}")
    return vector(entry["position"], f"position of {where}"), rotation


def _box(entry: dict[str, Any], name: str, where: str, path: Path) -> tuple[Shape, ...]:
    centre, rotation = _place(entry, where)
    return (Shape.box(centre, vector(entry["box"], f"box of {where}"), rotation, name),)


def _sphere(entry: dict[str, Any], name: str, where: str, path: Path) -> tuple[Shape, ...]:
    centre, _ = _place(entry, where)
    return (Shape.sphere(centre, positive(entry["sphere"], f"sphere of {where}"), name),)


def _cylinder(entry: dict[str, Any], name: str, where: str, path: Path) -> tuple[Shape, ...]:
    (centre, rotation), size = _place(entry, where), mapping(entry["cylinder"], where, ("radius", "height"))
    radius, height = (positive(size[key], f"{key} of {where}") for key in ("radius", "height"))
    return (Shape.cylinder(centre, radius, height, rotation, name),)


def _half_space(entry: dict[str, Any], name: str, where: str, path: Path) -> tuple[Shape, ...]:
    point, _ = _place(entry, where)
    normal = mapping(entry["half_space"], where, ("normal",))["normal"]
    return (Shape.half_space(point, vector(normal, f"normal of {where}"), name),)


def _points(entry: dict[str, Any], name: str, where: str, path: Path) -> tuple[Shape, ...]:
    file = path.parent / word(entry["points"], f"points of {where}")
    radius = positive(entry.get("radius", 0.006), f"radius of {where}")
    try:
        return painted(read_archive(file, POINTS, lambda data: data["points"]), radius, name)
    except InputError as error:
        raise error.within(where) from None


Reader = Callable[[dict[str, Any], str, str, Path], tuple[Shape, ...]]
KINDS: dict[str, tuple[Reader, tuple[str, ...]]] = {
    "box": (_box, ("position", "euler_deg")),
    "sphere": (_sphere, ("position",)),
    "cylinder": (_cylinder, ("position", "euler_deg")),
    "half_space": (_half_space, ("position",)),
    "points": (_points, ("radius",)),
}
"""The reader of each kind of shape, and the keys that it may have besides its own and `name`."""
