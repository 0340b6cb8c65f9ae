"""Whether depth images have the poses of other images: one camera's file given twice, or two exchanged."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from sgnlp.base.errors import InputError
from sgnlp.perception import level
from sgnlp.perception.depth_checks import MAX_DISAGREEMENT

Image = Any
"""A `sgnlp.perception.depth.DepthImage`, which imports this module."""
MOVED, MOVED_SHARE = 0.02, 0.2
"""Two images have not one pose if more than this share of their pixels differ by more than this [m]: shots from one
place differ by their noise, 5 mm at 1.5 m, and where something was moved between them."""
RIGHT_TILT_DEG, RIGHT_GAP = level.MAX_TILT_DEG / 2, MAX_DISAGREEMENT / 2
"""Exchanged poses are right if the tables are level and agree twice as well as what is noted."""


def check(images: Sequence[Image], names: Sequence[str]) -> None:
    """Raise `InputError` if two images of different places have one pose, or the poses of two are exchanged."""
    tables = [_table(image) for image in images] if len(images) > 1 else []
    for i, j in combinations(range(len(images)), 2):
        a, b, named = images[i], images[j], f"the images '{names[i]}' and '{names[j]}'"
        share = _moved(a, b)
        if share > MOVED_SHARE:
            raise InputError(
                f"{named} have one pose, but {share:.0%} of their pixels differ by more than {1e3 * MOVED:.0f} mm: "
                "give each the file of its own camera"
            )
        given = _worst([tables[i], tables[j]])
        if given is None or (given[0] <= level.MAX_TILT_DEG and given[1] <= MAX_DISAGREEMENT):
            continue
        other = _worst([_table(replace(a, pose=b.pose)), _table(replace(b, pose=a.pose))])
        if other is not None and other[0] <= RIGHT_TILT_DEG and other[1] <= RIGHT_GAP:
            told = [f"tilted by {tilt:.1f} deg and {1e3 * gap:.0f} mm apart" for tilt, gap in (given, other)]
            raise InputError(
                f"the poses of {named} are swapped: their tables are {told[0]}, exchanged {told[1]}; give the "
                "cameras in the order of the images"
            )


def _moved(a: Image, b: Image) -> float:
    """The share of the pixels of two images of one pose that differ much; 0 of two poses."""
    one, two = (np.asarray(image.depth) * image.unit for image in (a, b))
    if one.shape != two.shape or not np.array_equal(np.asarray(a.pose), np.asarray(b.pose)):
        return 0.0
    both = np.isfinite(one) & np.isfinite(two) & (one > 0) & (two > 0)
    return float((np.abs(one - two)[both] > MOVED).mean()) if both.any() else 0.0


def _table(image: Image) -> tuple[float, float] | None:
    """Tilt [deg] and height [m] of the table that an image shows around its mask, or anywhere without one."""
    world = image.points()
    around = np.isfinite(world[..., 2])
    if image.mask is not None and np.asarray(image.mask).any():
        around &= level.around(np.asarray(image.mask))
    points = world[around]
    found = level.planes(points, np.asarray(image.pose)[:3, 3]) if len(points) >= level.PLANE_PIXELS else []
    return (min(plane.tilt for plane in found), float(np.median(points[:, 2]))) if found else None


def _worst(tables: Sequence[tuple[float, float] | None]) -> tuple[float, float] | None:
    """The largest tilt of two tables, and how far their heights are apart; None if one was not seen."""
    seen = [table for table in tables if table is not None]
    if len(seen) < len(tables):
        return None
    return max(tilt for tilt, _ in seen), abs(seen[0][1] - seen[1][1])
