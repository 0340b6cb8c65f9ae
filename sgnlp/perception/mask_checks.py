"""Checks of masks against what was measured: marked pixels of the table, unmarked ones of the object, swapped masks.

The outline of an object on a table is known from the depths alone: everything beside it lies at the table's height. A
mask that is too large, shifted, or of another image marks such pixels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError
from sgnlp.perception.depth_checks import MAX_DISAGREEMENT
from sgnlp.perception.table_beside import heights_around

FLAT, SPREAD = (0.003, 0.010), 3.0
"""[m] Pixels this near to the table's height lie on it: so many deviations of the table around, within these bounds."""
DEVIATION = 1.4826
"""Standard deviation of normal errors by their median absolute one."""
SPECK = 10
"""[px] Fewest pixels that are higher together: fewer are the table's noise, unless they are twice as high."""
BESIDE = 0.005
"""[m] Pixels of the table are this far beside all that is higher: nearer ones may be the foot of a side."""
MAX_TABLE = 0.002
"""Share of the marked pixels on the table above which they are dropped with a note. Of 218 rendered images with noise
right masks have up to 0.0004, those grown by 2 px more than 0.017, and 19 of 20 shifted by 3 px more than 0.002."""
MAX_BELOW = 0.02
"""Largest share of the marked pixels below the table: with more, what surrounds the object is no table under it."""
LEAST_HIGH = 0.05
"""Smallest share of the marked pixels that is higher than the table."""
CLOSED = 2
"""[px] Gaps of a higher region, pixels without depth, are closed by this. What it encloses is a thin floor: a pan's."""
STEP = 0.015
"""[m] Neighbouring pixels whose depths differ by more belong to two surfaces."""
MAX_LEFT_OUT = 0.3
"""Largest share of a body that its mask leaves out: right masks shrunk by 4 px leave out up to 0.26 of small ones."""
TOUCHED = 0.1
"""A body is marked if it holds this share of the pixels of the body with most marked ones."""
SWAPPED, RIGHT = 0.1, 0.75
"""Masks are swapped if as given one has more than the first share on the table, and exchanged both have more than the
second above it."""


def above_table(world: Array, marked: BoolArray, given: float | None) -> tuple[Array, float] | None:
    """Heights (height, width) [m] above the table around the marked pixels, and how far from 0 it still lies [m].

    What surrounds them is no table if it is far from the height `given` [m]: the floor around a stand. None if the
    table was not measured, or if marked pixels lie below it.
    """
    measured = np.isfinite(world[..., 2])
    around = heights_around(world[marked & measured], world[measured & ~marked]) if (marked & measured).any() else None
    if around is None:
        return None
    measured_at = float(np.median(around))
    flat = float(np.clip(SPREAD * DEVIATION * np.median(np.abs(around - measured_at)), *FLAT))
    table = measured_at if given is None or abs(measured_at - given) <= MAX_DISAGREEMENT else given
    height = world[..., 2] - table
    return None if (height[marked & measured] < -flat).mean() > MAX_BELOW else (height, flat)


@dataclass(frozen=True, eq=False)
class Mask:
    """What a mask marks."""

    kept: BoolArray  # (height, width) its pixels without those of the table
    table: float = 0.0  # the share of them that lies on the table
    notes: tuple[str, ...] = ()


def examined(world: Array, depth: Array, marked: BoolArray, given: float | None) -> Mask:
    """The marked pixels without those of the table, by the points (height, width, 3) and depths (height, width) [m].

    If nearly all of them lie on the table, all are kept. The table's height [m] may be `given`.
    """
    found = above_table(world, marked, given)
    if found is None:
        return Mask(marked)
    height, flat = found
    table, higher = _on_table(world, marked, height, flat)
    left = _left_out(depth, marked, height, flat)
    count, whole = int(table.sum()), int(marked.sum())
    share = count / whole
    if higher.sum() < LEAST_HIGH * whole:
        note = (
            f"{share:.0%} of the marked pixels lie at the table's height: the mask marks the table, or something too "
            "thin to tell from it."
        )
        return Mask(marked, share, (note, *left))
    if share <= MAX_TABLE:
        return Mask(marked, share, left)
    note = (
        f"Dropped {count} of {whole} marked pixels, {share:.1%}, that lie on the table, more than "
        f"{1e3 * BESIDE:.0f} mm beside the object: the mask is too large, shifted, or of another image."
    )
    return Mask(marked & ~table, share, (note, *left))


