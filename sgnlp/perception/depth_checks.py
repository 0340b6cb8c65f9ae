"""Checks of depth images for wrong masks, units, intrinsics and poses.

Each check returns notes with its threshold, or raises `InputError`. `level` checks whether the table is level.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError

NEAR, FAR = 0.2, 1.5
"""[m] Depth cameras measure from 0.2 m, few from nearer; at 1.5 m stereo noise, 0.6 mm at 0.55 m, is 5 mm."""
NEAREST, FARTHEST = 0.07, 5.0
"""[m] The nearest depth of a RealSense D405, made for close range; at 5 m stereo noise is 5 cm, an object's width."""
UNITS = (1.0, 0.001, 0.0001)
"""[m] Units that an error message proposes: metres, millimetres, and those of BOP and of some RealSense cameras."""
NORMALISED = 1.0
"""The largest of numbers that were divided by their largest."""
MAX_STEP, REFUSED_STEP = 0.003, 0.017
"""[m] Largest step without a note, and without refusal. A step s adds a deviation of s / √12: 0.9 mm, that of a camera;
5 mm, the noise that a plan assumes."""
MAX_OFF_MIDDLE = 0.05
"""Largest distance of (cx, cy) from the middle, as a share of width or height; known cameras stay below 0.035."""
MAX_UNEQUAL = 0.03
"""Largest difference of fx and fy, as a share; known cameras stay below 0.01."""
MAX_FIELD_DEG = 150.0
"""Largest field of view [deg]: no rectified image has more, but K in other units than pixels does."""
MAX_MARKED, BORDER_MARKED = 0.5, 0.9
"""Largest share of all pixels, and of the pixels at the image's edges, that an object fills."""
MAX_UNMEASURED = 0.5
"""Largest share of the mask's pixels without depth; in simulated images steep sides lose up to 0.21."""
MAX_ORIGIN = 10.0
"""[m] Largest distance of a camera from the world's origin; a pose in mm is farther."""
MAX_BELOW, MAX_ABOVE = 0.1, 2.0
"""[m] A table deeper below the world's origin, or higher above it, gives a note: the highest benches are 1.2 m high."""
MAX_DISAGREEMENT = 0.02
"""[m] Largest difference between heights of the table; 3 deg of tilt make 10 mm over 0.2 m."""
MAX_GAP = 0.05
"""[m] Largest gap between the boxes of the views' masked points: they overlap if both see the top of the object."""


def intrinsics(K: Array, shape: tuple[int, ...]) -> list[str]:
    """Notes on K (3, 3) for an image (height, width)."""
    f, c, size = K[[0, 1], [0, 1]], K[:2, 2], np.array(shape[::-1])
    field = np.rad2deg(2 * np.arctan(size / (2 * f))).max()
    if field > MAX_FIELD_DEG:
        raise InputError(
            f"the intrinsics give a field of view of {field:.0f} deg, more than {MAX_FIELD_DEG:g}; "
            f"are fx = {f[0]:g} and fy = {f[1]:g} in pixels?"
        )
    notes = []
    off = float(np.abs((c - (size - 1) / 2) / size).max())
    if off > MAX_OFF_MIDDLE:
        notes.append(
            f"cx, cy = {c[0]:g}, {c[1]:g} lie {off:.0%} of the image off the middle of {size[0]} x {size[1]} pixels, "
            f"more than {MAX_OFF_MIDDLE:.0%}: right for a cropped image alone; else K is of another stream or size."
        )
    unequal = float(f.max() / f.min() - 1)
    if unequal > MAX_UNEQUAL:
        notes.append(
            f"fx = {f[0]:g} and fy = {f[1]:g} differ by {unequal:.0%}, more than {MAX_UNEQUAL:.0%}: right for an image "
            "stretched in one direction alone."
        )
    return notes


def twins(views: Sequence[Array], poses: Sequence[Any], names: Sequence[str]) -> list[str]:
    """Notes on images that are the same number by number, seen from two poses; cameras that look at a symmetrical scene
    without noise have such.

    Raises:
        InputError: so are two images of one pose, or two clouds, whose poses are None.
    """
    notes = []
    for (a, one, name), (b, two, other) in combinations(zip(views, poses, names, strict=True), 2):
        if np.array_equal(a, b, equal_nan=True) and np.isfinite(a).any():
            same = f"two views, '{name}' and '{other}', are the same, number by number"
            if one is None or np.array_equal(one, two):
                raise InputError(f"{same}; give each once")
            notes.append(
                f"{same[0].upper()}{same[1:]}. If the scene is not the same from both sides, one was given twice."
            )
    return notes


