"""The motion of an object on its table: the planar motion that maps its known points onto a new cloud.

    min over ψ, x, y of  Σ w_i (n(y_i)·(T⁻¹ z_i - y_i))²,   T z = c + Rz(ψ) (z - c) + (x, y, h)

z_i are the new points, y_i the known ones next to T⁻¹ z_i, n the normal of the known surface, c the middle of the known
points, h the rise of the table: iterated closest points with planes (Chen & Medioni 1992) by Gauss-Newton, w Huber's
weight. The new points are compared with the known points, not with the surface, because smoothed edges would bias the
motion. If the turn is undetermined, as for a ball, the damping keeps it at zero.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array
from sgnlp.surface.gpis import Gpis, frozen

POINTS = 150
"""Number of new points that are compared: a cloud has thousands, and neighbours are redundant."""
STEPS, SETTLED = 30, 1e-5
"""Largest number of steps, and the step size that ends them [m, and rad times the object's radius]."""
HUBER = 0.003
"""Distances above this [m] have less weight: twice the noise of a depth camera at 0.6 m."""
DAMPING = 1e-3
"""Share of the mean diagonal entry of JᵀJ of a shift that is added to both, and for the turn at the object's radius."""
NEAR, LOST = 0.005, 0.05
"""The object is the known one if the share of new points this near its surface [m] is as large as that of the known
points, up to this difference."""
AGAIN, SEEN = 0.015, 0.8
"""It must also hold that this share of the known points has a new point this near [m]: no large part is missing."""


@dataclass(frozen=True, eq=False)
class PlanarMotion:
    """z → centre + Rz(yaw) (z - centre) + shift. [rad], [m]."""

    centre: Array  # (3,)
    yaw: float
    shift: Array  # (3,)

    @property
    def rotation(self) -> Array:
        """Rz(yaw) (3, 3)."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def __call__(self, Z: Array) -> Array:
        """Points (…, 3) [m], moved."""
        return self.centre + (Z - self.centre) @ self.rotation.T + self.shift

    def inverse(self, Z: Array) -> Array:
        """Points (…, 3) [m], moved back."""
        return self.centre + (Z - self.centre - self.shift) @ self.rotation

    def moved(self, gpis: Gpis) -> Gpis:
        """The surface, moved: its kernel depends only on distances, so the weights stay the same."""
        X, centre = frozen(self(gpis.X), self(gpis.centre))
        return replace(gpis, X=X, centre=centre)


@dataclass(frozen=True, eq=False)
class Registration:
    """A motion and how well it fits.

    `known` and `new` are the shares of known and of new points near the known surface, `seen` is the share of the known
    points that are seen again.
    """

    motion: PlanarMotion
    known: float
    new: float
    seen: float

    @property
    def fits(self) -> bool:
        """Whether the new cloud shows the known object, moved."""
        return self.new >= self.known - LOST and self.seen >= SEEN


def registered(gpis: Gpis, known: Array, new: Array, rise: float = 0.0) -> Registration:
    """The motion of an object with a known surface, from points `known` (N, 3) to points `new` (K, 3) [m].

    `rise` [m] is the rise of the table.
    """
    Z, centre, tree, normals = spread(new), known.mean(axis=0), _tree(known), np.full(known.shape, np.nan)
    shift = np.array([*(_middle(new) - _middle(known))[:2], rise])
    motion, radius = PlanarMotion(centre, 0.0, shift), float(np.ptp(known, axis=0).max()) / 2
    for _ in range(STEPS):
        nearest = np.asarray(tree.query(motion.inverse(Z))[1])
        asked = nearest[np.isnan(normals[nearest, 0])]  # from step to step most have the same neighbours
        normals[asked] = gpis.normal(known[asked])
        step = _step(motion, Z, known[nearest], normals[nearest])
        motion = PlanarMotion(centre, motion.yaw + step[0], motion.shift + np.append(step[1:], 0.0))
        if max(radius * abs(step[0]), *abs(step[1:])) < SETTLED:
            break
    before = spread(known)
    near, now = (np.abs(gpis.distance(points)) <= NEAR for points in (before, motion.inverse(Z)))
    again = np.asarray(_tree(new).query(motion(before))[0] <= AGAIN)
    return Registration(motion, float(near.mean()), float(now.mean()), float(again.mean()))


def spread(points: Array) -> Array:
    """At most `POINTS` of the points (N, 3), evenly from their order."""
    return points[np.linspace(0, len(points) - 1, min(POINTS, len(points))).round().astype(int)]


def _tree(points: Array) -> cKDTree:
    """A k-d tree that is quick to build, for few queries."""
    return cKDTree(points, compact_nodes=False, balanced_tree=False)


def _middle(points: Array) -> Array:
    return (points.min(axis=0) + points.max(axis=0)) / 2


def offsets(motion: PlanarMotion, Z: Array, Y: Array, N: Array) -> tuple[Array, Array]:
    """Distances d (K,) [m] of points Z (K, 3) from planes through Y (K, 3) with normals N (K, 3), and ∂d/∂(ψ, x, y)."""
    n, arm = N @ motion.rotation.T, Z - motion.centre - motion.shift
    J = -np.stack([n[:, 1] * arm[:, 0] - n[:, 0] * arm[:, 1], n[:, 0], n[:, 1]], axis=1)
    return ((motion.inverse(Z) - Y) * N).sum(axis=1), J


def _step(motion: PlanarMotion, Z: Array, Y: Array, N: Array) -> Array:
    """The damped Gauss-Newton step (ψ, x, y) at a motion."""
    d, J = offsets(motion, Z, Y, N)
    w = np.minimum(1.0, HUBER / np.maximum(np.abs(d), HUBER))
    H, radius = J.T @ (w[:, None] * J), float(np.abs(Z - motion.centre - motion.shift)[:, :2].max())
    H += DAMPING * np.trace(H[1:, 1:]) / 2 * np.diag([radius**2, 1.0, 1.0])
    return np.asarray(np.linalg.solve(H, -J.T @ (w * d)))
