"""Depth images of a calibrated camera, with the object's pixels marked, as the cloud of an observation.

    x = t + R z K⁻¹ (u, v, 1)ᵀ,     z the depth at the pixel (u, v), (R, t) the camera's pose, K its intrinsics

The camera looks along its z axis, x to the right of the image and y down it (OpenCV, ROS's optical frames); (0, 0) is
the middle of the first pixel. Images are rectified: no lens distortion is undone. Colour is not used; what finds the
object in it gives the mask.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sgnlp.clouds import floats
from sgnlp.errors import InputError
from sgnlp.observation import DEFAULTS, Observation, ObservationSettings, observe

FloatArray = NDArray[np.float64]

TABLE_REACH = 0.1
"""The table is looked for this far around the object's cloud [m]."""
TABLE_PIXELS = 100
"""Fewest pixels of a table."""
TABLE_DIGITS = 4
"""Decimals of the height [m] that pixels give a table."""
ROTATION_ERROR = 1e-3
"""Largest element of RᵀR - I that is rounding."""


@dataclass(frozen=True, eq=False)
class DepthImage:
    """What a camera measured of a scene. Raises `InputError` for what is no such image.

    Attributes:
        depth: (height, width) along the camera's axis, in `unit`; 0, NaN or infinite where nothing came back.
        mask: (height, width) true where the pixel is the object's.
        intrinsics: K (3, 3) [px], `[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`.
        pose: (4, 4) of the camera in the world [m], whose z is up: it takes camera to world coordinates.
        unit: of the depths [m]; 0.001 for the 16-bit images of most cameras.
        name: of the camera.
    """

    depth: ArrayLike
    mask: ArrayLike
    intrinsics: ArrayLike
    pose: ArrayLike
    unit: float = 1.0
    name: str = ""

    def __post_init__(self) -> None:
        """Check every part against the others."""
        depth = floats(self.depth, "depth", (None, None))
        mask = np.asarray(self.mask)
        if mask.shape != depth.shape:
            raise InputError(f"the mask must have the shape of the depth image, {depth.shape}; found {mask.shape}")
        K, pose = floats(self.intrinsics, "intrinsics", (3, 3)), floats(self.pose, "pose", (4, 4))
        if not (np.isfinite(K).all() and K[0, 0] > 0 and K[1, 1] > 0 and np.array_equal(K[2], [0, 0, 1])):
            raise InputError("the intrinsics must be [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy")
        R = pose[:3, :3]
        rigid = np.isfinite(pose).all() and np.abs(R.T @ R - np.eye(3)).max() < ROTATION_ERROR
        if not (rigid and np.linalg.det(R) > 0 and np.array_equal(pose[3], [0, 0, 0, 1])):
            raise InputError("the pose must be [[R, t], [0 0 0 1]] with a rotation matrix R, camera to world")
        if not (np.isfinite(self.unit) and self.unit > 0):
            raise InputError(f"the unit of the depths must be a positive number of metres; found {self.unit}")
        for name, value in {"depth": depth, "mask": mask.astype(bool), "intrinsics": K, "pose": pose}.items():
            object.__setattr__(self, name, value)

    def points(self) -> FloatArray:
        """World coordinates (height, width, 3) [m] of every pixel, NaN where nothing came back."""
        depth, pose = np.asarray(self.depth), np.asarray(self.pose)
        v, u = np.indices(depth.shape)
        rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(np.asarray(self.intrinsics)).T
        z = np.where(np.isfinite(depth) & (depth > 0), depth * self.unit, np.nan)
        return np.asarray(z[..., None] * (rays @ pose[:3, :3].T) + pose[:3, 3])


def from_depth(
    images: DepthImage | Sequence[DepthImage],
    *,
    name: str = "object",
    table_height: float | None = None,
    settings: ObservationSettings = DEFAULTS,
) -> Observation:
    """The observation of an object in one depth image or several, each a view.

    `table_height` [m] is measured where it is not given, as in `arrays`. Raises `InputError` if the marked pixels
    cannot be the cloud of one graspable object on a table.
    """
    images = [images] if isinstance(images, DepthImage) else list(images)
    names = [image.name or str(i) for i, image in enumerate(images)]
    return observe(**arrays(images, table_height), view_names=names, name=name, settings=settings)


def arrays(images: Sequence[DepthImage], table_height: float | None = None) -> dict[str, Any]:
    """`points` (N, 3), `view` (N,), `camera_positions` (V, 3), `table_height` (if it is known) and `notes`.

    Where the height of the table is not given it is the median of what else was measured around the object, within
    `TABLE_REACH` of the box of its points seen from above.
    """
    if not images:
        raise InputError("no depth image is given")
    worlds = [image.points() for image in images]
    measured = [np.isfinite(world[..., 2]) for world in worlds]
    marked = [np.asarray(image.mask) & seen for image, seen in zip(images, measured, strict=True)]
    for number, (image, mask) in enumerate(zip(images, marked, strict=True)):
        if not mask.any():
            raise InputError(f"no depth was measured at any marked pixel of the image '{image.name or number}'")
    objects = [world[mask] for world, mask in zip(worlds, marked, strict=True)]
    rest = [world[seen & ~np.asarray(image.mask)] for image, world, seen in zip(images, worlds, measured, strict=True)]
    found: dict[str, Any] = {
        "points": np.concatenate(objects),
        "view": np.repeat(np.arange(len(images)), [len(cloud) for cloud in objects]),
        "camera_positions": np.stack([np.asarray(image.pose)[:3, 3] for image in images]),
        "notes": [],
    }
    if table_height is None:
        table_height = _table(found["points"], np.concatenate(rest), found["notes"])
    return found if table_height is None else found | {"table_height": table_height}


def _table(cloud: FloatArray, rest: FloatArray, notes: list[str]) -> float | None:
    """The median height [m] of what was measured around a cloud, None of too little."""
    low, high = cloud[:, :2].min(axis=0) - TABLE_REACH, cloud[:, :2].max(axis=0) + TABLE_REACH
    around = rest[((rest[:, :2] > low) & (rest[:, :2] < high)).all(axis=1), 2]
    if len(around) < TABLE_PIXELS:
        return None
    height = round(float(np.median(around)), TABLE_DIGITS) + 0.0  # never -0
    notes.append(f"Measured the table at {height:.4f} m, the median height of {len(around)} pixels around the object.")
    return height
