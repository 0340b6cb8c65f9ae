"""The penalty formulation for a few iterations, then the constrained one: it finds feasible grasps most often."""

from dataclasses import dataclass

from sgnlp.base.settings import Solver
from sgnlp.program.formulation import Phase
from sgnlp.program.formulations.constrained import Constrained
from sgnlp.program.formulations.penalty import FreeWrist


@dataclass(frozen=True)
class TwoPhase(Constrained):
    """The first phase brings the hand to the object, the second satisfies the constraints."""

    name = "two_phase"

    def phases(self, solver: Solver) -> tuple[Phase, ...]:
        """Penalty, then constrained."""
        return Phase(FreeWrist(), solver.penalty_iterations), Phase(Constrained(), solver.max_iterations)
