"""Simulated stereo depth cameras around a table, with their measurement errors."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.checked import Checked, NotNegative, Positive
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import raycasting


@dataclass(frozen=True)
class DepthCamera(Checked):
    """A stereo depth camera with square pixels; the defaults are a RealSense D415.

    Field of view at 640 x 480: 50 deg horizontally in Intel's D400 series datasheet (337029), which gives
    39 deg vertically (the datasheet: 40 ± 1). Stereo noise grows as in Intel's guide to tuning these cameras:
    depth error = depth² subpixel error / (focal length · baseline), 0.64 mm at 0.55 m on what faces the camera
    and, as it grows with the tilt, 1 mm or so on the average of what is seen.
    """

    section: ClassVar[str] = "camera"
    width: Annotated[int, (1, 4096)] = 640
    """[px]"""
    height: Annotated[int, (1, 4096)] = 480
    """[px]"""
    field_of_view_deg: Annotated[float, (1.0, 170.0)] = 50.0
    """horizontal"""
    baseline: Positive = 0.055
    """[m] distance between the two imagers"""
    subpixel_error: NotNegative = 0.08
    """[px] deviation of the disparity, on a surface facing the camera"""
    depth_unit: Positive = 1e-4
    """[m] depths are whole multiples of this"""
    max_incidence_deg: Annotated[float, (1.0, 89.9)] = 80.0
    """surfaces seen at a more grazing angle return nothing"""
    dropout_share: Annotated[float, (0.0, 1.0)] = 0.03
    """share of square blocks of pixels that return nothing"""
    dropout_block: Annotated[int, (1, 4096)] = 8
    """[px] side of such a block"""
    flying_jump: NotNegative = 0.01
    """[m] neighbouring pixels whose depths differ by more are at an edge"""
    flying_share: Annotated[float, (0.0, 1.0)] = 0.2
    """share of the body's pixels at an edge that measure a depth between the two sides"""
    flying_reach: NotNegative = 0.03
    """[m] but no farther behind the body than this"""

    @property
    def focal_length(self) -> float:
        """In pixels."""
        return self.width / 2 / float(np.tan(np.deg2rad(self.field_of_view_deg) / 2))

    @property
    def half_angle(self) -> float:
        """[rad] Angle between the axis and the nearest edge of the image."""
        return float(np.arctan(min(self.width, self.height) / 2 / self.focal_length))

    @property
    def intrinsics(self) -> Array:
        """K (3, 3) [px], (0, 0) being the middle of the first pixel: `rays` are K⁻¹ (u, v, 1)."""
        f = self.focal_length
        return np.array([[f, 0.0, (self.width - 1) / 2], [0.0, f, (self.height - 1) / 2], [0.0, 0.0, 1.0]])

    def rays(self) -> Array:
        """Directions (height, width, 3) of all pixels in the camera's frame: x right, y down, z = 1 ahead."""
        u, v = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        x, y = (u - self.width / 2) / self.focal_length, (v - self.height / 2) / self.focal_length
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def flying(self, depth: Array, rng: np.random.Generator) -> Array:
        """Depths (height, width) [m] in which some pixels at an edge mix the body with its background."""
        padded = np.pad(depth, 1, mode="edge")
        sides = [padded[1:-1, :-2], padded[1:-1, 2:], padded[:-2, 1:-1], padded[2:, 1:-1]]
        behind = np.max(sides, axis=0)
        with np.errstate(invalid="ignore"):  # two pixels beyond the table are no edge
            step = behind - depth
        mixed = (step > self.flying_jump) & (rng.random(depth.shape) < self.flying_share)
        gap = np.where(mixed, np.minimum(step, self.flying_reach), 0.0)
        return depth + gap * rng.random(depth.shape)

    def measured(self, depth: Array, cosine: Array, rng: np.random.Generator) -> Array:
        """Measured depths (height, width) [m], NaN where nothing is returned.

        `cosine` (height, width) is the cosine of the angle of incidence. Noise grows as 1 / cosine, because a tilted
        surface spreads over more disparities.
        """
        deviation = depth**2 * self.subpixel_error / (self.focal_length * self.baseline)
        facing = np.cos(np.deg2rad(self.max_incidence_deg))
        with np.errstate(invalid="ignore"):  # beyond the table both are infinite
            noisy = depth + deviation / np.maximum(cosine, facing) * rng.standard_normal(depth.shape)
        block = self.dropout_block
        blocks = (-(-self.height // block), -(-self.width // block))
        lost = np.kron(rng.random(blocks) < self.dropout_share, np.ones((block, block), bool))
        lost = lost[: self.height, : self.width] | (cosine < facing)
        return np.where(lost, np.nan, np.round(noisy / self.depth_unit) * self.depth_unit)


@dataclass(frozen=True, eq=False)
class Image:
    """What the rays of a camera meet, without measurement errors."""

    depth: Array  # (height, width) [m] of the body or the table, infinite beyond both
    cosine: Array  # (height, width) cosine of the angle of incidence
    body: BoolArray  # (height, width) whether it is the body


def looking_at(position: Array, target: Array) -> Array:
    """Rotation (3, 3) whose columns are the camera's x, y, z axes in the world, z towards the target."""
    forward = target - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)


def image(mesh: Mesh, position: Array, directions: Array) -> Image:
    """What rays from a position (3,) along directions (height, width, 3) meet of a body on the table z = 0.

    Depths are multiples of the directions. Faces are visible from both sides, so an open mesh is a surface.
    """
    origins = np.broadcast_to(position, directions.shape)
    rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
    hits = raycasting(mesh).cast_rays(rays, nthreads=1)
    depth = hits["t_hit"].numpy().astype(np.float64)
    normal = hits["primitive_normals"].numpy().astype(np.float64)
    with np.errstate(divide="ignore"):
        table = np.where(directions[..., 2] < 0, -position[2] / directions[..., 2], np.inf)
    body = depth < table
    along = np.where(body, np.abs(np.sum(directions * normal, axis=-1)), np.abs(directions[..., 2]))
    return Image(np.minimum(depth, table), along / np.linalg.norm(directions, axis=-1), body)


def view(mesh: Mesh, camera: DepthCamera, position: Array, target: Array, rng: np.random.Generator) -> Array:
    """The points (n, 3) [m] of a body on the table z = 0 that a camera measures, in the world.

    The body's pixels, also flying ones, are separated from the table's without error.
    """
    directions = camera.rays() @ looking_at(position, target).T  # their z in the camera is 1, so a multiple is a depth
    seen = image(mesh, position, directions)
    depth = camera.measured(camera.flying(seen.depth, rng), seen.cosine, rng)
    points = position + depth[..., None] * directions
    return points[seen.body & np.isfinite(depth)]


def miscalibrated(
    points: Array,
    shift: tuple[float, float],
    turn_deg: float,
    target: Array,
    rng: np.random.Generator,
) -> Array:
    """Points (n, 3) moved by a small rigid error: turned about the target, shifted by a length in `shift` [m]."""
    axis, direction = rng.standard_normal((2, 3))
    axis *= np.deg2rad(turn_deg) / np.linalg.norm(axis)
    direction *= rng.uniform(*shift) / np.linalg.norm(direction)
    return points + np.cross(axis, points - target) + direction
