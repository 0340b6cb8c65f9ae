"""The stiffness term, which the paper lacks: without it the energy is not well posed."""

from typing import Any

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.term import Term

UNIT = 0.01
"""Stiffness at which the term is 0 [N m]; a choice of units."""


class Stability(Term):
    """E_stab = -log(ρ/UNIT), ρ the rotational stiffness of the equilibrium."""

    name = setting = "stability"
    about = "a stiff equilibrium"

    def value(self, g: Grasp, op: Ops) -> Any:
        """Decreases as the equilibrium stiffens."""
        return -op.sum(op.log(g.stiffness / UNIT))
