"""Cleaning of a cloud: drops marks for "no return", the table and points below it, outliers and impossible points.

Every step notes what it drops. A cloud of one body on a table loses only a few outliers.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray, IntArray
from sgnlp.base.checked import POSITIVE, Checked, Positive
from sgnlp.base.errors import InputError
from sgnlp.perception.sampling import MAX_POINTS, grid_sample
from sgnlp.perception.shape import FAR
from sgnlp.perception.text_rows import counts

SAME = 1e-6
"""Points that agree to this are copies [m]: no camera measures a point twice to a micrometre."""
REPEATS = 10
"""A point that occurs this often, and this many times more often than the median, is a mark, not a measurement."""
MARK_GAP = 0.1
"""Many points with the coordinate 0, or with one low z, are marks if they are this far from all others [m]. A body's
level top is nearer to the table than this. Other repeated coordinates must be farther than a body is wide."""
MARKS_NAMED = 3
"""Largest number of marks that are named."""
UNITS = {"micrometres": 1e-6, "mm": 0.001, "cm": 0.01, "inches": 0.0254}
USUAL_WIDTH = (0.03, 0.4)
"""Usual widths of graspable objects [m], by which an error message guesses the unit of a cloud."""


@dataclass(frozen=True)
class ObservationSettings(Checked):
    """How a cloud is cleaned and what is refused."""

    section = "cleaning"
    outlier_neighbours: Annotated[int, POSITIVE] = 20
    """Number of neighbours whose mean distance decides whether a point is an outlier; the paper's release takes 20."""
    outlier_deviations: Positive = 2.0
    """Standard deviations above the mean that make an outlier; the release takes 1, which drops 12-42 %."""
    max_invalid_share: Annotated[float, (0.0, 1.0)] = 0.2
    """Largest share of points that may be beyond `max_coordinate`; NaN and infinity, for "no return", may be more."""
    max_coordinate: Positive = 1e7
    """[m] Largest coordinate, the limit of northings in maps; larger ones are a sensor's mark for "no return"."""
    min_points: Annotated[int, (4, math.inf)] = 30
    """Fewest different points, before and after cleaning."""
    min_width: Positive = 0.01
    """[m] Smallest longest side of the cloud's box."""
    max_width: Positive = 0.5
    """[m] Largest longest side of the cloud's box."""
    max_step: Positive = 0.015
    """[m] Largest step of rounded coordinates: beyond a fingertip's radius the shape is lost."""
    min_flatness: Positive = 1e-3
    """Smallest ratio of the second and third singular value to the first; below it the cloud is a line or a plane."""
    max_share_below_table: Annotated[float, (0.0, 1.0)] = 0.2
    """Largest share of points that may lie below the table."""
    table_quantile: Annotated[float, (0.0, 1.0)] = 0.005
    """Quantile of the heights that is taken as the table's height if none is given."""
    max_points: Annotated[int, POSITIVE] = MAX_POINTS
    """Larger clouds are thinned on a grid to at most this many points."""


