"""Terms of force closure, the metric of the paper's bilevel baseline (its appendix) instead of E_sp.

There an inner problem with second-order cones finds contact forces F, and an outer one finds the hand:

    E_fc = min_F |Σ F_i| + |Σ (p_i - c_g) × F_i|   subject to   F_i·n_i ≤ -|F_i|/√(1 + μ²),  F_i·n_i ≤ -F_min
    o_i = p_i + F_i/k_i,     f_FK(q, i) = a_i = p_i/c - o_i (1 - c)/c,     k_i given: fixed, or α/σ_d(p_i)

As one program it needs no variable for F. For k_i > 0 and 0 < c ≤ 1 the map (a_i, o_i) → (p_i, F_i), with
p_i = o_i + c (a_i - o_i) and F_i = k_i (o_i - p_i), is a bijection (its inverse stands above), so that the wrist, the
joints and the targets of the compliant grasp are the contacts and the contact forces in other coordinates, and
f_FK(q) = a is the paper's inverse kinematics. The inner minimum joins the outer one, min_q (w min_F E + rest) =
min_{q,F} (w E + rest), if the rest does not depend on F. It depends on F only through the pregrasp: among forces that
balance equally well, the joint program takes those whose pregrasp is clear and relaxed. If the balance is a constraint,
it is exactly the bilevel problem, with ties broken in favour of the outer level.

The cones and F_min are constraints of every formulation. The torque is about the centre of mass c_g, not the origin, so
that an unbalanced grasp does not depend on the world frame; with a mass the net force includes the weight.
"""

from typing import Any

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.term import Term


class Closure(Term):
    """E_fc = |Σ F_i| + |Σ (p_i - c_g) × F_i| in N and N m, as printed."""

    name = setting = "closure"
    about = "forces that balance at first contact"
    constrained_elsewhere = True

    def value(self, g: Grasp, op: Ops) -> Any:
        """The unbalanced force and torque on the object at first contact."""
        return op.sum(op.residual(g.wrench))


class Deviation(Term):
    """E_uncer = Σ σ_d(p_i): contacts where the surface is known."""

    name = "deviation"
    about = "contacts where the surface is known well"
    setting = "uncer"

    def value(self, g: Grasp, op: Ops) -> Any:
        """In metres."""
        return op.sum(g.contact_deviations)