def _on_table(world: Array, marked: BoolArray, height: Array, flat: float) -> tuple[BoolArray, BoolArray]:
    """Marked pixels (height, width) of the table, and those that are higher.

    Pixels of the table lie at its height, `BESIDE` all that is higher, and are not enclosed by it.
    """
    higher = marked & (height > flat)
    part, _ = ndimage.label(higher, np.ones((3, 3)))
    higher &= (height > 2 * flat) | (np.bincount(part.ravel())[part] >= SPECK)
    low = marked & np.isfinite(height) & ~higher
    if higher.sum() < LEAST_HIGH * marked.sum():
        return low, higher
    (box,) = ndimage.find_objects(marked.astype(np.int8))
    enclosed = higher.copy()
    enclosed[box] |= ndimage.binary_fill_holes(ndimage.binary_closing(higher[box], iterations=CLOSED))
    beside, table = low & ~enclosed, np.zeros_like(marked)
    table[beside] = np.asarray(cKDTree(world[higher][:, :2]).query(world[beside][:, :2])[0]) > BESIDE
    return table, higher


def _left_out(depth: Array, marked: BoolArray, height: Array, flat: float) -> tuple[str, ...]:
    """A note if bodies go on beyond their marked pixels without a step of the depths (height, width) [m]."""
    measured = np.isfinite(height)
    farthest = ndimage.maximum_filter(np.where(measured, depth, -np.inf), 3)
    nearest = ndimage.minimum_filter(np.where(measured, depth, np.inf), 3)
    with np.errstate(invalid="ignore"):  # without a measured pixel around
        smooth = measured & (height > 2 * flat) & (farthest - nearest < STEP)
    body, count = ndimage.label(smooth)
    own, whole = (np.bincount(b.ravel(), minlength=count + 1)[1:] for b in (body[marked], body))
    chosen = own > TOUCHED * own.max(initial=0)
    share = 1 - own[chosen].sum() / max(whole[chosen].sum(), 1) if chosen.any() else 0.0
    if share <= MAX_LEFT_OUT:
        return ()
    return (
        f"The mask leaves out {share:.0%} of what joins its pixels without a step, more than {MAX_LEFT_OUT:.0%}: it "
        "marks a part of the object or is shifted, or the object touches another.",
    )


def swapped(
    worlds: Sequence[Array],
    masks: Sequence[BoolArray],
    shares: Sequence[float],
    names: Sequence[str],
    given: float | None,
) -> None:
    """Raise `InputError` if the masks of two images mark much of the table, by their shares, and exchanged do not."""
    for i, j in combinations(range(len(worlds)), 2):
        if max(shares[i], shares[j]) > SWAPPED and masks[i].shape == masks[j].shape:
            higher = [_higher(worlds[a], masks[a], masks[b], given) for a, b in ((i, j), (j, i))]
            if min(higher) > RIGHT:
                raise InputError(
                    f"the masks of the images '{names[i]}' and '{names[j]}' are swapped: {shares[i]:.0%} and "
                    f"{shares[j]:.0%} of their pixels lie on the table, exchanged {higher[0]:.0%} and {higher[1]:.0%} "
                    "lie above it"
                )


def _higher(world: Array, mask: BoolArray, other: BoolArray, given: float | None) -> float:
    """The share of another mask's measured pixels that is higher than the table around this mask; 0 without either."""
    found, there = above_table(world, mask, given), other & np.isfinite(world[..., 2])
    return 0.0 if found is None or not there.any() else float((found[0][there] > found[1]).mean())
