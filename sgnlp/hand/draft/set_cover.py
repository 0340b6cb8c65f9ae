"""The cheapest sets that cover all points together: of the cover's integer program a solution that is near the best.

The program is made small first, by what follows from the rest. Then a search goes from one cover to a cheaper one: it
takes a set out, and while points are bare, exchanges one set for another that covers a bare point. Points that are bare
often weigh more, and what was exchanged last stays for a step (Gao, Weise and Li, 2015). The search begins with the
greedy cover and needs a few of its steps; integer programs with as many equal solutions as a box has take a solver a
thousand times as long to come to the same number.
"""

import numpy as np

from sgnlp.base.arrays import Array, BoolArray, IntArray

STEPS = 200
"""Of the search. With five times as many, the hands that come with the package have as many spheres."""
CHEAPER = 1e-9
"""By how much the sum of the costs has to be less, so that rounding does not count."""


def cheapest(covered: BoolArray, costs: Array) -> IntArray:
    """The columns of `covered` (K, C) that cover all K rows together, at a small sum of their `costs` (C,).

    Each row is covered by a column at least.
    """
    rows, columns = _needed(covered, costs)
    choice = _Choice(rows, costs[columns])
    rng, best = np.random.default_rng(0), choice.chosen
    for step in range(STEPS if rows.sum() > len(rows) else 0):  # with one column for each row, all are needed
        while not choice.bare.any():
            best, bound = choice.chosen, choice.cost - CHEAPER
            choice.drop(step)
        if not choice.exchange(step, bound, rng):
            break
    return columns[best]


def _needed(rows: BoolArray, costs: Array) -> tuple[BoolArray, IntArray]:
    """The rows and columns without which the program has the same least cost: a tenth of them, often less.

    A row follows from another whose columns all cover it too. A column is useless beside another, no dearer, that
    covers all that it covers. What one leaves out makes more of the other kind useless, so both go on in turn.
    """
    columns = np.arange(len(costs))
    packed = np.unique(np.packbits(rows, axis=1), axis=0)
    rows = np.unpackbits(packed, axis=1, count=len(costs)).astype(bool)
    size = 0
    while size != (size := rows.size):
        rows = rows[_least(rows, np.zeros(len(rows)))]
        useful = _least(~rows.T, costs[columns])
        rows, columns = rows[:, useful], columns[useful]
    return rows, columns


def _least(sets: BoolArray, costs: Array) -> BoolArray:
    """Which of the sets (N, M) hold no other set that is no dearer; of equal ones, the first."""
    members = sets.astype(np.float32)  # products of these count exactly, and fast
    worse = (members @ members.T >= members.sum(axis=1)) & (costs[:, None] >= costs)  # [i, j]: set i holds set j
    order = np.arange(len(sets))
    return ~(worse & (~worse.T | (order[:, None] > order))).any(axis=1)


class _Choice:
    """Some of the sets, and how often each point is in them."""

    def __init__(self, rows: BoolArray, costs: Array) -> None:
        """The greedy cover: the set with most bare points for its cost, one after the other."""
        self._sets = rows.T.astype(float)
        self._costs = costs
        self._weights = np.ones(len(rows))
        self._inside = np.zeros(len(costs), bool)
        self._moved = np.full(len(costs), -1)
        self._count = np.zeros(len(rows))
        while self.bare.any():
            self._move(int((self._sets @ self.bare / costs).argmax()), -1)

    @property
    def bare(self) -> BoolArray:
        """Which points are in none (K,)."""
        return self._count == 0

    @property
    def cost(self) -> float:
        """Of all sets together."""
        return float(self._costs[self._inside].sum())

    @property
    def chosen(self) -> IntArray:
        """The sets."""
        return np.flatnonzero(self._inside)

    def drop(self, step: int) -> None:
        """Leave out the set without which the least becomes bare for its cost; of equal ones, that of longest ago."""
        loss = self._sets[self.chosen] @ (self._weights * (self._count == 1)) / self._costs[self.chosen]
        self._move(int(self.chosen[np.lexsort((self._moved[self.chosen], loss))[0]]), step)

    def exchange(self, step: int, bound: float, rng: np.random.Generator) -> bool:
        """Leave out one more, and take sets that cover bare points while all cost less than `bound`."""
        if not self._inside.any():
            return False
        self.drop(step)
        while self.bare.any():
            point = rng.choice(np.flatnonzero(self.bare))
            can = np.flatnonzero((self._sets[:, point] > 0) & (self._moved < step))
            can = can[self.cost + self._costs[can] < bound]
            if len(can):
                gain = self._sets[can] @ (self._weights * self.bare) / self._costs[can]
                self._move(int(can[np.lexsort((self._moved[can], -gain))[0]]), step)
            self._weights[self.bare] += 1
            if not len(can):
                break
        return True

    def _move(self, one: int, step: int) -> None:
        """A set into the choice or out of it."""
        self._inside[one] = not self._inside[one]
        self._count += self._sets[one] if self._inside[one] else -self._sets[one]
        self._moved[one] = step
