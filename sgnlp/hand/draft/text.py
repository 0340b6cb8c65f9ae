"""The text of a hand's file from a draft: each guess with a comment that says so, and the measure that it came from."""

import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

from sgnlp.base.arrays import Array
from sgnlp.hand.draft.draft import Draft
from sgnlp.hand.draft.place import source
from sgnlp.hand.draft.reference import GAP, finger_length
from sgnlp.hand.draft.strength import FORCE
from sgnlp.hand.model import own_joints

METRES, ANGLES, DEGREES = 4, 3, 1
"""Decimals of lengths [m], joint angles [rad] and angles of the wrist [deg]."""


def text(draft: Draft, folder: Path) -> str:
    """The text of the hand's file in a folder."""
    parts = (_head(draft, folder), _effort(draft), _fingers(draft), _reference(draft), _gains(draft), _wrist(draft))
    return "\n\n".join("\n".join(part) for part in (*parts, _spheres(draft))) + "\n"


def _head(draft: Draft, folder: Path) -> Iterator[str]:
    yield f"# Drafted from {draft.file.name}. What was guessed says so; compare it with the hand. Keys and units: urdf/README.md."
    yield f"name: {_word(draft.name)}"
    place = source(draft.file, folder)
    if isinstance(place, str):
        yield f"urdf: {_word(place)}"
    else:
        yield from ("urdf:", *(f"  {key}: {_word(value)}" for key, value in place.items()))
    if draft.searched:
        yield "# Guessed: the deepest link from which three or more chains of moving joints branch off."
    yield f"root: {_word(draft.body.skeleton.root)}"
    if draft.changes.mirror:
        yield "mirror: true"
    if draft.changes.limits:
        yield "# Guessed: the description gives these joints no ends. Write those of the hand."
        yield "limits:"
        yield from (f"  {_word(name)}: {_row(ends, ANGLES)}" for name, ends in draft.changes.limits.items())


def _effort(draft: Draft) -> Iterator[str]:
    names, strength = own_joints(draft.body.skeleton.model), draft.strength
    if strength.told.all():
        yield "# From the description. Compare it with what the motors really give."
    else:
        lacking = ", ".join(name for name, told in zip(names, strength.told, strict=True) if not told)
        yield f"# Guessed: {FORCE:g} N at the end of a stretched finger of {1e3 * finger_length(draft.body):.0f} mm, where the"
        yield f"# description gives nothing, or more than a finger's joint bears: {lacking}."
    if len({round(float(value), ANGLES) for value in strength.effort}) == 1:
        yield f"effort: {_number(strength.effort[0], ANGLES)}"
    else:
        yield f"effort: {_row(strength.effort, ANGLES)}  # {', '.join(names)}"


def _fingers(draft: Draft) -> Iterator[str]:
    if draft.ordered:
        yield "# Guessed: a finger for each chain of joints below the root, from the thumb's neighbour on, the thumb last. The"
        yield f"# thumb is {_finger(draft, draft.reference.thumb)}, the one that opposes the others best."
    yield "# Guessed: each pad is the sphere nearest to the skin of the finger's end, on the side that it closes to."
    yield "fingers:"
    for i, (chain, pad) in enumerate(zip(draft.body.chains, draft.body.pads, strict=True)):
        fit = "no mesh: the tip's link, and a radius that is common"
        if pad.rms is not None and pad.worst is not None:
            fit = f"skin off it by {1e3 * pad.rms:.1f} mm rms, {1e3 * pad.worst:.1f} mm at most"
        place = f"offset: {_row(_pad_offset(draft, i), METRES)}, radius: {_number(pad.radius, METRES)}"
        yield f"  - {{name: {_finger(draft, i)}, tip: {_word(chain.tip)}, {place}}}  # {fit}"


def _reference(draft: Draft) -> Iterator[str]:
    gap = 1e3 * GAP * finger_length(draft.body)
    yield "# Guessed: the posture in which the pads stand around a ball best, look at it, and the thumb opposes the others."
    yield f"# Ball: {2e3 * draft.reference.radius:.0f} mm wide at {_row(draft.reference.ball, METRES)} of the root, {gap:.0f} mm off the pads; cost {draft.reference.cost:.2f}."
    yield "reference:"
    names = own_joints(draft.body.skeleton.model)
    yield from (f"  {_word(name)}: {_number(q, ANGLES)}" for name, q in zip(names, draft.reference.joints, strict=True))


