"""When a search for grasps ends before all of its starts have: with enough of them, or at a deadline."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sgnlp.base.errors import InputError
from sgnlp.planning.pool import TOO_LATE, Failure
from sgnlp.planning.solution import Solution

ENOUGH = "left out: enough grasps were found"
"""Why a start was not solved, or its solution not kept."""
LEFT = (ENOUGH, TOO_LATE)
"""Why a start gave no solution that can still be tried."""


@dataclass(frozen=True)
class Ending:
    """A search ends when the first starts, in their order, have given `first` feasible grasps, or at the deadline.

    Starts end in any order. That they count in their own makes the result the same for any number of processes.
    """

    first: int | None = None
    deadline: float | None = None  # [s] from the call

    def __post_init__(self) -> None:
        """Also that both can be met."""
        for name, value in (("first", self.first), ("deadline", self.deadline)):
            if value is not None and not value > 0:
                raise InputError(f"{name} must be positive, not {value:g}")

    def kept(self, results: Iterable[Solution | Failure], order: Sequence[int]) -> list[Solution | Failure] | None:
        """The results that count, of starts in this `order`, if there are enough feasible grasps; None if not yet."""
        ended, kept, found = {result.start: result for result in results}, list[Solution | Failure](), 0
        for start in order:
            if self.first is None or start not in ended:
                return None
            kept.append(ended[start])
            found += isinstance(kept[-1], Solution) and kept[-1].feasible
            if found == self.first:
                return kept + [Failure(index, ENOUGH) for index in order[len(kept) :]]
        return None