def mask(marked: BoolArray, measured: BoolArray) -> list[str]:
    """Notes on a mask (height, width) that marks most of the image, or many pixels without depth."""
    notes = []
    border = np.concatenate([marked[0], marked[-1], marked[:, 0], marked[:, -1]]).mean()
    share = marked.mean()
    if share > MAX_MARKED:
        if (measured & ~marked).any() and border > BORDER_MARKED:
            raise InputError(
                f"the mask marks {share:.0%} of the pixels and {border:.0%} of the image's edges: "
                "it is inverted; mark the object (--label 0 takes what is black)"
            )
        notes.append(
            f"The mask marks {share:.0%} of the pixels, more than {MAX_MARKED:.0%}: right for an image "
            "cropped to the object alone; else it is inverted, or marks the table too."
        )
    lost = 1 - (marked & measured).sum() / marked.sum()
    if lost > MAX_UNMEASURED:
        notes.append(f"{lost:.0%} of the {marked.sum()} marked pixels have no depth, more than {MAX_UNMEASURED:.0%}.")
    return notes


def depths(values: Array, unit: float, what: str = "object") -> list[str]:
    """Notes on the measured depths (n,) of an object or a scene: their distance, and their steps."""
    middle = float(np.median(values)) * unit
    if not NEAREST <= middle <= FARTHEST:
        better = [u for u in UNITS if NEAR <= middle / unit * u <= FAR]
        hint = f"; --unit {better[0]:g} would make it {middle / unit * better[0]:.2g} m" if better else ""
        raise InputError(
            f"in units of {unit:g} m the {what} is {middle:.3g} m from the camera, not {NEAREST:g} to {FARTHEST:g} m; "
            f"see --unit (in Python: unit){hint}"
        )
    notes = []
    if not NEAR <= middle <= FAR:
        notes.append(
            f"In units of {unit:g} m the {what} is {middle:.3g} m from the camera, "
            f"not {NEAR:g} to {FAR:g} m: see --unit."
        )
    levels = np.unique(values) * unit
    step = float(np.diff(levels).min()) if len(levels) > 1 else 0.0
    if step > REFUSED_STEP:
        raise InputError(f"the depths come in steps of {1e3 * step:.3g} mm, more than {1e3 * REFUSED_STEP:g} mm")
    if step > MAX_STEP:
        notes.append(
            f"The depths come in steps of {1e3 * step:.3g} mm, more than {1e3 * MAX_STEP:g} mm: surfaces become "
            "stairs. Take images of 16 bits or of floats."
        )
    return notes


def scale(depth: Array) -> list[str]:
    """A note on depths (height, width) that were normalised. Raises `InputError` if all of them are negative."""
    values = depth[np.isfinite(depth) & (depth != 0)]
    if len(values) and values.max() < 0:
        raise InputError("all depths are negative, as OpenGL's z is: give their absolute values")
    if not len(values) or values.max() != NORMALISED or (values == np.round(values)).all():
        return []
    return [
        f"The largest depth is exactly {NORMALISED:g}: right for depths that were cut off there; if they were "
        f"normalised to 0 .. {NORMALISED:g}, give them as they were."
    ]


def places(cameras: Array, clouds: Sequence[Array], tables: Sequence[float | None], table: float | None) -> list[str]:
    """Notes on camera positions (V, 3), the masked points (n, 3) of each, each one's table height, and the common
    one."""
    notes = []
    origin = float(np.linalg.norm(cameras, axis=1).max())
    if origin > MAX_ORIGIN:
        notes.append(
            f"A camera is {origin:.0f} m from the origin of the world, more than {MAX_ORIGIN:g} m: is its pose in "
            "millimetres? It must be in metres."
        )
    measured = [height for height in tables if height is not None]
    if table is not None and cameras[:, 2].min() <= table:
        raise InputError(
            f"the table at {table:.4f} m is above the camera at {cameras[:, 2].min():.4f} m; "
            "look at the pose (camera to world; x right, y down, z ahead) and at --table-height"
        )
    if max(float(c[:, 2].min()) - z for c, z in zip(clouds, cameras[:, 2], strict=True)) > 0:
        notes.append("The object is above the camera: look at the pose (camera to world; x right, y down, z ahead).")
    if measured and min(measured) < -MAX_BELOW:
        notes.append(
            f"The table was measured at {min(measured):.3f} m, more than {MAX_BELOW:g} m below the world's origin: "
            "if the origin is not above the table, look at --unit and at the pose."
        )
    if measured and max(measured) > MAX_ABOVE:
        notes.append(
            f"The table was measured at {max(measured):.1f} m, more than {MAX_ABOVE:g} m above the world's origin: "
            "if the origin is not so far below, look at the pose, which must be in metres."
        )
    if table is not None and measured and max(abs(height - table) for height in measured) > MAX_DISAGREEMENT:
        heights = ", ".join(f"{height:.3f}" for height in measured)
        notes.append(
            f"The table is taken to be at {table:.3f} m, but was measured at {heights} m by the cameras, more than "
            f"{MAX_DISAGREEMENT:g} m off: look at --unit, the poses and --table-height."
        )
    gap = max((_gap(a, b) for a in clouds for b in clouds), default=0.0)
    if gap > MAX_GAP:
        notes.append(
            f"Two views see the object {gap:.3f} m apart, more than {MAX_GAP:g} m: look at their poses, K, "
            "--unit and whether their masks mark one object."
        )
    return notes


def _gap(a: Array, b: Array) -> float:
    """Largest gap [m] along an axis between the boxes of two clouds; negative where they overlap."""
    return float(np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)).max())
