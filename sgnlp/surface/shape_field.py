"""The distance to the nearest of several shapes, exact or smooth with two derivatives.

    d(x) = min_j d_j(x)                                            exact, `Shape.distance`
    s(x) = -τ log Σ_j exp(-s_j(x)/τ)                               smooth
    s_j  = √(Σ_i p(q_i)² + w²) - p(-m) - r,   m = τ log Σ_i exp(q_i/τ),   p(q) = (q + √(q² + w²))/2

with q of `sgnlp.perception.shape`, whose |u| and √(u_x² + u_y²) become √(· + w²). p rounds max(q, 0), and m rounds
max_i q_i. So s differs from d by about a millimetre at the surface, and is smooth inside, at edges and between shapes.
"""

from collections.abc import Sequence

import numpy as np

from sgnlp.base.arrays import Array, IntArray
from sgnlp.perception.shape import FAR, Shape
from sgnlp.surface.gpis import PAIRS

WIDTH = 2e-3
"""w [m]. The smooth distance is 0.2 mm too large at 1 cm from a face, the least radius of the hand's spheres, and 1.2
mm at the surface. A quarter of this width takes twice the iterations."""
MIXING = 2e-3
"""τ [m]: the smooth minimum of two equal distances is 1.4 mm smaller, which is on the safe side."""
NEGLIGIBLE = 25.0
"""Shapes farther than the nearest by this many τ are left out of the sum: it would change by 3e-14 m."""
JET = 10
"""Value, 3 first and 6 second derivatives, in the order of `PAIRS`."""


class ShapeField:
    """The union of shapes; without shapes every distance is `FAR`."""

    def __init__(self, shapes: Sequence[Shape]):
        self.shapes = tuple(shapes)
        self._centre = np.array([s.centre for s in shapes]).reshape(-1, 3)
        self._rotation = np.array([s.rotation for s in shapes]).reshape(-1, 3, 3)
        self._half = np.array([s.half for s in shapes]).reshape(-1, 3)
        self._radius = np.array([s.radius for s in shapes])
        self._circular = np.array([s.circular for s in shapes], bool)

    def each(self, points: Array) -> Array:
        """The exact distance (K, J) [m] of points (K, 3) to every shape."""
        return np.array([s.distance(points) for s in self.shapes]).reshape(-1, len(points)).T

    def distance(self, points: Array) -> Array:
        """The exact signed distance (K,) [m] of points (K, 3) to the union."""
        return np.asarray(self.each(points).min(axis=1, initial=FAR))

    def nearest(self, points: Array) -> list[str]:
        """The name of the shape that is nearest to each of the points (K, 3)."""
        return [self.shapes[j].name for j in self.each(points).argmin(axis=1)] if self.shapes else []

    def jets(self, points: Array) -> Array:
        """Jets (K, 10) of the smooth distance at points (K, 3)."""
        result = np.zeros((len(points), JET))
        result[:, 0] = FAR
        if not self.shapes or not len(points):
            return result
        exact = self.each(points)
        point, shape = np.nonzero(exact <= exact.min(axis=1, keepdims=True) + NEGLIGIBLE * MIXING)
        value, gradient, hessian = self._smooth(points[point], shape)
        begin = np.flatnonzero(np.diff(point, prepend=-1))  # first pair of each point: every point has one
        least = np.minimum.reduceat(value, begin)
        weight = np.exp(-(value - least[point]) / MIXING)
        total = np.add.reduceat(weight, begin)
        share = weight / total[point]
        mean = np.add.reduceat(share[:, None] * gradient, begin)
        spread = gradient - mean[point]
        bend = share[:, None, None] * (hessian - spread[:, :, None] * spread[:, None, :] / MIXING)
        result[:, 0] = least - MIXING * np.log(total)
        result[:, 1:4] = mean
        bent = np.add.reduceat(bend, begin)
        result[:, 4:] = np.stack([bent[:, a, b] for a, b in PAIRS], axis=1)
        return result

    def _smooth(self, points: Array, shape: IntArray) -> tuple[Array, Array, Array]:
        """s_j (P,), ∇s_j (P, 3) and ∇²s_j (P, 3, 3) of pairs of a point (P, 3) and the number (P,) of a shape."""
        R, circular = self._rotation[shape], self._circular[shape]
        u = ((points - self._centre[shape])[:, None] @ R)[:, 0]
        q, first, curved = _coordinates(u, self._half[shape], circular)
        value, by_q, by_qq = _union(q)
        local = np.swapaxes(first, 1, 2) @ by_qq @ first
        local[:, _AXES, _AXES] += by_q * curved[0]
        local += by_q[:, :1, None] * curved[1]
        gradient = (R @ (by_q[:, None] @ first).reshape(-1, 3, 1))[:, :, 0]
        return value - self._radius[shape], gradient, R @ local @ np.swapaxes(R, 1, 2)


_AXES = np.arange(3)


def _union(q: Array) -> tuple[Array, Array, Array]:
    """s_j + r (P,) of the coordinates q (P, 3), and its derivatives by them (P, 3), (P, 3, 3)."""
    p, p1, p2 = _positive(q)
    root = np.sqrt((p * p).sum(axis=1) + WIDTH**2)
    outer = p / root[:, None] * p1  # ∂√/∂q
    top = q.max(axis=1, keepdims=True)
    share = np.exp((q - top) / MIXING)
    total = share.sum(axis=1)
    share /= total[:, None]
    depth, d1, d2 = _positive(-top[:, 0] - MIXING * np.log(total))
    both = -outer[:, :, None] * outer[:, None, :] / root[:, None, None]
    both -= (d1 / MIXING + d2)[:, None, None] * share[:, :, None] * share[:, None, :]
    both[:, _AXES, _AXES] += (p1 * p1 + p * p2) / root[:, None] + d1[:, None] / MIXING * share
    return root - depth, outer + d1[:, None] * share, both


def _coordinates(u: Array, half: Array, circular: Array) -> tuple[Array, Array, tuple[Array, Array]]:
    """q (P, 3), its first derivatives (P, 3, 3) by u (P, 3), and the second ones.

    The second ones are the diagonal (P, 3) of ∂²q_i/∂u_i², and ∂²q_0/∂u² (P, 3, 3) if q_0 is radial.
    """
    root = np.sqrt(u * u + WIDTH**2)
    first, diagonal, radial2 = np.zeros((len(u), 3, 3)), WIDTH**2 / root**3, np.zeros((len(u), 3, 3))
    first[:, _AXES, _AXES] = u / root
    q = root - half
    around = np.flatnonzero(circular)
    if len(around):
        flat = u[around] * [1.0, 1.0, 0.0]
        radial = np.sqrt((flat * flat).sum(axis=1) + WIDTH**2)
        slope = flat / radial[:, None]
        q[around, 0], q[around, 1] = radial - half[around, 0], -FAR
        first[around, :2], diagonal[around, :2] = 0.0, 0.0
        first[around, 0] = slope
        flatness = np.diag([1.0, 1.0, 0.0]) - slope[:, :, None] * slope[:, None, :]
        radial2[around] = flatness / radial[:, None, None]
    return q, first, (diagonal, radial2)


def _positive(q: Array) -> tuple[Array, Array, Array]:
    """p(q) = (q + √(q² + w²))/2 and its two derivatives, without cancellation below 0."""
    root = np.sqrt(q * q + WIDTH**2)
    value = np.where(q > 0, (q + root) / 2, WIDTH**2 / (2 * (root - np.minimum(q, 0))))
    return value, (1 + q / root) / 2, WIDTH**2 / (2 * root**3)
