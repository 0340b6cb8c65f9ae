"""The pairs of spheres to check for self-collision: few pairs that detect most postures with overlapping chains."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.hand.draft.body import Body

POSTURES = 1500
"""Random postures, half spread over the limits and half around the reference."""
NEAR = 0.2
"""Spread of those around the reference, in ranges of the joints."""
DEPTH = 0.003
"""Least overlap [m] that counts: as much as spheres may leave uncovered."""
APART = 0.001
"""Least gap of a pair at the reference posture [m]."""
ALWAYS = 0.3
"""Spheres that overlap in a larger share of the postures are neighbours, whose links touch by design."""
MOST, SHARE = 36, 0.97
"""Limits of the choice: number of pairs, or detected share of the postures. Each pair is a row of the program."""


@dataclass(frozen=True)
class Pairs:
    """The pairs, as indices into the spheres of a body, and the share of the colliding postures that they detect."""

    pairs: tuple[tuple[int, int], ...]
    share: float


def pairs(body: Body, reference: Array) -> Pairs:
    """The pairs, the one that detects most first; none overlaps at the reference posture."""
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
    """Columns that detect most of the rows with an overlap, chosen one after the other, and the detected share."""
    left = overlaps[overlaps.any(axis=1)]
    chosen: list[int] = []
    total = len(left)
    while len(left) > (1 - SHARE) * total and len(chosen) < MOST:
        chosen.append(int(left.sum(axis=0).argmax()))
        left = left[~left[:, chosen[-1]]]
    return chosen, 1 - len(left) / max(total, 1)
