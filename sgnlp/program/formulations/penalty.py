"""The whole energy, with only the constraints that keep the equilibrium and the surface model defined."""

from collections.abc import Sequence
from dataclasses import dataclass

from sgnlp.program.constraint import Constraint
from sgnlp.program.formulation import Formulation
from sgnlp.program.terms.term import Term


@dataclass(frozen=True)
class Penalty(Formulation):
    """min E: contact, force and clearances are terms of the energy."""

    exact_feet = False
    plans_contact = False

    def terms(self, terms: Sequence[Term]) -> tuple[Term, ...]:
        """All of them."""
        return tuple(terms)

    def constraints(self, constraints: Sequence[Constraint]) -> tuple[Constraint, ...]:
        """Those that always hold."""
        return tuple(c for c in constraints if c.always)


@dataclass(frozen=True)
class FreeWrist(Penalty):
    """The penalty formulation of the hand alone, also for a hand on an arm: a first phase, before the arm is added."""

    name = Penalty.name
    plans_arm = False
