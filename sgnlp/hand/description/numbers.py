"""Checks the numbers of a description's links and joints: their count in an attribute, and their range."""

import xml.etree.ElementTree as ElementTree

import numpy as np

from sgnlp.base.errors import InputError

INERTIA = dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1)
NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "mimic": {"multiplier": 1, "offset": 1},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "box": {"size": 3},
    "mesh": {"scale": 3},
    "mass": {"value": 1},
    "inertia": INERTIA,
}
"""The count of numbers in the attributes of an element of a link or joint."""
TURN = 2 * np.pi + 0.01
"""[rad] The largest angle of a rotation, with its rounding: one turn."""
SOLIDS = ("sphere", "cylinder", "capsule", "box")


def check_numbers(element: ElementTree.Element, owner: str) -> None:
    """Check that all numbers of a link or joint are finite, sizes are positive, and no mass is negative."""
    for part in element.iter():
        for key, count in NUMBERS.get(part.tag, {}).items():
            text = part.get(key)
            if text is None:
                if part.tag in SOLIDS:
                    raise InputError(f"{owner}: <{part.tag}> has no {key}; give it one [m]")
                continue
            values = _floats(text)
            what = f"{owner}: {key} of <{part.tag}>"
            if values is None or len(values) != count or not np.isfinite(values).all():
                number = "a finite number" if count == 1 else f"{count} finite numbers with spaces between"
                raise InputError(f"{what} must be {number}, not '{text}'")
            if part.tag in SOLIDS and min(values) <= 0:
                raise InputError(f"{what} must be positive, not '{text}'")
            if (part.tag == "mesh" and 0 in values) or (part.tag == "axis" and not any(values)):
                raise InputError(f"{what} must not be 0, but is '{text}'")
            if key == "rpy" and max(map(abs, values)) > TURN:
                raise InputError(f"{what} must be within one turn, in radians, not '{text}'; are these degrees?")
            if part.tag == "mass" and values[0] < 0:
                raise InputError(f"{what} must not be negative, but is {text}")


def _floats(text: str) -> list[float] | None:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return None
