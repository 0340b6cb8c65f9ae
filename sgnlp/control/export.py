"""Hand, grasp and law in one plain text file, for the controller in C++.

Words and numbers have a fixed order, with white space between them; a name is the rest of its line. Numbers are written
with all digits, so that reading restores every bit. `include/sgnlp/controller.hpp` reads the file.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.checked import require
from sgnlp.base.errors import InputError
from sgnlp.control.controller import Controller
from sgnlp.control.law import FREE_LENGTH

VERSION = 1
"""Of the file."""


def include() -> Path:
    """The folder of the header, for the compiler: `#include <sgnlp/controller.hpp>`."""
    return Path(__file__).parent / "include"


def export(controller: Controller, file: str | Path) -> None:
    """Write the file that the C++ controller reads: hand, grasp and law.

    Raises:
        InputError: `controller` is none, a number is not finite, or the file cannot be written.
    """
    require("controller", controller, Controller)
    require("file", file, str | Path)
    text = written(controller)
    try:
        Path(file).write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"'{file}' cannot be written: {error.strerror}") from None


def written(controller: Controller) -> str:
    """The text of the file."""
    told, law, held = controller.command, controller.law, controller.posture is not None
    lines = [
        _line("sgnlp-controller", VERSION),
        f"law {law.control}",
        _line("gravity", law.gravity),
        _line("tip_mass", law.tip_mass),
        _line("joint_inertia", law.joint_inertia),
        _line("free_length", FREE_LENGTH),
        _line("seconds", told.closing_seconds),
        _line("posture", told.posture if held else 0.0),
        _line("joint_stiffness", told.joint_stiffness),
        *_joints(controller),
        *_fingers(controller),
        _line("wrist", told.wrist),
        _line("pregrasp", told.joints),
        _line("contact", controller.posture if held else told.joints),
        _line("begin", controller.begin),
        _line("end", controller.end),
    ]
    return "\n".join(lines) + "\n"


def _joints(controller: Controller) -> Iterator[str]:
    """All moving joints: parent, own joint, multiplier, offset, whether prismatic, placement, axis, mass, centre."""
    tree, hand = controller.tree, controller.hand
    model = tree.model
    yield _line("joints", model.njoints - 1)
    for i in range(1, model.njoints):
        own = int(np.flatnonzero(tree.coupling[i - 1])[0])
        place, body = model.jointPlacements[i], model.inertias[i]
        linear, angular = _axis(model, i)
        slides = int(linear.any())
        row = [model.parents[i] - 1, own, tree.coupling[i - 1, own], tree.offset[i - 1], slides]
        row += [*place.rotation.ravel(), *place.translation, *(linear + angular), body.mass, *body.lever]
        yield f"{_numbers(row)} {model.names[i]}"
    yield _line("own", len(hand.joint_names))
    for effort, name in zip(hand.effort, hand.joint_names, strict=True):
        yield f"{_numbers(effort)} {name}"


def _fingers(controller: Controller) -> Iterator[str]:
    """For each finger: the joint that moves the tip, the tip's position in the joint's frame, the gain."""
    hand = controller.hand
    yield _line("fingers", len(hand.fingers))
    ends, gains = controller.tree.tip_frames, controller.command.gains
    for finger, (joint, place), gain in zip(hand.fingers, ends, gains, strict=True):
        yield f"{_numbers([joint - 1, *place, gain])} {finger.name}"


def _axis(model: pin.Model, joint: int) -> tuple[Array, Array]:
    """The axes of translation and of rotation of a joint in its own frame; one of them is zero."""
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, np.zeros(model.nq))
    subspace = np.asarray(data.S).ravel()
    return subspace[:3], subspace[3:]


def _line(word: str, values: Any) -> str:
    return f"{word} {_numbers(values)}"


def _numbers(values: Any) -> str:
    """Numbers with all digits, so that reading restores every bit."""
    flat = np.ravel(values)
    if not np.isfinite(flat).all():
        raise InputError(f"a number of the grasp or the hand is not finite: {flat}")
    return " ".join(f"{value:.17g}" for value in flat)
