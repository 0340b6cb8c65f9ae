"""The energy: one small class a term, its docstring the equation, its body the same equation."""

from sgnlp.energies.barrier import Stability
from sgnlp.energies.closure import Closure, Deviation
from sgnlp.energies.collision import Collision
from sgnlp.energies.contact import Distance, Targets, Uncertainty
from sgnlp.energies.regularisation import Gains, Joints, Motion, Pose
from sgnlp.energies.spring import Force, Spring
from sgnlp.energies.term import Term

TERMS: tuple[Term, ...] = (
    Spring(),
    Distance(),
    Uncertainty(),
    Gains(),
    Targets(),
    Collision(),
    Joints(),
    Motion(),
    Force(),
    Pose(),
    Stability(),
    Closure(),
    Deviation(),
)
"""All terms, in the order of the paper's equation and of every table; those of force closure last."""

__all__ = ["TERMS", "Term"]
