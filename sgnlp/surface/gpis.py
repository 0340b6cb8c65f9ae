"""The Gaussian-process implicit surface: posterior of a signed function, 0 on the surface, negative inside.

    μ(x) = m + k(x)ᵀα,   α = K⁻¹(y - m),   σ²(x) = k(0) - |L⁻¹k(x)|²,   K = k(X, X) + diag(s²) = L Lᵀ

The mean is *not* a distance. Where a length is meant, use d = μ/|∇μ| and σ_d = σ/|∇μ|, exact to first order.
`symbolic` writes the same posterior as CasADi functions whose training data are parameters.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from sgnlp.base.errors import InputError
from sgnlp.surface.kernels import KERNELS, MIN_RADIUS, kernel
from sgnlp.surface.training import TrainingSet

Array = NDArray[np.float64]

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""The order of the 6 second derivatives in a jet."""
TRIPLES = tuple((a, b, c) for a in range(3) for b in range(a, 3) for c in range(b, 3))
"""The order of the 10 third derivatives in a jet."""
MEAN_JET = 1 + 3 + len(PAIRS) + len(TRIPLES)
VARIANCE_JET = 1 + 3 + len(PAIRS)
MIN_SLOPE = 1e-3
"""Rounding of |∇μ| at 0 where it divides: the slope at measured surfaces is 0.2-0.5, at a ridge inside it is 0."""


@dataclass(frozen=True)
class Gpis:
    """A fitted surface. Arrays are read-only.

    Attributes:
        kernel: name of the kernel.
        reach: R, `reach_scale` times the largest distance between two training points [m].
        amplitude: prior deviation of the kernels that have one [m].
        prior: prior mean m [m].
        X: training points (N, 3) [m].
        alpha: weights K⁻¹(y - m) (N,).
        whitener: L⁻¹ (N, N), lower triangular.
        centre: of the ball in which every query is nearer than R to every training point (3,) [m].
        radius: of that ball [m].
    """

    kernel: str
    reach: float
    amplitude: float
    prior: float
    X: Array
    alpha: Array
    whitener: Array
    centre: Array
    radius: float

    def _radial(self, Z: Array) -> tuple[Array, tuple[Array, Array, Array, Array]]:
        """Differences z - x_n (3, Q, N) and the kernel's (k, Dk, D²k, D³k), each (Q, N)."""
        d = np.ascontiguousarray(Z.T)[:, :, None] - np.ascontiguousarray(self.X.T)[:, None, :]
        r = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        return d, kernel(self.kernel, self.reach, self.amplitude).radial(np.maximum(r, MIN_RADIUS))

    @property
    def prior_variance(self) -> float:
        """k(0) [m²]."""
        return float(kernel(self.kernel, self.reach, self.amplitude).radial(np.array(MIN_RADIUS))[0])

    def mean(self, Z: Array) -> Array:
        """μ (Q,) [m] at query points Z (Q, 3) [m]."""
        return self.prior + self._radial(Z)[1][0] @ self.alpha

    def gradient(self, Z: Array) -> Array:
        """∇μ (Q, 3) at Z (Q, 3)."""
        d, (_, k1, _, _) = self._radial(Z)
        return ((k1 * self.alpha) * d).sum(axis=2).T

    def normal(self, Z: Array) -> Array:
        """Outward unit normals ∇μ/|∇μ| (Q, 3)."""
        g = self.gradient(Z)
        return g / _slope(g)[:, None]

    def deviation(self, Z: Array) -> Array:
        """σ (Q,) [m]; rounding below zero is cut off, a query outside the ball has the prior deviation at most."""
        w = self.whitener @ self._radial(Z)[1][0].T
        return np.sqrt(np.maximum(self.prior_variance - (w * w).sum(axis=0), 0.0))

    def distance(self, Z: Array) -> Array:
        """Metric signed distance μ/|∇μ| (Q,) [m], positive outside."""
        return self.mean(Z) / _slope(self.gradient(Z))

    def distance_deviation(self, Z: Array) -> Array:
        """Metric deviation σ/|∇μ| (Q,) [m]."""
        return self.deviation(Z) / _slope(self.gradient(Z))

    def mean_jet(self, Z: Array) -> Array:
        """μ and its derivatives of order 1, 2 and 3 (Q, 20) at Z (Q, 3), orders of `PAIRS` and `TRIPLES`."""
        d, (k, k1, k2, k3) = self._radial(Z)
        J = np.empty((len(Z), MEAN_JET))
        J[:, 0] = self.prior + k @ self.alpha
        w1, w2, w3 = k1 * self.alpha, k2 * self.alpha, k3 * self.alpha
        slope, first = w1.sum(axis=1), [(w2 * d[a]).sum(axis=1) for a in range(3)]
        J[:, 1:4] = np.stack([(w1 * d[a]).sum(axis=1) for a in range(3)], axis=1)
        dd = {(a, b): d[a] * d[b] for a, b in PAIRS}
        for i, (a, b) in enumerate(PAIRS):
            J[:, 4 + i] = np.einsum("qn,qn->q", w2, dd[a, b]) + (a == b) * slope
        wd = [w3 * d[a] for a in range(3)]
        for i, (a, b, c) in enumerate(TRIPLES):
            mixed = (a == b) * first[c] + (a == c) * first[b] + (b == c) * first[a]
            J[:, 10 + i] = np.einsum("qn,qn->q", wd[a], dd[b, c]) + mixed
        return J

    def variance_jet(self, Z: Array) -> Array:
        """σ² and its derivatives of order 1 and 2 (Q, 10) at Z (Q, 3); σ² is not cut off at 0 here.

        With w = L⁻¹k and β = L⁻ᵀw: ∂_a σ² = -2 wᵀL⁻¹∂_a k, ∂_ab σ² = -2 (L⁻¹∂_a k)ᵀL⁻¹∂_b k - 2 βᵀ∂_ab k.
        """
        d, (k, k1, k2, _) = self._radial(Z)
        Q = len(Z)
        W = self.whitener @ np.concatenate([k, k1 * d[0], k1 * d[1], k1 * d[2]]).T  # (N, 4Q)
        w, wd = W[:, :Q], [W[:, (a + 1) * Q : (a + 2) * Q] for a in range(3)]
        beta = (self.whitener.T @ w).T  # (Q, N)
        J = np.empty((Q, VARIANCE_JET))
        J[:, 0] = self.prior_variance - np.einsum("nq,nq->q", w, w)
        for a in range(3):
            J[:, 1 + a] = -2 * np.einsum("nq,nq->q", w, wd[a])
        slope, curved = np.einsum("qn,qn->q", beta, k1), beta * k2
        for i, (a, b) in enumerate(PAIRS):
            bend = np.einsum("qn,qn->q", curved, d[a] * d[b]) + (a == b) * slope
            J[:, 4 + i] = -2 * (np.einsum("nq,nq->q", wd[a], wd[b]) + bend)
        return J


