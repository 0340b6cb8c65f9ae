"""The order of the fingers, from the thumb's neighbour on and the thumb last, and names for unnamed ones."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.draft.body import Body
from sgnlp.hand.draft.reference import Reference
from sgnlp.hand.draft.wrist import bases
from sgnlp.hand.hand_file import MIN_FINGERS

ROWS = {4: ("index", "middle", "ring"), 5: ("index", "middle", "ring", "little")}
"""Names of the fingers besides the thumb, by the number of all fingers."""

FREE, WRIST = 3, 3
"""A tip moved by three joints can reach any point. Half of the wrist's six degrees of freedom may make up for missing
joints. That was chosen with the Schunk SVH on tuning problems: five of its fingers need all six, and hardly ever have a
grasp; three of them need two, and mostly have one."""


def enough(body: Body) -> list[int]:
    """The fingers that can all touch an object at once: the thumb, which is last in the order, and others.

    Σ max(3 - n_i, 0) ≤ 3, with n_i the actuated joints of a finger that move none before it; at least three fingers are
    kept. That with the fewest joints of its own is left out first, and of several the farthest from the thumb's
    neighbour.
    """
    index = body.skeleton.model.idx_qs
    joints = [{index[joint] for joint in chain.joints} for chain in body.chains]
    kept = [*range(len(joints))]
    while len(kept) > MIN_FINGERS and _lack([joints[i] for i in kept]) > WRIST:
        own = {i: len(joints[i].difference(*(joints[j] for j in kept if j != i))) for i in kept[:-1]}
        kept.remove(min(own, key=lambda i: (own[i], -i)))
    return kept


def _lack(fingers: Sequence[set[int]]) -> int:
    """Σ max(3 - n_i, 0) for the actuated joints of each finger, each counted once."""
    lack, used = 0, set[int]()
    for joints in fingers:
        lack += max(FREE - len(joints - used), 0)
        used |= joints
    return lack


def ordered(body: Body, reference: Reference, keep: bool = False) -> tuple[Body, Reference]:
    """Body and reference with the fingers in order (with `keep`, in the given one), and each finger with a name.

    Fingers without a name in their links or joints are named by their place beside the thumb if the hand has four or
    five, else by the links of their tips.
    """
    m = len(body.chains)
    order = list(range(m)) if keep else _order(bases(body, reference.joints), reference.thumb)
    chains = [body.chains[i] for i in order]
    thumb = order.index(reference.thumb)
    names = [chain.name for chain in chains]
    if not any(names) and m in ROWS and not keep:
        names = [*ROWS[m], "thumb"]
    named = tuple(replace(chain, name=name or chain.tip) for chain, name in zip(chains, names, strict=True))
    return replace(body, chains=named, pads=tuple(body.pads[i] for i in order)), replace(reference, thumb=thumb)


def _order(places: Array, thumb: int) -> list[int]:
    """The fingers along the line between the two bases that are farthest apart, the thumb's side first."""
    row = [i for i in range(len(places)) if i != thumb]
    one, other = max(combinations(row, 2), key=lambda pair: float(np.linalg.norm(places[pair[0]] - places[pair[1]])))
    line = places[other] - places[one]
    along = (places - places[one]) @ line
    far = along[thumb] > line @ line / 2
    return [*sorted(row, key=lambda i: -along[i] if far else along[i]), thumb]
