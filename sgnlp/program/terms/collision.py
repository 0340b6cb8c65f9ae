"""The collision term."""

from typing import Any

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.term import Term

SLOPE = 1 / 0.01**2
"""Slope of the hinge [1/m²]: that of the printed 1/d at d = r for the paper's spheres of r = 1 cm."""


class Collision(Term):
    """E_col = SLOPE Σ max(0, -clearance) over self pairs, spheres against the object, the table and obstacles.

    The printed 1/d jumps at d = r and rewards penetration; the hinge has its slope at contact and no pole.
    """

    name = setting = "col"
    about = "the hand clear of itself, the object and the table"
    constrained_elsewhere = True

    def value(self, g: Grasp, op: Ops) -> Any:
        """Penetrations in metres times the slope."""
        hand = (g.pair_clearances, g.object_clearances, g.table_clearances)
        clearances = [*hand, g.pad_clearances, g.pad_heights]
        if g.obstacle_clearances.shape[0]:
            clearances += [g.obstacle_clearances, g.obstacle_clearances_contact, g.obstacle_clearances_approach]
        if g.arm is not None:
            clearances += [g.arm.clearances, g.arm.pair_clearances]
        return SLOPE * sum(op.sum(op.hinge(-clearance)) for clearance in clearances)