def _slope(gradient: Array) -> Array:
    """√(|∇μ|² + MIN_SLOPE²) (Q,) of gradients (Q, 3)."""
    return np.sqrt((gradient**2).sum(axis=1) + MIN_SLOPE**2)


def fit(training: TrainingSet, kernel_name: str = "thin_plate") -> Gpis:
    """Condition the process on a training set: one Cholesky factorisation.

    Raises:
        InputError: unknown kernel, or a training set whose covariance is not positive definite.
    """
    X, y, s = training.X, training.y, training.noise
    reach = training.reach
    k = kernel(kernel_name, reach, training.amplitude)
    r = np.linalg.norm(X[:, None] - X[None], axis=2)
    try:
        L = cholesky(k.radial(np.maximum(r, MIN_RADIUS))[0] + np.diag(s**2), lower=True)
    except LinAlgError as error:
        raise InputError(f"the surface cannot be fitted with kernel '{kernel_name}': {error}") from error
    whitener = solve_triangular(L, np.eye(len(X)), lower=True)
    alpha = whitener.T @ (whitener @ (y - training.prior))
    centre = training.centre
    radius = reach - float(np.linalg.norm(X - centre, axis=1).max())
    arrays = [np.ascontiguousarray(a) for a in (X, alpha, whitener, centre)]
    for a in arrays:
        a.flags.writeable = False
    X, alpha, whitener, centre = arrays
    return Gpis(kernel_name, reach, training.amplitude, training.prior, X, alpha, whitener, centre, radius)


def symbolic(kernel_name: str, N: int) -> ca.Function:
    """The posterior as a CasADi kernel sum of N training points, all of them parameters.

    Returns:
        Function of x (3), X (3, N), alpha (N), whitener (N, N), prior, reach, amplitude, giving mean μ, gradient
        ∇μ (3), normal (3), variance σ², distance μ/|∇μ| and distance_deviation σ/|∇μ|.
    """
    if kernel_name not in KERNELS:
        kernel(kernel_name, 1.0, 1.0)
    x, X = ca.MX.sym("x", 3), ca.MX.sym("X", 3, N)
    alpha, whitener = ca.MX.sym("alpha", N), ca.MX.sym("whitener", N, N)
    prior, reach, amplitude = ca.MX.sym("prior"), ca.MX.sym("reach"), ca.MX.sym("amplitude")
    d = ca.repmat(x, 1, N) - X
    r = ca.sqrt(ca.fmax(ca.sum1(d**2).T, MIN_RADIUS**2))
    model = kernel(kernel_name, reach, amplitude)
    k = model.radial(r)[0]
    mean = prior + ca.dot(k, alpha)
    gradient = ca.gradient(mean, x)
    variance = ca.fmax(model.radial(ca.MX(MIN_RADIUS))[0] - ca.sumsqr(whitener @ k), 0)
    slope = ca.sqrt(ca.sumsqr(gradient) + MIN_SLOPE**2)
    outputs = [mean, gradient, gradient / slope, variance, mean / slope, ca.sqrt(variance) / slope]
    names = ["mean", "gradient", "normal", "variance", "distance", "distance_deviation"]
    inputs = [x, X, alpha, whitener, prior, reach, amplitude]
    return ca.Function("gpis", inputs, outputs, ["x", "X", "alpha", "whitener", "prior", "reach", "amplitude"], names)


def parameters(gpis: Gpis) -> list[Array | float]:
    """The parameters of `symbolic` for a fitted surface, in its order after x."""
    return [gpis.X.T, gpis.alpha, gpis.whitener, gpis.prior, gpis.reach, gpis.amplitude]
