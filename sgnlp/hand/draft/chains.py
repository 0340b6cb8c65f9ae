"""The fingers: the chains of moving joints below the palm, their tips and their names."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sgnlp.base.errors import InputError
from sgnlp.hand.draft.skeleton import Skeleton
from sgnlp.hand.hand_file import MIN_FINGERS
from sgnlp.hand.model import link

CODES = {"ff": "index", "if": "index", "mf": "middle", "rf": "ring", "lf": "little", "th": "thumb"}
"""Short forms of the words: Shadow's FFJ1 is a joint of the first finger, LEAP's if_ds a link of the index."""
CODE = re.compile(r"(?<![a-z])(ff|if|mf|rf|lf|th)(?=j\d|tip|distal|middle|proximal|knuckle|base|[^a-z]|$)")
WORDS = {
    "thumb": "thumb",
    "index": "index",
    "forefinger": "index",
    "ring": "ring",
    "little": "little",
    "pinky": "little",
    "middle": "middle",
}
"""The middle finger last, since its word also names a phalanx of each finger."""


LONGEST = 0.4
"""Length of a finger from its first joint to its last [m] that is not believed: an arm has twice as much, and large
fingers, as the TriFinger's, have less."""


@dataclass(frozen=True)
class Chain:
    """A finger: its tip's link, and the joints of the model that move it but not the whole hand, root first."""

    name: str | None
    """Name from a word in the names of its links and joints; None if there is none."""
    tip: str
    joints: tuple[int, ...]

    @property
    def end(self) -> int:
        """The joint that carries the tip."""
        return self.joints[-1]


def chains(skeleton: Skeleton, tips: Sequence[str] = ()) -> list[Chain]:
    """A chain for each end of the tree, or for the links `tips`, in their order.

    Raises:
        InputError: they are fewer than three, a tip is no link, or two tips move as one.
    """
    links = list(tips) or [_tip(skeleton, end) for end in skeleton.ends]
    model = skeleton.model
    ends = [model.frames[link(tip, model, "--tips")].parentJoint for tip in links]
    if len(set(ends)) < max(MIN_FINGERS, len(ends)) or 0 in ends:
        told = ", ".join(f"'{tip}'" for tip in links) or "none"
        raise InputError(
            f"{MIN_FINGERS} tips or more are needed, each behind a moving joint of its own; found {told}; see --tips"
        )
    lines = [skeleton.line(end) for end in ends]
    shared = set(lines[0]).intersection(*lines[1:])
    own = [tuple(joint for joint in line if joint not in shared) for line in lines]
    _check_length(skeleton, own)
    names = [_word(skeleton, tip, line) for tip, line in zip(links, own, strict=True)]
    twice = {name for name, count in Counter(names).items() if count > 1}
    return [
        Chain(None if name in twice else name, tip, line) for name, tip, line in zip(names, links, own, strict=True)
    ]


def _check_length(skeleton: Skeleton, lines: Sequence[Sequence[int]]) -> None:
    """Refuse the arms and legs of a robot whose hands have fewer than three fingers."""
    bones = [[np.linalg.norm(skeleton.model.jointPlacements[j].translation) for j in line[1:]] for line in lines]
    length = float(np.median([sum(one) for one in bones]))
    if length > LONGEST:
        raise InputError(
            f"the chains of joints below '{skeleton.root}' are {length:.2f} m long: these are no fingers but arms or "
            f"legs; choose the palm of a hand with {MIN_FINGERS} fingers or more by --palm"
        )


def _tip(skeleton: Skeleton, end: int) -> str:
    """The link behind the last joint that is named a tip, else the one farthest from the joint."""
    model = skeleton.model

    def rank(name: str) -> tuple[bool, float]:
        place = model.frames[model.getFrameId(name, pin.FrameType.BODY)].placement.translation
        return "tip" in name.lower(), float(np.linalg.norm(place))

    return max(skeleton.links(end), key=rank)


def _word(skeleton: Skeleton, tip: str, line: Sequence[int]) -> str | None:
    """The finger in the names of a tip and of the joints before it, the last first."""
    names = [tip]
    for joint in reversed(line):
        names += [skeleton.model.names[joint], *skeleton.links(joint)]
    found = (_finger(name.lower()) for name in names)
    return next((finger for finger in found if finger), None)


def _finger(name: str) -> str | None:
    if code := CODE.search(name):
        return CODES[code.group(1)]
    return next((finger for word, finger in WORDS.items() if word in name), None)
