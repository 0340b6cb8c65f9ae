"""Simulated depth cameras around a table: what a stereo depth camera measures of a mesh, with its errors."""

from dataclasses import dataclass

import numpy as np
from bodies import Mesh
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class DepthCamera:
    """A stereo depth camera with square pixels; the defaults are a RealSense D415.

    Field of view at 640 x 480: 50 deg horizontally in Intel's D400 series datasheet (337029), which gives
    39 deg vertically (the datasheet: 40 ± 1). Stereo noise grows as in Intel's guide to tuning these cameras:
    depth error = depth² subpixel error / (focal length · baseline), 0.64 mm at 0.55 m.
    """

    width: int = 640  # [px]
    height: int = 480  # [px]
    field_of_view_deg: float = 50.0  # horizontal
    baseline: float = 0.055  # [m] between the two imagers
    subpixel_error: float = 0.08  # [px] deviation of the disparity, on a surface facing the camera
    depth_unit: float = 1e-4  # [m] depths are whole multiples of it
    max_incidence_deg: float = 80.0  # surfaces seen at a more grazing angle return nothing
    dropout_share: float = 0.03  # of square blocks of pixels that return nothing
    dropout_block: int = 8  # [px] side of such a block

    @property
    def focal_length(self) -> float:
        """In pixels."""
        return self.width / 2 / float(np.tan(np.deg2rad(self.field_of_view_deg) / 2))

    def rays(self) -> FloatArray:
        """Directions (height, width, 3) of all pixels in the camera's frame: x right, y down, z = 1 ahead."""
        u, v = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        x, y = (u - self.width / 2) / self.focal_length, (v - self.height / 2) / self.focal_length
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def measured(self, depth: FloatArray, cosine: FloatArray, rng: np.random.Generator) -> FloatArray:
        """True depths (height, width) [m] as measured, NaN where nothing comes back.

        `cosine` (height, width) is that of the angle of incidence: noise grows as 1 / cosine, because a tilted
        surface spreads over more disparities.
        """
        deviation = depth**2 * self.subpixel_error / (self.focal_length * self.baseline)
        facing = np.cos(np.deg2rad(self.max_incidence_deg))
        noisy = depth + deviation / np.maximum(cosine, facing) * rng.standard_normal(depth.shape)
        block = self.dropout_block
        blocks = (-(-self.height // block), -(-self.width // block))
        lost = np.kron(rng.random(blocks) < self.dropout_share, np.ones((block, block), bool))
        lost = lost[: self.height, : self.width] | (cosine < facing)
        return np.where(lost, np.nan, np.round(noisy / self.depth_unit) * self.depth_unit)


def ring(count: int, distance: float, elevation_deg: float, azimuth_deg: float, target: FloatArray) -> FloatArray:
    """Positions (count, 3) [m] evenly spaced around and above a target (3,), the first at `azimuth_deg`."""
    azimuth = np.deg2rad(azimuth_deg) + 2 * np.pi * np.arange(count) / count
    flat, up = np.cos(np.deg2rad(elevation_deg)), np.full(count, np.sin(np.deg2rad(elevation_deg)))
    return target + distance * np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), up], axis=1)


def looking_at(position: FloatArray, target: FloatArray) -> FloatArray:
    """Rotation (3, 3) whose columns are the camera's x, y, z axes in the world, z towards the target."""
    forward = target - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)


def view(
    mesh: Mesh, camera: DepthCamera, position: FloatArray, target: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """The points (n, 3) [m] of a mesh that a camera measures, in the world."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    tensor = o3d.core.Tensor.from_numpy
    scene.add_triangles(tensor(mesh.vertices.astype(np.float32)), tensor(mesh.faces.astype(np.uint32)))
    rotation = looking_at(position, target)
    rays = camera.rays()
    directions = rays @ rotation.T
    origins = np.broadcast_to(position, directions.shape)
    hits = scene.cast_rays(tensor(np.concatenate([origins, directions], axis=-1).astype(np.float32)))
    depth = hits["t_hit"].numpy().astype(np.float64)  # the rays have z = 1, so this is the depth
    depth[~np.isfinite(depth)] = np.nan
    normal = hits["primitive_normals"].numpy().astype(np.float64)
    cosine = -np.sum(directions * normal, axis=-1) / np.linalg.norm(directions, axis=-1)
    measured = camera.measured(depth, cosine, rng)[..., None] * directions + position
    return measured[np.isfinite(measured).all(axis=-1)]


def miscalibrated(
    points: FloatArray,
    shift: tuple[float, float],
    turn_deg: float,
    target: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Points (n, 3) moved by a small rigid error: turned about the target, shifted by a length in `shift` [m]."""
    axis, direction = rng.standard_normal((2, 3))
    axis *= np.deg2rad(turn_deg) / np.linalg.norm(axis)
    direction *= rng.uniform(*shift) / np.linalg.norm(direction)
    return points + np.cross(axis, points - target) + direction
