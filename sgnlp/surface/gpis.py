"""The Gaussian-process implicit surface: posterior of a signed function, 0 on the surface, negative inside.

    μ(x) = m + k(x)ᵀα,   α = K⁻¹(y - m),   σ²(x) = s² (k(0) - |L⁻¹k(x)|²),   K = k(X, X) + diag(ε²) = L Lᵀ

With the kernel s²k and the noise sε instead, the mean is the same: s calibrates only the deviation. The mean is *not* a
distance. As lengths use d = μ/|∇μ| and σ_d = σ/|∇μ|, which are exact to first order.
This is the posterior in NumPy; `symbolic.py` has it in CasADi, `gpis_jets.c` in C.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from sgnlp.base.arrays import Array
from sgnlp.base.brief import brief
from sgnlp.base.errors import InputError
from sgnlp.surface.kernel import MIN_RADIUS, Kernel, check
from sgnlp.surface.training import TrainingSet

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""The order of the 6 second derivatives in a jet."""
TRIPLES = tuple((a, b, c) for a in range(3) for b in range(a, 3) for c in range(b, 3))
"""The order of the 10 third derivatives in a jet."""
MEAN_JET = 1 + 3 + len(PAIRS) + len(TRIPLES)
VARIANCE_JET = 1 + 3 + len(PAIRS)
MIN_SLOPE = 1e-3
"""Rounds |∇μ| at 0 where it is a divisor: the slope is 0.2 to 0.5 at measured surfaces, and 0 at a ridge inside."""


