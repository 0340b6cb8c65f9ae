"""Depth images of a calibrated camera, with the object's pixels marked, as the cloud of an observation.

    x = t + R z K⁻¹ (u, v, 1)ᵀ,     z the depth at the pixel (u, v), (R, t) the camera's pose, K its intrinsics

The camera looks along its z axis, x to the right of the image and y down it (OpenCV, ROS's optical frames); (0, 0) is
the middle of the first pixel. Images must be rectified: lens distortion is not corrected. Colour is not used; the mask
comes from a segmentation. Without a mask `segment` finds the objects, and the pose may be missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sgnlp.base.arrays import Array, BoolArray, as_array, floats
from sgnlp.base.brief import brief
from sgnlp.base.checked import require_fields, typed
from sgnlp.base.errors import InputError
from sgnlp.perception import depth_checks, free_space, level, mask_checks, masks, pose_checks
from sgnlp.perception.clouds import checked_pose
from sgnlp.perception.observation import DEFAULTS, Observation, ObservationSettings, observe
from sgnlp.perception.table_beside import heights_around, median_height


@dataclass(frozen=True, eq=False)
class DepthImage:
    """A depth image with its camera. Raises `InputError` if a part is invalid or does not fit the others.

    Attributes:
        depth: (height, width) along the camera's axis, in `unit`; 0, negative, NaN, infinite or the largest value of
            an unsigned type where nothing was measured.
        mask: (height, width) true, or not 0, at the object's pixels; soft edges are cut at half. None for an image of a
            whole scene.
        intrinsics: K (3, 3) [px], `[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`.
        pose: (4, 4) of the camera in the world [m], whose z is up: it takes camera to world coordinates. (3, 4) are
            its upper rows. None if it is unknown; `from_depth` needs it.
        unit: unit of the depths [m]; 0.001 for the 16-bit images of most cameras.
        name: name of the camera.
        notes: a sentence for each assumption about the image.
    """

    __repr__ = brief

    depth: ArrayLike
    mask: ArrayLike | None
    intrinsics: ArrayLike
    pose: ArrayLike | None = None
    unit: float = 1.0
    name: str = ""
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Check all parts, and that they fit each other."""
        require_fields(self, "a depth image", ("unit", "name", "notes"))
        raw = _raw(self.depth, "depths")
        if raw.ndim == 3 and raw.shape[2] in (2, 3, 4):
            raise InputError(
                f"the depths are a picture of {raw.shape[2]} channels; give the depths themselves, as 16 bits"
            )
        depth = floats(raw, "depth", (None, None))
        lost = depth < 0
        if raw.dtype.kind == "u":  # drivers write it for no return; it is also -1 as unsigned
            lost = raw == np.iinfo(raw.dtype).max
        scaled = depth_checks.scale(depth)
        depth = np.where(lost, 0.0, depth)
        marked, notes = (None, []) if self.mask is None else _marked(self.mask, depth.shape)
        chosen, which = (np.ones_like(lost), "") if marked is None else (marked, "marked ")
        if (lost & chosen).any():
            mark = f"{raw[lost & chosen][0]:g}"
            notes.append(f"Dropped {(lost & chosen).sum()} of {chosen.sum()} {which}pixels of depth {mark}: no return.")
        if not 0 < self.unit < np.inf:
            raise InputError(f"the unit of the depths must be a positive number of metres; found {self.unit}")
        K, pose = checked_intrinsics(self.intrinsics), None if self.pose is None else checked_pose(self.pose)
        for name, value in {"depth": depth, "mask": marked, "intrinsics": K, "pose": pose}.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "notes", (*self.notes, *scaled, *notes))

    def points(self) -> Array:
        """World coordinates (height, width, 3) [m] of every pixel, NaN where nothing was measured.

        x = t + R z K⁻¹ (u, v, 1)ᵀ; without a pose, coordinates in the camera's own frame.
        """
        depth, pose = np.asarray(self.depth), np.eye(4) if self.pose is None else np.asarray(self.pose)
        v, u = np.indices(depth.shape)
        rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(np.asarray(self.intrinsics)).T
        z = np.where(np.isfinite(depth) & (depth > 0), depth * self.unit, np.nan)
        return np.asarray(z[..., None] * (rays @ pose[:3, :3].T) + pose[:3, 3])


def _raw(values: ArrayLike, what: str) -> NDArray[Any]:
    """The pixels of an image as they are given."""
    try:
        return as_array(values, what)
    except ValueError:
        raise InputError(f"the {what} must be an array (height, width); the rows of these differ in length") from None


def _marked(mask: ArrayLike, shape: tuple[int, ...]) -> tuple[BoolArray, list[str]]:
    """The pixels that a mask of an image (height, width) marks, and notes."""
    mask = _raw(mask, "pixels of the mask")
    if np.shape(mask) != shape:
        raise InputError(
            f"the mask must have the shape of the depth image, {shape}; found {np.shape(mask)}: "
            "align the colour image that it is of to the depths, or give the mask in the pixels of the depths"
        )
    return masks.marked(mask)


def checked_intrinsics(value: ArrayLike) -> Array:
    """K (3, 3), checked. Raises `InputError` if it is invalid; the message says so if it is transposed."""
    K = floats(value, "intrinsics", (3, 3))
    if np.isfinite(K).all() and np.array_equal(K[:, 2], [0, 0, 1]) and not np.array_equal(K[2], [0, 0, 1]):
        raise InputError("the intrinsics are transposed: cx and cy belong into the last column; give K by rows")
    if not (np.isfinite(K).all() and K[0, 0] > 0 and K[1, 1] > 0 and np.array_equal(K[2], [0, 0, 1]) and K[1, 0] == 0):
        raise InputError("the intrinsics must be [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy")
    return K


