"""The equilibrium of a compliant grasp: a k-weighted Wahba problem, solved in closed form.

    argmin_{R, t}  Σ ½ k_i |R p_i + t - o_i|² + M g e_zᵀ(R c_g + t)

t = ō - R p̄ - (M g / Σk) e_z with the k-weighted centroids; what remains is max tr(R Bᵀ) over rotations with
B = Σ k_i (o_i - ō)(p_i - p̄)ᵀ - M g e_z (c_g - p̄)ᵀ. With the singular values s1 ≥ s2 ≥ s3 of B, s3' = s3 sign(det B):

    λ = s1 + s2 + s3' is the largest root of ((λ² - |B|²)² - 8 λ det B - 4 |adj B|²)
    κ = (λ² - |B|²)/2,   ζ = κ λ - det B = (s1 + s2)(s2 + s3')(s1 + s3')
    R = ((κ + |B|²) B + λ adj(B)ᵀ - B Bᵀ B)/ζ                          (FOAM, Markley 1993)

The four roots are real, so Laguerre's iteration from the upper bound √3 |B| falls to the largest one monotonically
and at third order; it has no branches, and every derivative of R is exact wherever R is differentiable: ζ > 0.
The rotational stiffness of the equilibrium has the eigenvalues s2 + s3', s1 + s3', s1 + s2; ρ = ζ/λ² [N m].
"""

import casadi as ca

GRAVITY = 9.81
"""Standard acceleration of free fall [m/s²], rounded."""
LAGUERRE_STEPS = 8
"""Number of iterations after which λ is as exact as double precision allows (R to 1e-9 at (s2 + s3')/s1 = 1e-2, to 2e-6
at 1e-3)."""
TINY = 1e-12
"""Guards the divisions by |B| [N m] and by numbers that are 0 where R is not differentiable, so that there is no
NaN."""


def adjugate(B: ca.SX) -> ca.SX:
    """adj B (3, 3), so that B adj B = det B I."""
    columns = [B[:, i] for i in range(3)]
    rows = [ca.cross(columns[(i + 1) % 3], columns[(i + 2) % 3]).T for i in range(3)]
    return ca.vertcat(*rows)


def largest_root(b: ca.SX, det: ca.SX, c: ca.SX) -> ca.SX:
    """Largest root λ of (λ² - b)² - 8 λ det - 4 c for a profile of norm 1: b = |B|² = 1, c = |adj B|²."""
    n, x = 4, ca.sqrt(3 * b)
    for _ in range(LAGUERRE_STEPS):
        u = x**2 - b
        f, f1, f2 = u**2 - 8 * x * det - 4 * c, 4 * x * u - 8 * det, 12 * x**2 - 4 * b
        root = ca.sqrt(ca.fmax((n - 1) ** 2 * f1**2 - n * (n - 1) * f * f2, 0) + TINY**2)
        x = x - n * f / (f1 + root)
    return x


def root_guess(B: ca.SX) -> ca.SX:
    """λ/|B| to machine precision, the `lam` of `rotation`."""
    A = B / _norm(B)
    adj = adjugate(A)
    return largest_root(ca.sumsqr(A), ca.dot(A[:, 0], adj[0, :].T), ca.sumsqr(adj))


