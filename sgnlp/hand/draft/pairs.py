"""The pairs of spheres to check for self-collision: few that find most of the postures in which chains overlap."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.hand.draft.body import Body

POSTURES = 1500
"""Random postures, half spread over the limits and half around the reference."""
NEAR = 0.2
"""How far those around the reference are, in ranges of the joints."""
DEPTH = 0.003
"""Overlap [m] that counts: as much as spheres may leave bare."""
APART = 0.001
"""Least gap of a pair at the reference posture [m]."""
ALWAYS = 0.3
"""Spheres that overlap in a larger share of the postures are neighbours, whose links are made to meet."""
MOST, SHARE = 36, 0.97
"""Where the choice ends: so many pairs, or such a share of the postures found. Each pair is a row of the program."""


@dataclass(frozen=True)
class Pairs:
    """The pairs, as indices into the spheres of a body, and the share of the colliding postures that they find."""

    pairs: tuple[tuple[int, int], ...]
    share: float


def pairs(body: Body, reference: Array) -> Pairs:
    """The pairs, the one that finds most first; none overlaps at the reference posture."""
    first, second = _across_chains(body)
    limits = body.radii[first] + body.radii[second]
    overlaps = np.array([_gap(body, first, second, q) for q in _postures(body, reference)]) < limits - DEPTH
    clear = (_gap(body, first, second, reference) > limits + APART) & (overlaps.mean(axis=0) < ALWAYS)
    overlaps, first, second = overlaps[:, clear], first[clear], second[clear]
    chosen, found = _greedy(overlaps)
    order = [(int(first[i]), int(second[i])) for i in chosen]
    return Pairs(tuple(order), found)


def _across_chains(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of spheres of two chains, or of a chain's outer links and the palm."""
    first, second = np.triu_indices(len(body.radii), 1)
    apart = body.owners[first] != body.owners[second]
    return first[apart], second[apart]


def _gap(body: Body, first: np.ndarray, second: np.ndarray, joints: Array) -> Array:
    """The distances (P,) [m] between the centres."""
    centres = body.centres(joints)
    return np.asarray(cdist(centres, centres)[first, second])


def _postures(body: Body, reference: Array) -> Array:
    """Random joints within the limits (POSTURES, n), always the same."""
    model, rng = body.skeleton.model, np.random.default_rng(0)
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    wide = rng.uniform(low, high, (POSTURES // 2, model.nq))
    near = reference + NEAR * (high - low) * rng.uniform(-1, 1, wide.shape)
    return np.vstack([wide, np.clip(near, low, high)])


def _greedy(overlaps: BoolArray) -> tuple[list[int], float]:
    """Columns that find most of the rows with an overlap, one after the other, and the share that they find."""
    left = overlaps[overlaps.any(axis=1)]
    chosen: list[int] = []
    total = len(left)
    while len(left) > (1 - SHARE) * total and len(chosen) < MOST:
        chosen.append(int(left.sum(axis=0).argmax()))
        left = left[~left[:, chosen[-1]]]
    return chosen, 1 - len(left) / max(total, 1)
