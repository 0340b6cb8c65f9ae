"""Whether cameras and obstacles can be where a file has them: in the unit and the frame of the points."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.perception import depth_checks
from sgnlp.perception.depth_checks import FARTHEST, NEAR, NEAREST
from sgnlp.perception.shape import FAR

LOWEST = 0.01
"""[m] Least height of a camera above the table: half of the smallest edge of common housings, 20 mm of a RealSense
D415."""

SAME, MOST_SAME = 0.002, 0.5
"""A point is there twice if another one is this near [m]: the noise of a second shot, or the step of rounded numbers.
Obstacles that have more than this share of the object's points, or of their own points on the object, are the scene
from which the object was not cut out; `sgnlp cloud` leaves 6 mm between bodies."""
FRAME = "must be in the unit and frame of the points"


def check_cameras(positions: Array | None, points: Array, table: float, told: Sequence[str] = ()) -> list[str]:
    """Notes on cameras (V, 3) that are unusually near to the cloud (n, 3) or far from it, all in metres.

    The distance is noted once: not if the notes that were `told` have it from a depth image.

    Raises `InputError` for cameras below the table or on it, in the cloud, or farther than depth cameras measure.
    """
    if positions is None:
        return []
    lowest = float(positions[:, 2].min())
    if lowest < table:
        raise InputError(
            f"a camera at z = {lowest:.3f} m is below the table at {table:.3f} m: are the coordinates a camera's own "
            "(--pose), or is another axis up (--up)?"
        )
    away = np.asarray(cKDTree(points).query(positions)[0])
    if away.min() < NEAREST:
        raise InputError(
            f"a camera is {1e3 * away.min():.0f} mm from the cloud, nearer than {1e3 * NEAREST:.0f} mm: "
            f"'camera_positions' {FRAME}; leave them out if they are not known"
        )
    if lowest < table + LOWEST:
        raise InputError(
            f"a camera is {1e3 * (lowest - table):.1f} mm above the table, less than the {1e3 * LOWEST:.0f} mm of "
            f"its housing: 'camera_positions' {FRAME}; leave them out if they are not known"
        )
    if away.max() > FARTHEST:
        raise InputError(
            f"a camera is {away.max():.1f} m from the cloud, more than the {FARTHEST:g} m that depth cameras measure: "
            f"'camera_positions' {FRAME}; leave them out if they are not known"
        )
    odd = away[(away < NEAR) | (away > depth_checks.FAR)]
    return [_distance(odd[0])] if len(odd) and not any("from the camera" in note for note in told) else []


def _distance(away: float) -> str:
    """A note on a camera at this distance [m] from the cloud."""
    return (
        f"A camera is {away:.2g} m from the cloud, not {NEAR:g} to {depth_checks.FAR:g} m as usual: look at the unit "
        "of the points and of 'camera_positions'."
    )


def check_obstacles(obstacles: Array | None, points: Array) -> None:
    """Raise `InputError` if points of obstacles (M, 3) are far from the object's (n, 3), or are the object's own."""
    if obstacles is None or not len(obstacles):
        return
    away = np.asarray(cKDTree(obstacles).query(points)[0])
    if away.min() > FAR:
        raise InputError(f"'obstacle_points' are {away.min():.0f} m from the object, more than {FAR:g} m; they {FRAME}")
    own = float((np.asarray(cKDTree(points).query(obstacles)[0]) < SAME).mean())
    for share, whose in (((away < SAME).mean(), "of the object's own points"), (own, "of their points on the object")):
        if share > MOST_SAME:
            raise InputError(f"'obstacle_points' have {share:.0%} {whose}; leave those out")
