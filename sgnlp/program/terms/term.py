"""What an energy term is."""

from typing import Any, ClassVar

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops


class Term:
    """An unweighted term of the energy, written once for CasADi and NumPy.

    `name` is its column in every table, `weight` the field of `settings.Weights` that multiplies it. A term that a
    constraint replaces in the constrained formulation says so, and so does one that belongs to a single metric.
    """

    name: ClassVar[str]
    weight: ClassVar[str]
    constrained_elsewhere: ClassVar[bool] = False
    metric: ClassVar[str] = ""

    def value(self, g: Grasp, op: Ops) -> Any:
        """The term at a grasp."""
        raise NotImplementedError
