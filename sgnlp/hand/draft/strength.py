"""The efforts of the joints, and the stiffness of springs that they can hold."""

from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.hand.draft.body import Body
from sgnlp.hand.findings import MAX_EFFORT

FORCE = 5.0
"""Assumed force of a stretched finger without a plausible effort [N]: 0.7 N m at an Allegro's 14 cm."""
LEAST, MOST = 2.0, FORCE
"""Bounds of the force that gains follow from [N]: less would hold nothing, and a light object tolerates no more."""
INITIAL, LOWER, UPPER = 16.0, 8.0, 80.0
"""Gains over force [1/m]: 80, 40 and 400 N/m of the paper and of the release, at an Allegro's 5 N."""
DIGITS = 10.0
"""Gains are rounded to multiples of this [N/m]."""


@dataclass(frozen=True, eq=False)
class Strength:
    """Efforts and gains of a hand."""

    effort: Array  # (n,) [N m or N]
    told: BoolArray  # (n,) whether it is from the description
    length: float  # [m] of the stretched fingers at whose ends the efforts are assumed
    force: float  # [N] force of the median finger, stretched to that length
    lower: float  # [N/m]
    upper: float  # [N/m]
    initial: tuple[float, ...]  # (m,) [N/m]


def strength(body: Body, thumb: int, length: float) -> Strength:
    """The description's efforts if they are plausible, else a default; gains in proportion to the force at the tips.

    `length` [m] is that of the hand's median finger. The thumb's spring is as stiff as those of two fingers, since it
    opposes all of them.
    """
    given = np.array(body.skeleton.model.upperEffortLimit)
    told = (given > 0) & (given <= MAX_EFFORT)
    effort = np.where(told, given, FORCE * length)
    model = body.skeleton.model
    own = [[model.idx_qs[joint] for joint in chain.joints] for chain in body.chains]
    force = float(np.median([effort[joints].min() for joints in own]) / length)
    lower, upper, initial = (
        DIGITS * round(k * float(np.clip(force, LEAST, MOST)) / DIGITS) for k in (LOWER, UPPER, INITIAL)
    )
    return Strength(
        effort=effort,
        told=told,
        length=length,
        force=force,
        lower=lower,
        upper=upper,
        initial=tuple(initial * (2 if i == thumb else 1) for i in range(len(body.chains))),
    )
