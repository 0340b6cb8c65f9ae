"""The energy: one small class a term, its docstring the equation, its body the same equation."""

from sgnlp.program.terms.barrier import Stability
from sgnlp.program.terms.closure import Closure, Deviation
from sgnlp.program.terms.collision import Collision
from sgnlp.program.terms.contact import Distance, Targets, Uncertainty
from sgnlp.program.terms.regularisation import Gains, Joints, Motion, Pose
from sgnlp.program.terms.spring import Force, Spring
from sgnlp.program.terms.term import Term

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
