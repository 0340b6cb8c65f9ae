"""A hand's file from its description: the guesses combined."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from sgnlp.base.errors import InputError
from sgnlp.hand.description import Changes, description
from sgnlp.hand.description.bones import bones
from sgnlp.hand.description.endless import endless
from sgnlp.hand.description.mjcf_file import assumed_radians
from sgnlp.hand.description.xml_file import read_xml
from sgnlp.hand.draft import body, chains, order, pairs, palm, reference, strength, wrist
from sgnlp.hand.draft.covers import Cover
from sgnlp.hand.draft.skeleton import Skeleton
from sgnlp.hand.model import joint_model

TURN, SLIDE = (-1.5708, 1.5708), (-0.02, 0.02)
"""Limits of a joint without them in the description: a quarter turn either way [rad], 2 cm [m]."""


@dataclass(frozen=True, eq=False)
class Draft:
    """The content of a hand's file, and how well each guess fits."""

    file: Path
    """The description that it was drafted from."""
    changes: Changes
    body: body.Body
    reference: reference.Reference
    wrist: wrist.Wrist
    strength: strength.Strength
    pairs: pairs.Pairs
    ordered: bool
    """Whether the fingers and their order were guessed, not given."""
    left: tuple[str, ...]
    """Fingers that are left out because they have too few joints to touch an object together with the others."""
    searched: bool
    """Whether the palm was guessed."""
    radians: bool
    """Whether the angles of an MJCF were taken as radians, although it does not say so."""

    @property
    def name(self) -> str:
        """The hand's name in the description, or the name of the file."""
        return str(self.body.skeleton.model.name) or self.file.stem


def draft(
    file: Path,
    root: str | None = None,
    tips: Sequence[str] = (),
    mirror: bool = False,
    couple: Sequence[tuple[str, str, float]] = (),
) -> Draft:
    """A draft of the hand below the link `root`, or below the only one that can be a palm, with fingers to `tips`.

    Each entry of `couple` is a joint, the one that it follows, and the factor.

    Raises:
        InputError: the file is no description, or several links or none can be a palm, or there are too few fingers.
    """
    palm_link = root or palm.palm(_bones(file))
    changes = _changes(file, palm_link, mirror, couple)
    skeleton = _skeleton(file, palm_link, changes)
    known: dict[bytes, Cover] = {}
    fitted = body.body(skeleton, chains.chains(skeleton, tips), known)
    length = reference.finger_length(fitted)  # the motors are the same whatever fingers are left out
    fitted, relaxed = order.ordered(fitted, reference.reference(fitted), keep=bool(tips))
    kept, left = order.enough(fitted), tuple[str, ...]()
    if not tips and len(kept) < len(fitted.chains):
        left = tuple(str(chain.name) for i, chain in enumerate(fitted.chains) if i not in kept)
        fitted = body.body(skeleton, [fitted.chains[i] for i in kept], known)
        fitted, relaxed = order.ordered(fitted, reference.reference(fitted), keep=True)
    return Draft(
        file=file,
        changes=changes,
        body=fitted,
        reference=relaxed,
        wrist=wrist.wrist(fitted, relaxed),
        strength=strength.strength(fitted, relaxed.thumb, length),
        pairs=pairs.pairs(fitted, relaxed.joints),
        ordered=not tips,
        left=left,
        searched=root is None,
        radians=read_xml(file).tag == "mujoco" and assumed_radians(file),
    )


def _bones(file: Path) -> Skeleton:
    """The links and joints of the whole file, of which only the tree matters."""
    text = bones(file)
    return Skeleton(file, text, joint_model(text))


def _changes(file: Path, root: str, mirror: bool, couple: Sequence[tuple[str, str, float]]) -> Changes:
    """The mirror image and couplings, if asked for, and limits for joints without them."""
    limits = {name: TURN if turns else SLIDE for name, turns in endless(file, root).items()}
    couplings = {joint: (followed, factor, 0.0) for joint, followed, factor in couple}
    if len(couplings) < len(couple):
        raise InputError("--couple names a joint twice as the one that follows; it can follow only one")
    for joint, (_, factor, _) in couplings.items():
        if not isfinite(factor):
            raise InputError(f"--couple needs a finite factor for '{joint}', not {factor}")
    return Changes(limits=limits, couplings=couplings, mirror=mirror)


def _skeleton(file: Path, root: str, changes: Changes) -> Skeleton:
    text = description(file, root, changes)
    return Skeleton(file, text, joint_model(text))
