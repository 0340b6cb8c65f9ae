"""The rotation to the equilibrium with short exact derivatives.

With R from the closed form (`equilibrium`), S = R Bᵀ is symmetric: V(S) = 0, where V(A) is the axial vector of A - Aᵀ.
The same condition holds for E(θ) R (B + δB)ᵀ, where E is the exponential to second order. Two steps of Newton's method
with fixed K = tr S I - S give θ as a function of δB, exact to second order:

    θ₁ = -K⁻¹ V(R δBᵀ),     θ = θ₁ - K⁻¹ V(Θ₁ R δBᵀ + ½ Θ₁² S),     Θ₁ = [θ₁]×
"""

import casadi as ca

from sgnlp.program import equilibrium
from sgnlp.program.lifting import Lifting
from sgnlp.program.motion import swing


def attitude(B: ca.SX, lifting: Lifting) -> tuple[ca.SX, ca.SX]:
    """R (3, 3) of the equilibrium with profile B (3, 3) [N m], a lifted quantity, and its stiffness ρ [N m]."""
    root = lifting.constant("root", equilibrium.root_guess(B))
    R, rho = equilibrium.rotation(B, root)
    held = lifting.constant("rotation_held", R)
    S = held @ B.T
    inverse = lifting.constant("turning", _inverse((S + S.T) / 2))
    shape, change = lifting.constant("balance", S), lifting.displacement("change", held @ B.T)
    first = lifting.displacement("turn_first", -inverse @ _axial(change))
    W = ca.skew(first)
    turn = lifting.displacement("turn_eq", first - inverse @ _axial(W @ change + W @ W @ shape / 2), late=True)
    turned = lifting.lift("rotation", R, held + swing(turn, held))
    return turned, stiffness(turned, B, lifting, rho)


def stiffness(R: ca.SX, B: ca.SX, lifting: Lifting, value: ca.SX | None = None) -> ca.SX:
    """ρ [N m] of a rotation R (3, 3), the equilibrium of B (3, 3), both lifted.

    Its value is computed, or given as `value`, which must be the same.
    """
    S = R @ B.T
    S = lifting.lift("wahba", ca.vertcat(*ca.tril((S + S.T) / 2).nonzeros()))
    rho = equilibrium.stiffness(ca.tril2symm(ca.SX(ca.Sparsity.lower(3), S)))
    return lifting.lift("stiffness", rho if value is None else value, rho)


def _axial(A: ca.SX) -> ca.SX:
    """V(A) (3,)."""
    return ca.inv_skew(A - A.T)


def _inverse(S: ca.SX) -> ca.SX:
    """K⁻¹ (3, 3) by the adjugate; bounded where R is not differentiable."""
    scale = ca.sqrt(ca.sumsqr(S) + equilibrium.TINY**2)
    K = (ca.trace(S) * ca.DM.eye(3) - S) / scale
    adj = equilibrium.adjugate(K)
    return adj / (ca.fmax(ca.dot(K[:, 0], adj[0, :].T), equilibrium.TINY) * scale)
