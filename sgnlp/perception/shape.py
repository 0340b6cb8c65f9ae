"""Convex shapes in the world: obstacles, and regions that fingers must touch or avoid.

Every shape is a box or an upright cylinder in its own frame, with a radius around it:

    u = Rᵀ(x - c),   q = |u| - h   (box),   q = (√(u_x² + u_y²) - h_x, |u_z| - h_z)   (cylinder)
    d(x) = |max(q, 0)| + min(max_i q_i, 0) - r

A sphere is a box without extent, a half-space the top of a very large box.
"""

from dataclasses import dataclass, replace
from functools import reduce
from numbers import Real
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from sgnlp.base.arrays import Array
from sgnlp.base.checked import require_fields
from sgnlp.base.errors import InputError

LARGEST = float(np.finfo(float).max)
"""[m] A whole number above this is no floating-point number."""
FAR = 10.0
"""Half extent that stands for infinity [m]: a hand and its arm are at most 2 m long."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A convex solid in the world frame. Make one by `box`, `sphere`, `cylinder` or `half_space`.

    With u = Rᵀ(x - c), half extents h and radius r its signed distance, negative inside, is

        q = |u| - h   (box),   q = (√(u_x² + u_y²) - h_x, |u_z| - h_z)   (cylinder)
        d(x) = |max(q, 0)| + min(max_i q_i, 0) - r
    """

    name: str
    centre: Array  # (3,) [m] in the world
    rotation: Array  # (3, 3), its axes in the world are the columns
    half: Array  # (3,) [m] half extents; for a cylinder its radius, FAR, half its height
    radius: float = 0.0  # [m] by which it is inflated
    circular: bool = False  # whether x and y are one radial coordinate

    def __post_init__(self) -> None:
        """Raise `InputError` for a field of another kind or shape; the classmethods have the reasons in words."""
        require_fields(self, "a shape", ("name", "radius", "circular"))
        for name in ("centre", "half"):
            object.__setattr__(self, name, _vector(getattr(self, name), f"the {name} of '{self.name}'"))
        object.__setattr__(self, "rotation", _turn(self.rotation, self.name))
        if (self.half < 0).any():
            raise InputError(f"the half extents of '{self.name}' must not be negative [m], not {self.half}")
        if not abs(float(self.radius)) <= LARGEST:
            raise InputError(f"the radius of '{self.name}' must be a finite number [m], not {self.radius:g}")

    @classmethod
    def box(cls, centre: ArrayLike, size: ArrayLike, rotation: ArrayLike | None = None, name: str = "box") -> Self:
        """A box with edges `size` (3,) [m] about `centre` (3,) [m]; raises `InputError` unless they are positive."""
        edges = _vector(size, f"the size of '{name}'", positive=True)
        return cls(name, _vector(centre, f"the centre of '{name}'"), _turn(rotation, name), edges / 2)

    @classmethod
    def sphere(cls, centre: ArrayLike, radius: float, name: str = "sphere") -> Self:
        """A ball of this radius [m] about `centre` (3,) [m]; raises `InputError` unless the radius is positive."""
        place = _vector(centre, f"the centre of '{name}'")
        return cls(name, place, np.eye(3), np.zeros(3), _length(radius, f"the radius of '{name}'"))

    @classmethod
    def cylinder(
        cls, centre: ArrayLike, radius: float, height: float, rotation: ArrayLike | None = None, name: str = "cylinder"
    ) -> Self:
        """A cylinder about the z axis of its frame, `radius` and `height` in m; raises `InputError` as `box`."""
        around, along = _length(radius, f"the radius of '{name}'"), _length(height, f"the height of '{name}'")
        half = np.array([around, FAR, along / 2])
        return cls(name, _vector(centre, f"the centre of '{name}'"), _turn(rotation, name), half, circular=True)

    @classmethod
    def half_space(cls, point: ArrayLike, normal: ArrayLike, name: str = "half-space") -> Self:
        """All points behind a plane through `point` (3,) [m]; its `normal` (3,) points out of the solid."""
        outward = _vector(normal, f"the normal of '{name}'")
        length = float(np.linalg.norm(outward))
        if length == 0:
            raise InputError(f"the normal of '{name}' must not be 0")
        z = outward / length
        x = np.eye(3)[int(np.abs(z).argmin())]
        x = x - z * (z @ x)
        x /= np.linalg.norm(x)
        rotation = np.column_stack([x, np.cross(z, x), z])
        return cls(name, _vector(point, f"the point of '{name}'") - FAR * z, rotation, np.full(3, FAR))

    def inflated(self, by: float) -> Self:
        """The shape grown by `by` [m]; a negative value shrinks the radius around it."""
        return replace(self, radius=self.radius + by)

    def moved(self, shift: Array) -> Self:
        """The shape displaced by `shift` (3,) [m]."""
        return replace(self, centre=self.centre + shift)

    def local(self, points: Array) -> Array:
        """Points (K, 3) [m] in the shape's frame."""
        return np.asarray((points - self.centre) @ self.rotation)

    def distance(self, points: Array) -> Array:
        """The exact signed distances (K,) [m] of points (K, 3)."""
        x, y, z = np.ascontiguousarray(self.local(points).T)  # a row each: NumPy is slow along rows of three
        q = [np.hypot(x, y), z] if self.circular else [x, y, z]
        half = self.half[[0, 2]] if self.circular else self.half
        for values, extent in zip(q, half, strict=True):
            np.abs(values, out=values)
            values -= extent
        outside = np.sqrt(reduce(np.add, [np.maximum(values, 0) ** 2 for values in q]))
        return np.asarray(outside + np.minimum(reduce(np.maximum, q), 0) - self.radius)


def _vector(values: ArrayLike, what: str, positive: bool = False) -> Array:
    try:
        found = np.asarray(values, float)
    except (TypeError, ValueError, OverflowError):
        found = np.full(1, np.nan)
    if found.shape != (3,) or not np.isfinite(found).all() or (positive and (found <= 0).any()):
        raise InputError(f"{what} must be three {'positive ' if positive else ''}numbers [m], not {values!r}")
    return found


def _length(value: float, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < float(value) <= LARGEST:
        raise InputError(f"{what} must be a positive number [m], not {value!r}")
    return float(value)


def _turn(rotation: ArrayLike | None, name: str) -> Array:
    if rotation is None:
        return np.eye(3)
    try:
        R = np.asarray(rotation, float)
    except (TypeError, ValueError):
        R = np.zeros(0)
    if R.shape != (3, 3) or not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0:
        raise InputError(f"the rotation of '{name}' must be a rotation matrix (3, 3)")
    return R
