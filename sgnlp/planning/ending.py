"""When a search for grasps ends: after the first round with a feasible one, with enough of them, or at a deadline."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self

from sgnlp.base.errors import InputError
from sgnlp.planning.pool import TOO_LATE, Failure
from sgnlp.planning.solution import Solution

ENOUGH = "left out: enough grasps were found"
"""Why a start was not solved, or its solution not kept."""
MOST = 10_000
"""Largest number of starts: so many take 12 minutes at 0.07 s each (`docs/pages/results/speed.md`), and their solutions
0.3 GB, at 27 KB each."""
ROUNDS = 5
"""Largest number of rounds. From one view, three tuning objects have no feasible start in the first round of seven: one
of them, cracker_2, has one in the fifth, the others have none in five (`results/rounds`)."""
NEAR = 0.1
"""A start comes near a feasible grasp if no row of its program is violated by more than this, in the row's scale: 1 mm,
0.1 N, or 0.1 of a friction margin. Chosen on the tuning half and on shapes that no hand can hold: where a later round
could help, the nearest start of the first was nearer than this; those of a card, a plate and a cube of 30 cm
were not."""
LEFT = (ENOUGH, TOO_LATE)
"""Why a start gave no solution that can still be tried."""


@dataclass(frozen=True)
class Ending:
    """A search ends when the first starts, in their order, have given `first` feasible grasps, or at the deadline.

    Starts are solved in rounds, as many in each as are asked for. Where none has ended feasible, but one near, the next
    round follows, up to `rounds` of them, and then, with `widen`, those with wider limits of the object's motion.
    Starts end in any order. That they count in their own makes the result the same for any number of processes.
    """

    first: int | None = None
    deadline: float | None = None  # [s] from the call
    rounds: int = ROUNDS
    widen: bool = True

    def __post_init__(self) -> None:
        """Also that all can be met."""
        for name, value in (("first", self.first), ("deadline", self.deadline), ("rounds", self.rounds)):
            if value is not None and not value > 0:
                raise InputError(f"{name} must be positive, not {value:g}")

    @property
    def whole(self) -> Self:
        """The same for all starts: neither `first` nor `deadline`."""
        return replace(self, first=None, deadline=None)

    def totals(self, count: int) -> list[int]:
        """The number of starts after each round of `count`, none of more than `MOST` in all."""
        return [*range(count, min(count * self.rounds, MOST) + 1, count)]

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


def hopeful(results: Iterable[Solution | Failure]) -> bool:
    """Whether more starts may give what these did not: none has a feasible solution, but one comes near (`NEAR`).

    Where all have failed, a solver that refuses the program or a limit that is too short will fail the others, too.
    """
    solutions = [result for result in results if isinstance(result, Solution)]
    return any(map(_near, solutions)) and not any_feasible(solutions)


def any_feasible(results: Iterable[Solution | Failure]) -> bool:
    """Whether one of these is a feasible solution."""
    return any(isinstance(result, Solution) and result.feasible for result in results)


def _near(solution: Solution) -> bool:
    return all(violation.size <= NEAR for violation in solution.violations)
