"""The planner for warm starts, kept from one problem of a stream of clouds to the next.

Oracle and solver depend only on hand, structure and settings, and building them takes as long as some iterations. So
each thread keeps its last planner, and replaces its surface by that of the next problem. The bits are the same.
"""

import threading

from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.solvers import settled
from sgnlp.planning.solvers.solver import Solver

_kept = threading.local()


def resuming(problem: Problem, solver: Solver) -> Planner:
    """A planner with only the last program of a problem, valid until this thread asks for the next one."""
    known: Planner | None = getattr(_kept, "planner", None)
    if known is not None and _suits(known, problem, solver):
        known.take(problem)
        return known
    _kept.planner = Planner(problem, solver, phases=problem.phases[-1:])
    return _kept.planner


def _suits(known: Planner, problem: Problem, solver: Solver) -> bool:
    """Whether a planner differs from that of a problem only in the problem's numbers."""
    before, phase, (stage,) = known.problem, problem.phases[-1], known.stages
    return (
        before.hand is problem.hand
        and before.settings == problem.settings
        and known.solver == settled(solver, problem.settings.solver)
        and stage.iterations == phase.iterations
        and stage.nlp.structure == problem.structure(phase.formulation)
    )
