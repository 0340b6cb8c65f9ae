"""The world frame of a scene: that of the given poses, else one in which the table is level."""

from dataclasses import dataclass, replace

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.perception import level
from sgnlp.perception.depth_checks import MAX_DISAGREEMENT
from sgnlp.perception.observation import DEFAULTS
from sgnlp.perception.scene_planes import PLANE_ERROR, ScenePlane, level_at, planes, same
from sgnlp.perception.scene_views import SceneView, in_a_cone, points_of
from sgnlp.perception.table_plane import find_table

STRAIGHT_DOWN = 0.17
"""If the component of a camera's axis along the table is smaller than this (10 deg), it looks straight down. Then the
top of the image gives the direction of x."""
ORIGIN_DIGITS = 6
"""Decimals of the transform in its note."""


@dataclass(frozen=True, eq=False)
class Placed:
    """Views in the world, with the table and other wide planes."""

    views: list[SceneView]
    table: ScenePlane
    walls: list[ScenePlane]
    transform: Array  # (4, 4) from the frame that was given
    notes: list[str]


def placed(views: list[SceneView], pose: Array | None, table_height: float | None) -> Placed:
    """Views in the world, in which a table is level.

    Raises:
        InputError: no table is found, or it is tilted in the given world.
    """
    images = [view.image for view in views if view.image is not None]
    if pose is not None and any(image.pose is not None for image in images):
        raise InputError("the depth image has a pose already; give one of the two")
    posed = pose is not None or any(image.pose is not None for image in images)
    if table_height is not None and images and not posed:
        raise InputError("the table's height is the world's: give the pose of the camera with it")
    notes: list[str] = []
    cone = not images and len(views) == 1 and views[0].camera is None and in_a_cone(points_of(views))
    if pose is not None:
        if cone:
            notes.append(OWN_FRAME)
            views = [replace(views[0], camera=np.zeros(3))]
        views = [view.moved(pose) for view in views]
    points, camera = points_of(views), _camera(views)
    if images:
        notes += _bent(views[0])
    own = not posed and (bool(images) or cone)
    found = planes(points, camera)
    table = find_table(points, found, camera, own, posed)
    if table_height is not None:
        notes += _higher(table, table_height)
        table = level_at(table_height)
    if table is None:
        table = _assumed(points, own, notes)
    transform = np.eye(4) if pose is None else pose
    if posed or (not images and table.tilt_deg <= level.MAX_TILT_DEG):
        notes += _checked(views, table, points)
    else:
        views, transform = _turned(views, table, own, notes)
        table, found = table.moved(transform), [plane.moved(transform) for plane in found]
    walls = [plane for plane in found if plane.wide and not same(plane, table)]
    return Placed(views, table, walls, transform, notes)


OWN_FRAME = "Took the camera to be at the origin of the cloud's own frame: all points lie in a cone before it."


def _bent(view: SceneView) -> list[str]:
    """A note if the depths of an image bend the table."""
    points, given = view.points[view.measured], view.image.pose if view.image is not None else None
    pose = np.eye(4) if given is None else np.asarray(given)
    return level.along_rays(points, pose, level.planes(points, pose[:3, 3]))[1]


def _camera(views: list[SceneView]) -> Array | None:
    """The mean (3,) of the cameras, from which all planes are seen, if all cameras are known."""
    cameras = [view.camera for view in views if view.camera is not None]
    return np.mean(cameras, axis=0) if len(cameras) == len(views) else None


def _assumed(points: Array, own: bool, notes: list[str]) -> ScenePlane:
    """The table below a cloud that is cropped to an object, in the world frame."""
    width = float(np.ptp(points, axis=0).max())
    if own or width > DEFAULTS.max_width:
        raise InputError(
            "no table was found: no plane of the scene is wide, with nothing seen below it; a depth image or cloud of "
            "a whole scene shows the table around the objects"
        )
    height = float(np.quantile(points[:, 2], DEFAULTS.table_quantile))
    notes.append(f"Assumed the table at {height:.4f} m, below the lowest points: the cloud shows none.")
    return level_at(height)


def _checked(views: list[SceneView], table: ScenePlane, points: Array) -> list[str]:
    """Notes on the table in a given world. Raises `InputError` if it is far from level."""
    if table.count == 0:
        return []
    image = views[0].image
    if image is not None:
        on = points[np.abs(table.heights(points)) < PLANE_ERROR]
        notes = level.check(on[table.over(on)], np.asarray(image.pose), "the points of the table")
    elif table.tilt_deg > level.REFUSED_TILT_DEG:
        raise InputError(f"the table is tilted by {table.tilt_deg:.1f} deg, but it is level: look at --pose and --up")
    else:
        tilted = f"The table is tilted by {table.tilt_deg:.1f} deg, more than {level.MAX_TILT_DEG:g}: look at the pose."
        notes = [tilted] if table.tilt_deg > level.MAX_TILT_DEG else []
    return [f"Found the table at {_height(table):.4f} m, from {table.count} points.", *notes]


def _height(table: ScenePlane) -> float:
    """The height [m] of a table in the middle of its outline."""
    middle = table.outline.mean(axis=0)
    return float(middle[2] - table.heights(middle) / table.normal[2])


def _higher(found: ScenePlane | None, given: float) -> list[str]:
    """A note if the table that was `found` is above the one that is `given` [m]; below it are floors and tables."""
    if found is None or not found.wide or found.tilt_deg > level.MAX_TILT_DEG:
        return []
    height = _height(found)
    if height <= given + MAX_DISAGREEMENT:
        return []
    return [
        f"The table is taken to be at {given:.3f} m, but most things stand on a plane of {found.count} points at "
        f"{height:.3f} m, more than {MAX_DISAGREEMENT:g} m above it: look at --table-height, --unit and the pose."
    ]


def _turned(views: list[SceneView], table: ScenePlane, own: bool, notes: list[str]) -> tuple[list[SceneView], Array]:
    """Views in a world whose z is the table's normal, and the transform (4, 4) to it."""
    n = table.normal
    if own:
        ahead = np.array([0.0, 0.0, np.sign(np.median(points_of(views)[:, 2]))])
        x = ahead - n * (n @ ahead)
        if np.linalg.norm(x) < STRAIGHT_DOWN:
            top = np.array([0.0, -ahead[2], 0.0])
            x = top - n * (n @ top)
        origin = n * table.offset
        where = "the origin on the table below the camera, and x ahead of it"
    else:
        sides = np.eye(3) - np.outer(n, n)
        x = sides[int(np.linalg.norm(sides, axis=1)[:2].argmax())]
        middle = table.outline.mean(axis=0)
        origin = middle - n * table.heights(middle)
        where = "the origin in the middle of the table"
    x = x / np.linalg.norm(x)
    transform = np.eye(4)
    transform[:3, :3] = np.stack([x, np.cross(n, x), n])
    transform[:3, 3] = -transform[:3, :3] @ origin
    if own and views[0].image is None:
        notes.append(OWN_FRAME)
        views = [replace(view, camera=np.zeros(3)) for view in views]
    rows = "; ".join(" ".join(f"{x:.{ORIGIN_DIGITS}g}" for x in row) for row in transform[:3] + 0.0)
    notes.append(
        f"No pose is given: turned the world so that the table, found from {table.count} points, is level, with "
        f"{where}. To it from the given frame, [R t] by rows: {rows}."
    )
    return [view.moved(transform) for view in views], transform
