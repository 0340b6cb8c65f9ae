"""Views of a whole scene: maps of measured points, without invalid ones.

A depth image, an organised cloud (H, W, 3) and a plain cloud (N, 3), which is kept as one column (N, 1, 3), are views
alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError
from sgnlp.perception import depth_checks, point_arrays
from sgnlp.perception.cleaning import UNITS
from sgnlp.perception.depth import DepthImage

FLYING_STEP, FLYING_SHARE = 0.004, 0.01
"""Neighbours are on one surface if their depths differ by at most this [m], or by this share of the depth: the rows of
a table seen at 10 deg differ by 10 mm at 1 m."""
FLYING_NEIGHBOURS = 3
"""A pixel at a body's corner has this many neighbours on the body; one between two bodies has fewer."""
FAR = 10.0
"""[m] Points farther from the camera, or from the middle of the scene, show the room, or a sensor's largest value."""
WIDTHS, CROPPED = (0.03, 20.0), 0.05
"""The width of a cloud leaves out this share of the points on each side: they may be marks for no return."""
USUAL = (0.2, 5.0)
"""[m] Range of widths of a scene; the error message proposes a unit that fits it."""
CONE_DEG = 50.0
"""In a camera's own frame all points are within this angle of ±z: half the diagonal field of view."""
CONE_NEAR = 0.1
"""[m] Nearest point of such a frame."""
CONE_SHARE = 0.99
"""Share of the points for which this must hold: a few may be stray."""


@dataclass(frozen=True, eq=False)
class SceneView:
    """A map of points [m], NaN where nothing was measured or a point was dropped."""

    points: Array  # (H, W, 3); (N, 1, 3) of a plain cloud
    name: str
    camera: Array | None = None  # (3,) [m] position of the camera, in the frame of the points
    image: DepthImage | None = None  # with its pose in that frame

    @property
    def organised(self) -> bool:
        """Whether its points are pixels."""
        return self.points.shape[1] > 1

    @property
    def measured(self) -> BoolArray:
        """The pixels (H, W) that have a point."""
        return np.asarray(np.isfinite(self.points[..., 2]))

    def moved(self, pose: Array) -> "SceneView":
        """The same in the frame that a pose (4, 4) takes to."""
        R, t = pose[:3, :3], pose[:3, 3]
        image = self.image
        if image is not None:
            image = replace(image, pose=pose if image.pose is None else pose @ np.asarray(image.pose))
        camera = None if self.camera is None else R @ self.camera + t
        return replace(self, points=self.points @ R.T + t, camera=camera, image=image)

    def masked(self, dropped: BoolArray) -> "SceneView":
        """The same without the points of the pixels (H, W) of a mask."""
        return replace(self, points=np.where(dropped[..., None], np.nan, self.points)) if dropped.any() else self


def of_image(image: DepthImage, number: int) -> SceneView:
    """The view of a depth image, in the world, or without a pose in its camera's frame."""
    camera = np.zeros(3) if image.pose is None else np.asarray(image.pose)[:3, 3]
    return SceneView(image.points(), image.name or str(number), camera, image)


def of_points(value: ArrayLike, number: int, name: str = "", camera: Array | None = None) -> SceneView:
    """The view of a cloud (N, 3) or (H, W, 3) in metres."""
    array = np.asarray(value)
    points, _ = point_arrays.rows(array, "points")
    shape = array.shape[:2] if array.ndim == 3 else (len(points), 1)
    return SceneView(points.reshape(*shape, 3), name or str(number), camera)


