"""The text of a hand's file from a draft; each guess has a comment with the measurement behind it."""

import json
import os
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
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
from sgnlp.hand.findings import MAX_EFFORT
from sgnlp.hand.model import own_joints

METRES, ANGLES, DEGREES = 4, 3, 1
"""Decimals of lengths [m], joint angles [rad] and angles of the wrist [deg]."""
KEYS = "Keys and units: urdf/README.md."
WIDTH = 120
"""Width of a comment's lines."""


def text(draft: Draft, folder: Path) -> str:
    """The text of the hand's file in a folder."""
    parts = (_head(draft, folder), _effort(draft), _fingers(draft), _reference(draft), _gains(draft), _wrist(draft))
    return "\n\n".join("\n".join(part) for part in (*parts, _spheres(draft))) + "\n"


def _head(draft: Draft, folder: Path) -> Iterator[str]:
    yield from _note(f"Drafted from {draft.file.name}. What is guessed says so: compare it with the hand. {KEYS}")
    yield f"name: {_word(Path(os.path.abspath(folder)).name)}"
    place = source(draft.file, folder)
    if isinstance(place, str):
        yield f"urdf: {_word(place)}"
    else:
        yield from ("urdf:", *(f"  {key}: {_word(value)}" for key, value in place.items()))
    if draft.radians:
        yield from _note("Guessed: its angles are radians, since no hinge turns by more than 6.28; it does not say so.")
    if draft.searched:
        yield from _note("Guessed: the deepest link from which three or more chains of moving joints branch off.")
    yield f"root: {_word(draft.body.skeleton.root)}"
    if draft.changes.mirror:
        yield "mirror: true"
    if draft.changes.limits:
        yield from _note("Guessed: the description gives these joints no ends. Write those of the hand.")
        yield "limits:"
        yield from (f"  {_word(name)}: {_row(ends, ANGLES)}" for name, ends in draft.changes.limits.items())
    if draft.changes.couplings:
        yield "couplings:"
        for name, (other, factor, _) in draft.changes.couplings.items():
            yield f"  {_word(name)}: {{joint: {_word(other)}, multiplier: {factor:g}, offset: 0}}"