@typed
def from_depth(
    images: DepthImage | Sequence[DepthImage],
    *,
    name: str = "object",
    table_height: float | None = None,
    settings: ObservationSettings = DEFAULTS,
) -> Observation:
    """The observation of an object in one depth image or several, each a view, in the world frame of their poses.

    Args:
        images: each with a mask and a pose.
        name: name of the observation, and of the folder of its result.
        table_height: [m]; if not given, the median height of what surrounds the object.
        settings: how the cloud is cleaned.

    Raises:
        InputError: the pixels of the masks cannot be the cloud of one graspable object on a table.
    """
    images = [images] if isinstance(images, DepthImage) else list(images)
    names = [image.name or str(i) for i, image in enumerate(images)]
    return observe(**arrays(images, table_height), view_names=names, name=name, settings=settings)


def arrays(images: Sequence[DepthImage], table_height: float | None = None) -> dict[str, Any]:
    """`points` (N, 3), `view` (N,), `camera_positions` (V, 3), `table_height` (if it is known), `notes`, and what the
    cameras saw around and behind the object, `background` (B, 3) and `background_view` (B,).

    If the table's height is not given, it is the median height of the other points near the box of the object's points,
    seen from above. Raises `InputError` if the table in an image is far from level, if no camera measures such depths,
    or if two masks are swapped.
    """
    if not images:
        raise InputError("no depth image is given")
    names = [image.name or str(i) for i, image in enumerate(images)]
    for image, name in zip(images, names, strict=True):
        for part in ("mask", "pose"):
            if getattr(image, part) is None:
                raise InputError(f"the image '{name}' has no {part}; sgnlp.segment finds the objects without it")
    pose_checks.check(images, names)
    seen = [_seen(image, name, table_height) for image, name in zip(images, names, strict=True)]
    masks_of = [np.asarray(image.mask) for image in images]
    mask_checks.swapped([one.world for one in seen], masks_of, [one.table for one in seen], names, table_height)
    objects, rest = [one.points for one in seen], [one.rest for one in seen]
    positions = np.stack([np.asarray(image.pose)[:3, 3] for image in images])
    behind = [free_space.background(*one) for one in zip(positions, objects, rest, strict=True)]
    found: dict[str, Any] = {
        "points": np.concatenate(objects),
        "view": np.repeat(np.arange(len(images)), [len(cloud) for cloud in objects]),
        "camera_positions": positions,
        "background": np.concatenate(behind),
        "background_view": np.repeat(np.arange(len(images)), [len(points) for points in behind]),
        "notes": depth_checks.twins([np.asarray(i.depth) for i in images], [i.pose for i in images], names),
    }
    measured, count = _table(found["points"], np.concatenate(rest))
    if table_height is None and measured is not None:
        table_height = measured
        found["notes"].append(
            f"Measured the table at {measured:.4f} m, the median height of {count} pixels around the object."
        )
    for name, one in zip(names, seen, strict=True):
        for note in one.notes:
            common = all(note in other.notes for other in seen)
            found["notes"] += [] if note in found["notes"] else [note if common else f"{name}: {note}"]
    heights = [_table(cloud, other)[0] for cloud, other in zip(objects, rest, strict=True)]
    found["notes"] += depth_checks.places(positions, objects, heights, table_height)
    return found if table_height is None else found | {"table_height": table_height}


@dataclass(frozen=True, eq=False)
class _Seen:
    """What an image shows."""

    points: Array  # (n, 3) of the object
    rest: Array  # (m, 3) all others
    world: Array  # (height, width, 3) of every pixel
    table: float  # the share of the marked pixels that lies on the table
    notes: tuple[str, ...]


def _seen(image: DepthImage, name: str, table_height: float | None) -> _Seen:
    """The object in an image, what is around it, and notes."""
    world, depth, mask = image.points(), np.asarray(image.depth), np.asarray(image.mask)
    measured = np.isfinite(world[..., 2])
    marked = mask & measured
    if not mask.any():
        raise InputError(f"the mask of the image '{name}' marks no pixel")
    if not marked.any():
        raise InputError(f"no depth was measured at any marked pixel of the image '{name}'")
    hints: list[str] = []
    try:
        hints += depth_checks.intrinsics(np.asarray(image.intrinsics), depth.shape)
        notes = [
            *image.notes,
            *hints,
            *depth_checks.mask(mask, measured),
            *depth_checks.depths(depth[marked], image.unit),
        ]
        middle = float(np.median(depth[marked]))
        far = np.abs(depth - middle) * image.unit > DEFAULTS.max_width
        if (far & marked).any():
            share = f"{(far & marked).sum()} of {marked.sum()} marked pixels"
            notes.append(f"Dropped {share}, more than {DEFAULTS.max_width:g} m nearer or farther than their median.")
        others = measured & ~mask
        near = level.around(mask) & others & (depth < level.MAX_BEHIND * middle)
        notes += level.check(world[near], np.asarray(image.pose))
    except InputError as error:
        raise InputError(" ".join([f"image '{name}': {error}.", *hints]).rstrip(".")) from error
    chosen = marked & ~far
    found = mask_checks.examined(world, depth * image.unit, chosen, table_height)
    rest = world[others | (chosen & ~found.kept)]
    return _Seen(world[found.kept], rest, world, found.table, (*notes, *found.notes))


def _table(cloud: Array, rest: Array) -> tuple[float | None, int]:
    """The median height [m] of the pixels around a cloud, None if they are too few; and their number."""
    around = heights_around(cloud, rest)
    return (None, 0) if around is None else (median_height(around), len(around))