def cleaned(view: SceneView) -> tuple[SceneView, list[str]]:
    """A view without invalid points, counted in notes: NaN, zeros, far points, flying pixels."""
    notes: list[str] = []

    def drop(view: SceneView, dropped: BoolArray, reason: str) -> SceneView:
        if dropped.any():
            what = "pixels" if view.organised else "points"
            notes.append(f"Dropped {dropped.sum()} of {dropped.size} {what} that {reason}.")
        return view.masked(dropped)

    if view.image is not None and view.measured.any():
        notes += depth_checks.intrinsics(np.asarray(view.image.intrinsics), view.points.shape[:2])
        depth = np.asarray(view.image.depth)
        notes += depth_checks.depths(depth[view.measured], view.image.unit, "scene")
    with np.errstate(invalid="ignore"):
        lost = np.asarray(~np.isfinite(view.points).all(axis=2))
        zero = np.asarray((view.points == 0).all(axis=2))
        view = drop(view, lost, "have no depth" if view.image else "are NaN or infinite")
        view = drop(view, zero, "are (0, 0, 0), which stands for no return")
        if view.measured.any():
            if view.image is None:
                _check_width(view.points[view.measured])
            middle = np.nanmedian(view.points, axis=(0, 1)) if view.camera is None else view.camera
            away = np.linalg.norm(view.points - middle, axis=2)
            view = drop(view, np.asarray(away > FAR), f"are more than {FAR:g} m away")
        if view.organised:
            view = drop(view, flying(view), "fly between two surfaces")
    return view, notes


def flying(view: SceneView) -> BoolArray:
    """The pixels (H, W) with too few neighbours at their distance from the camera: they mix a body and its background.

    In a depth image the distance is the depth. Else it is that from the camera, or from the origin.
    """
    if view.image is None:
        away = np.linalg.norm(view.points - (np.zeros(3) if view.camera is None else view.camera), axis=2)
    else:
        away = np.asarray(view.image.depth) * view.image.unit
    allowed = np.maximum(FLYING_STEP, FLYING_SHARE * away)
    padded = np.pad(away, 1, constant_values=np.nan)
    H, W = away.shape
    same = np.zeros((H, W), np.int64)
    for i in range(3):
        for j in range(3):
            if (i, j) != (1, 1):
                same += np.abs(padded[i : i + H, j : j + W] - away) <= allowed
    return np.asarray(view.measured & (same < FLYING_NEIGHBOURS))


def points_of(views: Sequence[SceneView]) -> Array:
    """The points (n, 3) of all views, one after the other."""
    return np.concatenate([view.points[view.measured] for view in views])


def _check_width(points: Array) -> None:
    """Refuse a cloud (n, 3) that does not have the size of a scene."""
    low, high = np.quantile(points, (CROPPED, 1 - CROPPED), axis=0)
    width = float((high - low).max())
    if not WIDTHS[0] <= width <= WIDTHS[1]:
        fits = [f"{f:g} would make it {f * width:.2g} m" for f in UNITS.values() if WIDTHS[0] <= f * width <= USUAL[1]]
        hint = f"; --unit {', --unit '.join(fits)}" if fits else ""
        raise InputError(f"the scene is {width:.3g} m wide, not {WIDTHS[0]:g} to {WIDTHS[1]:g} m; see --unit{hint}")


def in_a_cone(points: Array) -> bool:
    """Whether points (n, 3) lie before a camera at the origin that looks along z or -z, as in a camera's own frame."""
    z = np.abs(points[:, 2])
    side = np.linalg.norm(points[:, :2], axis=1)
    ahead = (points[:, 2] > 0).mean()
    cone = (side <= z * np.tan(np.deg2rad(CONE_DEG))) & (z > CONE_NEAR)
    return bool(cone.mean() >= CONE_SHARE and not 1 - CONE_SHARE < ahead < CONE_SHARE)


def as_views(given: Any, cameras: Array | None) -> list[SceneView]:
    """The views of one or several depth images or clouds; `cameras` (V, 3) are the positions for clouds."""
    several = isinstance(given, list | tuple)
    items = list(given) if several else [given]
    if not items:
        raise InputError("no depth image or cloud is given")
    if all(isinstance(item, SceneView) for item in items):
        return items
    images = [isinstance(item, DepthImage) for item in items]
    if any(images) and not all(images):
        raise InputError("give depth images or clouds, not both")
    if all(images):
        if len(items) > 1 and any(image.pose is None for image in items):
            raise InputError("each of several depth images needs a pose in one world")
        return [of_image(image, i) for i, image in enumerate(items)]
    if cameras is not None and len(cameras) != len(items):
        raise InputError(f"'camera_positions' has {len(cameras)} rows for {len(items)} clouds")
    return [of_points(item, i, "", None if cameras is None else cameras[i]) for i, item in enumerate(items)]