class Cleaning:
    """The remaining points, their indices in the input, and notes on the dropped ones."""

    def __init__(self, points: Array, settings: ObservationSettings, notes: Sequence[str]) -> None:
        self.points = points  # (n, 3)
        self.index = np.arange(len(points))  # (n,)
        self.settings = settings
        self.notes = list(notes)

    def keep(self, mask: BoolArray, reason: str) -> None:
        """Keep the points of a mask, note how many were dropped and why, refuse too few."""
        if not mask.all():
            self.notes.append(f"Dropped {np.sum(~mask)} of {len(mask)} points that {reason}.")
        self.points, self.index = self.points[mask], self.index[mask]
        if len(self.points) < self.settings.min_points:
            dropped = f" ({' '.join(self.notes)})" if self.notes else ""
            needed = f"at least {self.settings.min_points} are needed"
            raise InputError(f"the cloud has {len(self.points)} points, {needed}{dropped}")

    def measured(self, factor: float, pose: Array | None) -> None:
        """Convert to metres and, by a pose (4, 4), to the world; drop points that are not finite measurements."""
        if counts(self.points[:, 0]):
            raise InputError("the first column counts 0, 1, 2: save x y z alone")
        if factor != 1.0:
            self.notes.append(f"Multiplied all coordinates by {factor:g}.")
        with np.errstate(over="ignore", invalid="ignore"):
            self.points = self.points * factor
        self.keep(np.asarray(np.isfinite(self.points).all(axis=1)), "are NaN or infinite")
        limit = self.settings.max_coordinate
        valid = np.asarray((np.abs(self.points) <= limit).all(axis=1))
        share = 1.0 - valid.mean()
        if share > self.settings.max_invalid_share:
            raise InputError(
                f"{share:.0%} of the points are too far from the origin, beyond {limit:g} m: is another "
                "column, such as the time, or another order of bytes taken for coordinates?"
            )
        self.keep(valid, f"are beyond {limit:g} m")
        self.points = moved(self.points, pose)

    def drop_marks(self, table: float | None) -> None:
        """Drop points that occur many times, and points that share one coordinate far from all others.

        These are zeros and other marks for "no return", whether or not they were moved to the world with the rest.
        """
        if table is not None and not np.isfinite(table):
            raise InputError(f"the table height must be a finite number; found {table}")
        _, first, cell, number = np.unique(
            _cells(self.points), return_index=True, return_inverse=True, return_counts=True
        )
        often = number >= REPEATS * max(1.0, float(np.median(number)))
        for c in np.flatnonzero(often)[:MARKS_NAMED]:
            point = ", ".join(f"{x:.5g}" for x in self.points[first[c]])
            self.notes.append(f"({point}) stands for no return: it comes {number[c]} times.")
        self.keep(~often[cell], "are the same as many others")
        for axis, letter in enumerate("xyz"):
            for side in (1.0, -1.0):
                self._drop_far_value(axis, letter, side, table)

    def _drop_far_value(self, axis: int, letter: str, side: float, table: float | None) -> None:
        """Drop points whose coordinate is exactly the least (side 1) or greatest one, far from all others."""
        value = side * self.points[:, axis]
        least = value.min()
        same = value <= least + SAME
        rest = value[~same]
        on_table = letter == "z" and table is not None and abs(side * least - table) < MARK_GAP
        usual = abs(least) <= SAME or (letter == "z" and side > 0)  # the value is 0, or below everything
        gap = MARK_GAP if usual else self.settings.max_width
        if same.sum() >= REPEATS and rest.size and rest.min() >= least + gap and not on_table:
            self.keep(~same, f"have {letter} = {side * least:.5g} m, a mark for no return")

    def drop_copies(self, raw: Array) -> None:
        """Drop copies of points; refuse too few different ones, and coordinates whose `raw` values are rounded."""
        settings, count = self.settings, len(self.points)
        first = np.unique(_cells(self.points), return_index=True)[1]
        if len(first) < settings.min_points:
            found = f"the cloud has {len(first)} different points of {count}"
            raise InputError(f"{found}, at least {settings.min_points} are needed")
        step = max(step_of_32_bits(raw[self.index], self.points), *coordinate_steps(self.points))
        if step > settings.max_step:
            check_width(self.points, settings)  # whole millimetres are too wide, too
            raise InputError(
                f"its coordinates are rounded to {1e3 * step:.0f} mm: too far from the origin for 32-bit numbers, or "
                "saved with too few digits; subtract an offset before they are saved"
            )
        self.keep(np.isin(np.arange(count), first), "are copies of others")

    def find_table(self, given: float | None) -> float:
        """The height of the table, given or estimated; points below it are dropped."""
        heights = self.points[:, 2]
        span = f"the cloud's heights run from {heights.min():.4f} to {heights.max():.4f} m"
        if given is None:
            table = float(np.quantile(heights, self.settings.table_quantile))
            share = f"{100 * self.settings.table_quantile:g} %"
            self.notes.append(f"Assumed the table at {table:.4f} m, the {share} quantile of the heights.")
        else:
            table = float(given)
            if table < heights.min() - FAR:
                raise InputError(f"the table at {table:.4f} m is more than {FAR:g} m below; is it in metres? {span}")
        above = heights >= table
        share_below = 1.0 - above.mean()
        if share_below > self.settings.max_share_below_table:
            raise InputError(f"the table at {table:.4f} m is above {share_below:.0%} of the cloud; {span}")
        self.keep(above, f"lie below the table at {table:.4f} m")
        return table

    def thin(self) -> None:
        """Keep one point in each grid cell, for clouds above `max_points`."""
        mask = np.zeros(len(self.points), bool)
        mask[grid_sample(self.points, self.settings.max_points)] = True
        self.keep(mask, "share a cell of the thinning grid with another")

    def drop_outliers(self) -> None:
        """Statistical outlier removal: drop points with a mean distance to neighbours above mean + ratio ·
        deviation."""
        neighbours = min(self.settings.outlier_neighbours, len(self.points) - 1)
        distances, _ = cKDTree(self.points).query(self.points, k=neighbours + 1)
        average = np.asarray(distances)[:, 1:].mean(axis=1)  # (n,) [m] without the point itself
        limit = average.mean() + self.settings.outlier_deviations * average.std()
        criterion = f"mean distance to {neighbours} neighbours above {1e3 * limit:.1f} mm"
        self.keep(average <= limit, f"are outliers ({criterion})")