def _gains(draft: Draft) -> Iterator[str]:
    s = draft.strength
    yield f"# Guessed: in proportion to the {s.force:.1f} N that the efforts give at the end of a stretched finger, as the Allegro's."
    yield f"gains: {{lower: {s.lower:g}, upper: {s.upper:g}, initial: {_row(s.initial, 0)}}}"


def _wrist(draft: Draft) -> Iterator[str]:
    w = draft.wrist
    yield f"# Guessed: at the reference the fingers are at {_row(w.fingers, 2)} from the thumb, and the palm looks along {_row(w.palm, 2)}. The"
    yield "# starts are the paper's: they bring the middle between thumb and fingers where the Allegro's is."
    yield "wrist:"
    yield f"  root_euler_deg: {_row(w.euler_deg, DEGREES)}"
    yield "  starts:"
    for place, euler in zip(w.positions, w.angles_deg, strict=True):
        yield f"    - {{position: {_row(place, METRES)}, euler_deg: {_row(euler, DEGREES)}}}"


def _spheres(draft: Draft) -> Iterator[str]:
    yield "spheres:"
    yield "  # Guessed: the least number that leaves no point of a link's meshes more than 3 mm outside. A link's comment says how far"
    yield "  # the meshes are outside, and the spheres outside of the meshes, at most."
    yield "  cover:"
    yield "    spheres:"
    names = list(sphere_names(draft))
    for i, chain in enumerate(draft.body.chains):
        place = f"centre: {_row(_pad_offset(draft, i), METRES)}, radius: {_number(draft.body.pads[i].radius, METRES)}"
        yield f"      {names[i]}: {{link: {_word(chain.tip)}, {place}}}"
    rest = iter(names[len(draft.body.chains) :])
    for joint, cover in draft.body.covers.items():
        link = draft.body.skeleton.links(joint)[0]
        measure = f"{1e3 * max(cover.outside, 0):.1f} mm outside, {1e3 * cover.excess:.1f} mm bulge"
        yield f"      # {link}: {len(cover.balls)} spheres{' beside its pad' if draft.body.is_end(joint) else ''}, {measure}"
        for ball in cover.balls:
            centre = _in_link(draft, link, ball.centre)
            where = f"link: {_word(link)}, centre: {_row(centre, METRES)}, radius: {_number(ball.radius, METRES)}"
            yield f"      {next(rest)}: {{{where}}}"
    yield f"    pads: {{{', '.join(f'{_finger(draft, i)}: {names[i]}' for i in range(len(draft.body.chains)))}}}"
    yield f"    # Guessed: they find {100 * draft.pairs.share:.0f} % of the random postures in which two fingers, or a finger and the palm,"
    yield "    # overlap by more than 3 mm."
    if not draft.pairs.pairs:
        yield "    pairs: []"
        return
    yield "    pairs:"
    yield from (f"      - [{names[i]}, {names[j]}]" for i, j in draft.pairs.pairs)


def sphere_names(draft: Draft) -> Iterator[str]:
    """The names of the spheres of a draft, the pads first."""
    yield from (_word(f"{chain.name}_pad") for chain in draft.body.chains)
    for joint, cover in draft.body.covers.items():
        link = draft.body.skeleton.links(joint)[0]
        yield from (_word(f"{link}_{i}") for i in range(1, len(cover.balls) + 1))


def _finger(draft: Draft, i: int) -> str:
    return _word(str(draft.body.chains[i].name))


def _pad_offset(draft: Draft, i: int) -> Array:
    return _in_link(draft, draft.body.chains[i].tip, draft.body.pads[i].centre)


def _in_link(draft: Draft, link: str, point: Array) -> Array:
    """A point (3,) [m] in the frame of a link, from that of the joint that it moves with."""
    model = draft.body.skeleton.model
    return np.asarray(model.frames[model.getFrameId(link, pin.FrameType.BODY)].placement.actInv(point))


def _word(name: Any) -> str:
    """A text in YAML, in quotes where it needs them."""
    plain = re.fullmatch(r"[A-Za-z_.][\w./-]*", name) and isinstance(yaml.safe_load(name), str)
    return name if plain else json.dumps(name)


def _number(value: float, digits: int) -> str:
    """A number rounded, without the sign of a zero."""
    return f"{round(float(value), digits) + 0.0:g}"


def _row(values: Iterable[float], digits: int) -> str:
    return f"[{', '.join(_number(value, digits) for value in values)}]"
