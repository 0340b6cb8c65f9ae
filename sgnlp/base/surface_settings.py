"""Settings of the surface: how it is fitted to a cloud, and to free space."""

from dataclasses import dataclass
from typing import Annotated

from sgnlp.base.checked import Checked, Positive
from sgnlp.base.ranges import Distance, SurfaceLength, SurfaceValue, Width


@dataclass(frozen=True)
class GpisSettings(Checked):
    """How the implicit surface is fitted."""

    section = "gpis"
    kernel: str = "thin_plate"
    """thin_plate, matern32, matern52 or squared_exponential"""
    surface_points: Annotated[int, (10, 5000)] = 200
    """number of measured points kept by farthest-point sampling (release: 200)"""
    interior_points: Annotated[int, (1, 5000)] = 50
    """number of interior points, mixtures of measured points (paper: 50)"""
    surface_noise: Width = 0.005
    """deviation of a measured point [m] (paper: 0.005)"""
    exterior_noise: Width = 0.2
    """deviation of an exterior point [m] (paper: 0.2)"""
    interior_noise: Width = 0.05
    """deviation of an interior point [m] (paper: 0.05)"""
    cube_scale: Annotated[float, (1.0, 10.0)] = 1.2
    """edge of the exterior cube over the longest edge of the object's box (paper: 120 %)"""
    cube_half_min: SurfaceLength = 0.1
    """least half edge of the exterior cube [m] (release: 0.1)"""
    interior_value: Annotated[float, (-10.0, 0.0)] = -0.3
    """value of interior points, in half edges of the cube (release: -0.3)"""
    interior_temperature: Positive = 0.01
    """temperature of the softmax of the interior mixtures (release: 1/100)"""
    prior_mean: SurfaceValue = 1.0
    """prior mean of the thin plate [m] (release: 1); for other kernels it is the exterior value"""
    support_scale: Annotated[float, (1.0, 10.0)] = 1.5
    """R of the kernel over the largest distance between training points; at 1, as in the release, the thin plate is
    not quite positive definite, and the palm leaves the ball"""
    floor: bool = True
    """copy the cloud onto the table, so that the surface closes below (release)"""


@dataclass(frozen=True)
class FreeSpace(Checked):
    """How the surface is fitted if the cameras are known, so that free space is known too.

    These numbers then replace those of `gpis`, except the kernel. They were chosen on the tuning half of the problem
    set, by the error on seen and unseen sides and by the coverage of intervals (`sgnlp study calibration`).
    """

    section = "free_space"
    used: bool = False
    """use the space that cameras saw through; off, or without camera positions: fit the training set of `gpis`"""
    surface_points: Annotated[int, (10, 5000)] = 110
    """number of measured points kept by farthest-point sampling"""
    surface_noise: Width = 0.0025
    """deviation of a measured point [m]"""
    table_points: Annotated[int, (0, 5000)] = 20
    """number of points of the table under the cloud, where no camera saw through to the table"""
    near_points: Annotated[int, (1, 5000)] = 45
    """number of free points near the visual hull"""
    near_from: Distance = 0.004
    """they are at least this far from the hull [m]"""
    near_to: Width = 0.012
    """and at most this far [m]"""
    far_points: Annotated[int, (0, 5000)] = 15
    """number of free points farther from the hull"""
    far_from: Distance = 0.03
    """they are at least this far from the hull [m]"""
    far_to: Width = 0.05
    """and at most this far [m]"""
    far_share: Annotated[float, (0.0, 1.0)] = 0.5
    """value of a far point over its distance to the hull: the hull is larger than the object"""
    noise: Width = 0.004
    """deviation of the value of a free point [m]"""
    symmetry_points: Annotated[int, (0, 5000)] = 30
    """number of points of the side that no camera saw, where the measured ones are after half a turn; 0: none"""
    symmetry_noise: Width = 0.01
    """deviation of these points [m]: not every object looks the same after half a turn"""
    prior_mean: SurfaceLength = 0.1
    """prior mean, and prior deviation of kernels that have one [m]"""
    support_scale: Annotated[float, (1.0, 10.0)] = 2.2
    """R of the kernel over the largest distance between training points, so that the palm stays in the ball"""
    deviation_scale: Positive = 0.36
    """factor on the deviations of both kernel and noise: it leaves the mean unchanged and calibrates the intervals"""
    reserve: Distance = 0.006
    """if free space is used but no camera is known, the surface bulges outwards: `limits.place_error` and
    `closing.margin` are then reduced by this [m]; without that hardly a start is feasible on real clouds"""

    def __post_init__(self) -> None:
        """Also that no band ends before it begins."""
        super().__post_init__()
        self._ordered("near_from", "near_to")
        self._ordered("far_from", "far_to")
