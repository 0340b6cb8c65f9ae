"""The energy that no constraint replaces, under all constraints."""

from dataclasses import dataclass

from sgnlp.program.formulation import Formulation


@dataclass(frozen=True)
class Constrained(Formulation):
    """min E' subject to contact, friction cones, forces, clearances and all other constraints of the plan."""