def rotation(B: ca.SX, lam: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Optimal rotation R (3, 3) of the attitude profile B (3, 3) [N m] and its stiffness ρ [N m].

    `lam` is `root_guess(B)`. It may be a constant: two Newton steps from the root do not change its value, but give its
    first and second derivatives, so the iteration need not be differentiated.
    """
    norm = _norm(B)
    A = B / norm
    adj, b = adjugate(A), ca.sumsqr(A)
    det, c = ca.dot(A[:, 0], adj[0, :].T), ca.sumsqr(adj)
    for _ in range(2):
        u = lam**2 - b
        lam = lam - (u**2 - 8 * lam * det - 4 * c) / ca.fmax(4 * lam * u - 8 * det, TINY)
    kappa = (lam**2 - b) / 2
    zeta = ca.fmax(kappa * lam - det, TINY)
    R = ((kappa + b) * A + lam * adj.T - A @ A.T @ A) / zeta
    return R, norm * zeta / ca.fmax(lam**2, TINY)


def turned(w: ca.SX) -> ca.SX:
    """The rotation (3, 3) of a Gibbs vector w (3), tan(θ/2) times the axis, by Cayley: I + 2 (W + W²)/(1 + |w|²)."""
    W = ca.skew(w)
    return ca.DM.eye(3) + 2 * (W + W @ W) / (1 + ca.sumsqr(w))


def gibbs_vector(R: ca.SX) -> ca.SX:
    """The Gibbs vector w (3) of a rotation (3, 3) by less than half a turn."""
    return ca.inv_skew(R - R.T) / ca.fmax(1 + ca.trace(R), TINY)


def stiffness(S: ca.SX) -> ca.SX:
    """ρ [N m] of S = R Bᵀ (3, 3) [N m] if R is the equilibrium of B: S is then symmetric, and λ = tr S.

    The eigenvalues of λ I - S are those of the rotational stiffness, so ζ is its determinant.
    """
    lam = ca.trace(S)
    return ca.det(lam * ca.DM.eye(3) - S) / ca.fmax(lam**2, TINY)


def _norm(B: ca.SX) -> ca.SX:
    return ca.sqrt(ca.sumsqr(B) + TINY**2)


def weighted_mean(k: ca.SX, P: ca.SX) -> ca.SX:
    """k-weighted centroid Σk p/Σk (1, 3) of the rows of P (m, 3)."""
    return (k.T @ P) / ca.sum1(k)


def profile(P: ca.SX, O: ca.SX, k: ca.SX, mass: ca.SX, com: ca.SX) -> ca.SX:
    """Attitude profile B (3, 3) [N m] of contacts P (m, 3), targets O (m, 3), gains k (m) and the load.

    `mass` [kg] and centre of mass `com` (3) [m] are those of the object; mass 0 leaves gravity out.
    """
    p, o = weighted_mean(k, P), weighted_mean(k, O)
    B = pulls(O, o, k).T @ (P - ca.repmat(p, P.shape[0], 1))
    return B - load(mass) @ (com.T - p)


def pulls(O: ca.SX, o: ca.SX, k: ca.SX) -> ca.SX:
    """k_i (o_i - ō) (m, 3) [N] of targets O (m, 3), their weighted mean o (1, 3) and gains k (m): their sum is 0."""
    return ca.repmat(k, 1, 3) * (O - ca.repmat(o, O.shape[0], 1))


def load(mass: ca.SX) -> ca.SX:
    """M g e_z (3,) [N]."""
    return ca.vertcat(0, 0, mass * GRAVITY)


def translation(R: ca.SX, p: ca.SX, o: ca.SX, k: ca.SX, mass: ca.SX) -> ca.SX:
    """t (3) [m] of the equilibrium with rotation R: ō - R p̄ - (M g/Σk) e_z, of the weighted means (1, 3)."""
    return o.T - R @ p.T - load(mass) / ca.sum1(k)


def printed_profile(P: ca.SX, O: ca.SX, k: ca.SX) -> ca.SX:
    """Profile B (3, 3) [N m] of the paper's Algorithm 1 as printed: plain centroids and squared gains.

    For comparison only: its rotation minimises the energy above only if all gains are equal. The factor m/Σk, which
    does not change the rotation, makes it equal to `profile` in that case.
    """
    m, w = P.shape[0], ca.repmat(k, 1, 3)
    p, o = ca.sum1(P) / m, ca.sum1(O) / m
    return (w * (O - ca.repmat(o, m, 1))).T @ (w * (P - ca.repmat(p, m, 1))) * m / ca.sum1(k)
