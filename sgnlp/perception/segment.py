"""From camera data of a whole scene to the table and the clusters of points on it.

1. Drop invalid points: NaN, zeros, flying pixels (`scene_views`).
2. Find the table, the plane that most things stand on (`table_plane`), and make it level if no pose is given
   (`world_frame`).
3. Split the points above the table into clusters (`clusters`), and mark those that are no object (`faults`).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray, IntArray, floats
from sgnlp.base.checked import typed
from sgnlp.base.errors import InputError
from sgnlp.perception import depth_checks, pose_checks
from sgnlp.perception.clouds import checked_pose
from sgnlp.perception.clusters import clustered
from sgnlp.perception.faults import fault
from sgnlp.perception.scene import NO_CLUSTER, Cluster, Scene
from sgnlp.perception.scene_planes import ScenePlane
from sgnlp.perception.scene_views import as_views, cleaned, points_of
from sgnlp.perception.world_frame import Placed, placed

FOOT_SHARE, FOOT, FOOT_REACH = 0.6, 0.003, 0.004
"""Lower points belong to the foot of a cluster if they are above the table by this share of the usual height and by
this [m], and within this distance of the cluster [m]."""
MIN_SCENE = 100
"""Fewest points of a scene."""
WALL_MARGIN = 0.03
"""[m] A wall continues this far beyond its outline, because its points near the table are assigned to the table."""
HIGHEST, BESIDE = 1.0, 0.1
"""[m] Points higher above the table, or farther beside its outline, are left out."""
MIN_POINTS, MIN_SIZE, MIN_HEIGHT, HIGH = 30, 0.01, 0.01, 0.9
"""A cluster is dropped if it has fewer points, or a smaller longest side [m], as an observation would be refused; or if
this quantile of its heights is lower than this [m]: bulges of a table are lower, and pads are larger."""
NOISE, ELSEWHERE = -1, -2
"""Numbers of points in no cluster: the first for the table or a few points above it, the second for walls and all that
is not over the table."""


@typed
def segment(
    views: Any,
    *,
    pose: ArrayLike | None = None,
    table_height: float | None = None,
    camera_positions: ArrayLike | None = None,
    notes: Sequence[str] = (),
) -> Scene:
    """The table of a scene and the clusters of points on it.

    `views` is a `DepthImage` without a mask, a cloud (N, 3) or (H, W, 3) in metres, NaN where nothing was measured, or
    a list of several of one kind in one world frame. `pose` (4, 4) is the pose of their frame in the world, whose z is
    up. Without a pose, a depth image or a cloud in a camera's frame is turned so that the table is level, with the
    origin on the table below the camera and x ahead of it. A cloud with a level table counts as being in the world
    already. `table_height` [m] is in the world frame; it is measured if it is not given. `camera_positions` (V, 3) [m]
    are the cameras of the clouds, in the clouds' frame.

    Raises:
        InputError: no table is found, it is not level in the given world, nothing stands on it, or depths or widths
            are in another unit.
    """
    positions = None if camera_positions is None else floats(camera_positions, "camera_positions", (None, 3))
    given, clean, said = as_views(views, positions), [], list(notes)
    raw = [view.points if view.image is None else np.asarray(view.image.depth) for view in given]
    said += depth_checks.twins(raw, [view.image and view.image.pose for view in given], [view.name for view in given])
    shots = [view for view in given if view.image is not None and view.image.pose is not None]
    pose_checks.check([view.image for view in shots if view.image is not None], [view.name for view in shots])
    for view in given:
        alone = f"{view.name}: " if len(given) > 1 else ""
        said += view.image.notes if view.image else ()
        try:
            kept, dropped = cleaned(view)
            if not kept.measured.any():
                raise InputError("nothing was measured")
        except InputError as error:
            raise InputError(f"{alone}{error}") from error
        said += [alone + note for note in dropped]
        clean.append(kept)
    count = len(points_of(clean))
    if count < MIN_SCENE:
        raise InputError(f"{count} points were measured, at least {MIN_SCENE} are needed")
    found = placed(clean, None if pose is None else checked_pose(pose), table_height)
    scene = _parted(found, [*said, *found.notes])
    if not scene.clusters:
        raise InputError(f"nothing stands on the table that was found, a plane of {scene.table.count} points")
    return scene


def _parted(found: Placed, notes: list[str]) -> Scene:
    """The clusters on the table of views in the world."""
    views, table = found.views, found.table
    points = points_of(views)
    view = np.repeat(np.arange(len(views)), [int(one.measured.sum()) for one in views])
    height = table.heights(points)
    low = table.lowest(points, height)
    numbers = _numbers(points, height, low, found)
    there, counts = np.unique(numbers[numbers >= 0], return_counts=True)
    large = np.array([_body(points[numbers == n], height[numbers == n]) for n in there], bool)
    if not large.all():
        less = f"fewer than {MIN_POINTS} points, {1e3 * MIN_SIZE:g} mm or {1e3 * MIN_HEIGHT:g} mm of height"
        notes.append(f"Dropped {np.sum(~large)} clusters of {less}, {counts[~large].sum()} points in all.")
    numbers[np.isin(numbers, there[~large])] = NOISE
    masks = [_maps(numbers == n, found) for n in there[large]]
    on_table = points[np.abs(height) <= low]
    faults = [
        fault(points[numbers == n], mask, views, table, on_table) for n, mask in zip(there[large], masks, strict=True)
    ]
    order = sorted(range(len(masks)), key=lambda i: (bool(faults[i]), -int(counts[large][i])))
    labels = tuple(np.full(one.measured.shape, NO_CLUSTER) for one in views)
    clusters = []
    for number, i in enumerate(order, 1):
        mine = numbers == there[large][i]
        for one, mask in zip(labels, masks[i], strict=True):
            one[mask] = number
        distance = _distance(points[mine], found)
        clusters.append(Cluster(number, points[mine], view[mine], distance, faults[i]))
    return Scene(
        views=tuple(views),
        labels=labels,
        above=_maps(numbers != NOISE, found),
        table=table,
        transform=found.transform,
        clusters=tuple(clusters),
        notes=tuple(notes),
    )


def _body(points: Array, height: Array) -> bool:
    """Whether a cluster of points (n, 3) of a `height` (n,) over the table is large enough."""
    high = float(np.quantile(height, HIGH)) >= MIN_HEIGHT
    return high and len(points) >= MIN_POINTS and float(np.ptp(points, axis=0).max()) >= MIN_SIZE


def _numbers(points: Array, height: Array, low: Array, found: Placed) -> IntArray:
    """The cluster (n,) of each point (n, 3) of a `height` (n,) over the table, `NOISE` or `ELSEWHERE` of none."""
    table = found.table
    numbers = np.where(height > low, ELSEWHERE, NOISE)
    chosen = np.flatnonzero((height > low) & (height < HIGHEST))
    chosen = chosen[table.over(points[chosen], BESIDE)]
    for wall in found.walls:
        chosen = chosen[~_on(wall, points[chosen])]
    numbers[chosen] = clustered(points[chosen])
    least = np.maximum(FOOT, FOOT_SHARE * low)
    foot = np.flatnonzero((height > least) & (height <= low))
    body = np.flatnonzero(numbers >= 0)  # (b,)
    if len(body) and len(foot):
        found_near = cKDTree(points[body]).query(points[foot], distance_upper_bound=FOOT_REACH)
        away, nearest = map(np.asarray, found_near)
        reached = np.isfinite(away)
        numbers[foot[reached]] = numbers[body[nearest[reached]]]
    return numbers


def _on(wall: ScenePlane, points: Array) -> BoolArray:
    """Whether points (n, 3) are on a wall."""
    height = wall.heights(points)
    near = np.abs(height) < wall.lowest(points, height)
    near[near] = wall.over(points[near], WALL_MARGIN)
    return near


def _maps(chosen: BoolArray, found: Placed) -> tuple[BoolArray, ...]:
    """A mask (n,) of the points of all views as masks (H, W) of their pixels."""
    maps = []
    for view in found.views:
        measured = view.measured
        mask = np.zeros(measured.shape, bool)
        mask[measured], chosen = chosen[: measured.sum()], chosen[measured.sum() :]
        maps.append(mask)
    return tuple(maps)


def _distance(points: Array, found: Placed) -> float | None:
    """[m] Distance from the middle of points (n, 3) to the nearest camera, if one is known."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    away = [float(np.linalg.norm(view.camera - middle)) for view in found.views if view.camera is not None]
    return min(away, default=None)