def listed(names: Sequence[str]) -> str:
    """Names in a sentence."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _effort(draft: Draft) -> Iterator[str]:
    names, strength = own_joints(draft.body.skeleton.model), draft.strength
    if strength.told.all():
        yield from _note("From the description. Compare it with what the motors really give.")
    else:
        lacking = ", ".join(name for name, told in zip(names, strength.told, strict=True) if not told)
        lever = f"{FORCE:g} N at the end of a stretched finger of {1e3 * draft.strength.length:.0f} mm"
        why = f"the description gives nothing or more than {MAX_EFFORT:g} N m"
        yield from _note(f"Guessed: {lever}, where {why}: {lacking}.")
    if len({round(float(value), ANGLES) for value in strength.effort}) == 1:
        yield f"effort: {_number(strength.effort[0], ANGLES)}"
    else:
        yield from _note(f"In this order: {', '.join(names)}.")
        yield f"effort: {_row(strength.effort, ANGLES)}"


def _fingers(draft: Draft) -> Iterator[str]:
    if draft.ordered:
        thumb = f"{_finger(draft, draft.reference.thumb)} opposes the others best, or is named the thumb"
        order = "from the thumb's neighbour on, the thumb last"
        yield from _note(f"Guessed: a finger for each chain of joints below the root, {order}: {thumb}.")
    if draft.left:
        names = listed(draft.left)
        few = f"{names} have too few joints to touch an object together with the others, so they are no fingers here"
        yield from _note(f"Guessed: {few}. Their links are kept clear of it.")
    yield from _note("Guessed: each pad is the sphere nearest to the skin of the end, on the side that it closes to.")
    yield "fingers:"
    for i, (chain, pad) in enumerate(zip(draft.body.chains, draft.body.pads, strict=True)):
        fit = "no mesh: the tip's link, and a radius that is common"
        if pad.rms is not None and pad.worst is not None:
            fit = f"skin {1e3 * pad.rms:.1f} mm off (rms), {1e3 * pad.worst:.1f} at most"
        place = f"offset: {_row(_pad_offset(draft, i), METRES)}, radius: {_number(pad.radius, METRES)}"
        yield f"  - {{name: {_finger(draft, i)}, tip: {_word(chain.tip)}, {place}}}  # {fit}"


def _reference(draft: Draft) -> Iterator[str]:
    found, gap = draft.reference, GAP * finger_length(draft.body)
    ball = (
        f"{2e3 * found.radius:.0f} mm wide at {_row(found.ball, METRES)} in the root link, {1e3 * gap:.0f} mm from them"
    )
    what = "the pads stand around a ball and look at it, the thumb opposite the others"
    yield from _note(
        f"Guessed: the posture in which {what}. The ball is {ball}; the least squares are {found.cost:.2f}."
    )
    yield "reference:"
    names = own_joints(draft.body.skeleton.model)
    yield from (f"  {_word(name)}: {_number(q, ANGLES)}" for name, q in zip(names, found.joints, strict=True))


def _gains(draft: Draft) -> Iterator[str]:
    found = draft.strength
    force = f"{found.force:.1f} N at the end of a stretched finger, by the efforts"
    yield from _note(f"Guessed: in proportion to the {force}; the Allegro's, from {FORCE:g} N on.")
    yield f"gains: {{lower: {found.lower:g}, upper: {found.upper:g}, initial: {_row(found.initial, 0)}}}"


def _wrist(draft: Draft) -> Iterator[str]:
    found = draft.wrist
    fingers, palm = _row(found.fingers, 2), _row(found.palm, 2)
    ways = f"at the reference the fingers are at {fingers} from the thumb, and the palm looks along {palm}"
    yield from _note(f"Guessed: {ways}. The starts put the middle between thumb and fingers where the Allegro's is.")
    yield "wrist:"
    yield f"  root_euler_deg: {_row(found.euler_deg, DEGREES)}"
    yield "  starts:"
    for place, euler in zip(found.positions, found.angles_deg, strict=True):
        yield f"    - {{position: {_row(place, METRES)}, euler_deg: {_row(euler, DEGREES)}}}"


def _spheres(draft: Draft) -> Iterator[str]:
    least = "the fewest that leave no point of a link's meshes more than 3 mm outside"
    measure = "how far the meshes are outside the spheres, and these outside the link, at most"
    fingers = range(len(draft.body.chains))
    yield "spheres:"
    yield from _note(f"Guessed: {least}. A link's comment says {measure}.", "  ")
    yield "  cover:"
    yield "    spheres:"
    names = list(sphere_names(draft))
    for i in fingers:
        place = f"centre: {_row(_pad_offset(draft, i), METRES)}, radius: {_number(draft.body.pads[i].radius, METRES)}"
        yield f"      {names[i]}: {{link: {_word(draft.body.chains[i].tip)}, {place}}}"
    yield from _covers(draft, names[len(fingers) :])
    yield f"    pads: {{{', '.join(f'{_finger(draft, i)}: {names[i]}' for i in fingers)}}}"
    found = f"{100 * draft.pairs.share:.0f} % of the random postures"
    yield from _note(f"Guessed: they find {found} in which fingers, or one and the palm, overlap by over 3 mm.", "    ")
    yield "    pairs:" if draft.pairs.pairs else "    pairs: []"
    yield from (f"      - [{names[i]}, {names[j]}]" for i, j in draft.pairs.pairs)


def _covers(draft: Draft, names: Iterable[str]) -> Iterator[str]:
    """The spheres of the links beside the pads."""
    rest = iter(names)
    for joint, cover in draft.body.covers.items():
        link = draft.body.skeleton.links(joint)[0]
        many = f"{len(cover.balls)} spheres{' and the pad' if draft.body.is_end(joint) else ''}"
        yield f"      # {link}: {many}, {1e3 * max(cover.outside, 0):.1f} mm outside, {1e3 * cover.excess:.1f} mm bulge"
        for ball in cover.balls:
            place = (
                f"centre: {_row(_in_link(draft, link, ball.centre), METRES)}, radius: {_number(ball.radius, METRES)}"
            )
            yield f"      {next(rest)}: {{link: {_word(link)}, {place}}}"


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


def _note(told: str, indent: str = "") -> list[str]:
    """The lines of a comment."""
    return textwrap.wrap(told, WIDTH, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# ")