def moved(points: Array, pose: Array | None) -> Array:
    """Points (n, 3) of a frame with a pose (4, 4) in the world; as they are without one."""
    return points if pose is None else points @ pose[:3, :3].T + pose[:3, 3]


def check_width(points: Array, settings: ObservationSettings) -> float:
    """The width of a cloud [m]; raises `InputError` if it is too wide for a hand."""
    width = float(np.ptp(points, axis=0).max())
    if width > settings.max_width:
        units = [f"in {name} (--scale {factor:g})" for name, factor in UNITS.items() if _usual(factor * width)]
        hint = f"is it {' or '.join(units)}, or a whole scene?" if units else "is it a whole scene?"
        hint += " `sgnlp cloud FILE` takes one object out of a scene"
        raise InputError(f"the cloud is {width:.4g} m wide, more than {settings.max_width:g} m; {hint}")
    return width


def check_shape(points: Array, settings: ObservationSettings, table: float | None) -> None:
    """Refuse a cloud without volume, or too wide or small for a hand.

    A flat top is accepted if the `table` was given: its copy on the table closes the body from below.
    """
    width = check_width(points, settings)
    if width < settings.min_width:
        hint = "is its unit the metre? (--scale multiplies all coordinates; 0.001 is for mm)"
        raise InputError(f"the cloud is {width:.4g} m wide, less than {settings.min_width:g} m; {hint}")
    closed = points if table is None else np.concatenate([points, points * [1, 1, 0] + [0, 0, table]])
    spread = np.linalg.svd(closed - closed.mean(axis=0), compute_uv=False)  # (3,) descending
    if spread[2] < settings.min_flatness * spread[0]:
        figure = "line" if spread[1] < settings.min_flatness * spread[0] else "plane"
        top = "; if it is the top of a body, give --table-height" if table is None and figure == "plane" else ""
        raise InputError(f"all points lie on one {figure}; a solid object needs points in three dimensions{top}")


def coordinate_steps(points: Array) -> list[float]:
    """The least difference [m] of two coordinates along each axis; 0 if there are fewer than three values."""
    values = [np.unique(column) for column in points.T]
    return [float(np.diff(value).min()) if len(value) > 2 else 0.0 for value in values]


def step_of_32_bits(raw: Array, points: Array) -> float:
    """The rounding step [m] of the largest coordinate if all raw ones (n, 3) are 32-bit numbers, else 0."""
    single = raw.astype(np.float32)
    if not (single == raw).all():
        return 0.0
    largest = np.abs(single).max()
    scale = float(np.ptp(points, axis=0).max()) / max(float(np.ptp(raw, axis=0).max()), np.finfo(float).tiny)
    return float(np.spacing(largest)) * scale


def _usual(width: float) -> bool:
    return USUAL_WIDTH[0] <= width <= USUAL_WIDTH[1]


def _cells(points: Array) -> IntArray:
    """A hash (n,) of the cube of edge `SAME` that each point is in."""
    cell = np.round((points - np.median(points, axis=0)) / SAME).astype(np.int64)
    with np.errstate(over="ignore"):
        return cell @ np.array([1, 0x9E3779B97F4A7C15 - 2**64, 0x517CC1B727220A95])