@dataclass(frozen=True)
class Gpis:
    """A fitted surface in the world frame: posterior of a signed function, 0 on the surface, negative inside.

    μ(x) = m + k(x)ᵀα,   α = K⁻¹(y - m),   σ²(x) = s² (k(0) - |L⁻¹k(x)|²),   K = k(X, X) + diag(ε²) = L Lᵀ

    (Rasmussen & Williams 2006, eq. 2.25-2.26; Williams & Fitzgibbon 2007.) Arrays are read-only.

    Attributes:
        kernel: the covariance, with its R and σ0.
        prior: prior mean m [m].
        X: training points (N, 3) [m].
        alpha: weights K⁻¹(y - m) (N,).
        chol_inverse: s L⁻¹ (N, N), lower triangular.
        centre: centre (3,) [m] of the ball in which every query is nearer than R to every training point.
        radius: radius of that ball [m].
        deviation_scale: s, the factor on the deviation of the process.
        free_space: whether it was fitted to free space, too.
    """

    __repr__ = brief

    kernel: Kernel
    prior: float
    X: Array
    alpha: Array
    chol_inverse: Array
    centre: Array
    radius: float
    deviation_scale: float = 1.0
    free_space: bool = False

    def _radial(self, Z: Array) -> tuple[Array, tuple[Array, Array, Array, Array]]:
        """Differences z - x_n (3, Q, N) and the kernel's (k, Dk, D²k, D³k), each (Q, N)."""
        d = np.ascontiguousarray(Z.T)[:, :, None] - np.ascontiguousarray(self.X.T)[:, None, :]
        r = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        return d, self.kernel.radial(np.maximum(r, MIN_RADIUS))

    @property
    def prior_variance(self) -> float:
        """s² k(0) [m²]."""
        return self.deviation_scale**2 * float(self.kernel.radial(np.array(MIN_RADIUS))[0])

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
        """σ (Q,) [m]; variances below zero, by rounding, are set to zero. Outside the ball it is at most the prior
        σ."""
        w = self.chol_inverse @ self._radial(Z)[1][0].T
        return np.sqrt(np.maximum(self.prior_variance - (w * w).sum(axis=0), 0.0))

    def distance(self, Z: Array) -> Array:
        """Metric signed distance μ/|∇μ| (Q,) [m], positive outside."""
        d, (k, k1, _, _) = self._radial(Z)
        gradient = ((k1 * self.alpha) * d).sum(axis=2).T
        return (self.prior + k @ self.alpha) / _slope(gradient)

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

        With w = s L⁻¹k and β = s L⁻ᵀw: ∂_a σ² = -2 s wᵀL⁻¹∂_a k, ∂_ab σ² = -2 s² (L⁻¹∂_a k)ᵀL⁻¹∂_b k - 2 βᵀ∂_ab k.
        """
        d, (k, k1, k2, _) = self._radial(Z)
        Q = len(Z)
        W = self.chol_inverse @ np.concatenate([k, k1 * d[0], k1 * d[1], k1 * d[2]]).T  # (N, 4Q)
        w, wd = W[:, :Q], [W[:, (a + 1) * Q : (a + 2) * Q] for a in range(3)]
        beta = (self.chol_inverse.T @ w).T  # (Q, N)
        J = np.empty((Q, VARIANCE_JET))
        J[:, 0] = self.prior_variance - np.einsum("nq,nq->q", w, w)
        for a in range(3):
            J[:, 1 + a] = -2 * np.einsum("nq,nq->q", w, wd[a])
        slope, curved = np.einsum("qn,qn->q", beta, k1), beta * k2
        for i, (a, b) in enumerate(PAIRS):
            bend = np.einsum("qn,qn->q", curved, d[a] * d[b]) + (a == b) * slope
            J[:, 4 + i] = -2 * (np.einsum("nq,nq->q", wd[a], wd[b]) + bend)
        return J

    def observed(self, X: Array, y: Array, noise: float) -> "Gpis":
        """The surface with more observations y (q,) [m] at X (q, 3) [m] with noise deviation [m].

        The factor of K grows by q rows: L' = [[L, 0], [Bᵀ L⁻ᵀ, C]], C Cᵀ = k(X, X) + ε² - |L⁻¹B|², B = k(X_before, X).
        It equals a new fit to all observations, in N² q instead of N³ operations.
        """
        s, n, q = self.deviation_scale, len(self.X), len(X)
        inverse = self.chol_inverse / s
        apart = np.linalg.norm(X[:, None] - X[None], axis=2)
        W = inverse @ self._radial(X)[1][0].T  # L⁻¹B (n, q)
        C = cholesky(self.kernel.radial(np.maximum(apart, MIN_RADIUS))[0] + noise**2 * np.eye(q) - W.T @ W, lower=True)
        grown = np.zeros((n + q, n + q))
        grown[:n, :n], grown[n:, n:] = inverse, solve_triangular(C, np.eye(q), lower=True)
        grown[n:, :n] = -grown[n:, n:] @ W.T @ inverse
        z = solve_triangular(inverse.T, self.alpha, lower=False)  # L⁻¹(y - m), of α = L⁻ᵀz
        z = np.concatenate([z, grown[n:, n:] @ (y - self.prior - W.T @ z)])
        points = np.vstack([self.X, X])
        radius = self.kernel.support_radius - float(np.linalg.norm(points - self.centre, axis=1).max())
        points, alpha, chol_inverse = frozen(points, grown.T @ z, s * grown)
        return replace(self, X=points, alpha=alpha, chol_inverse=chol_inverse, radius=radius)


def _slope(gradient: Array) -> Array:
    """√(|∇μ|² + MIN_SLOPE²) (Q,) of gradients (Q, 3)."""
    return np.sqrt((gradient**2).sum(axis=1) + MIN_SLOPE**2)


def fit(training: TrainingSet) -> Gpis:
    """Condition the process on a training set: one Cholesky factorisation.

    Raises:
        InputError: the kernel is invalid, or the covariance of the training set is not positive definite.
    """
    X, y, kernel, scale = training.X, training.y, training.kernel, training.deviation_scale
    check(kernel)
    r = np.linalg.norm(X[:, None] - X[None], axis=2)
    try:
        L = cholesky(kernel.radial(np.maximum(r, MIN_RADIUS))[0] + np.diag(training.noise**2), lower=True)
    except LinAlgError as error:
        raise InputError(
            f"no surface can be fitted with kernel '{kernel.name}': its covariance is not positive definite ({error})"
        ) from error
    chol_inverse = solve_triangular(L, np.eye(len(X)), lower=True)
    alpha = chol_inverse.T @ (chol_inverse @ (y - training.prior))
    centre = training.centre
    radius = kernel.support_radius - float(np.linalg.norm(X - centre, axis=1).max())
    X, alpha, chol_inverse, centre = frozen(X, alpha, scale * chol_inverse, centre)
    return Gpis(kernel, training.prior, X, alpha, chol_inverse, centre, radius, scale, training.free_space)


def frozen(*arrays: Array) -> list[Array]:
    """The arrays, contiguous and read-only."""
    contiguous = [np.ascontiguousarray(a) for a in arrays]
    for a in contiguous:
        a.flags.writeable = False
    return contiguous
