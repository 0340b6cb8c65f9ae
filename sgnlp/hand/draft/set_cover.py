"""The cheapest sets that together cover all points: a nearly optimal solution of the set cover's integer program.

First the program is reduced by removing redundant rows and columns. Then a local search finds cheaper covers: it
removes a set, and while points are uncovered, it exchanges one set for another that covers an uncovered point. Points
that are uncovered often get more weight, and the last exchange is kept for a step (Gao, Weise and Li, 2015). The search
begins with the greedy cover and needs few steps. An integer programming solver takes a thousand times as long for the
same number, because a shape like a box has many equal solutions.
"""

import numpy as np

from sgnlp.base.arrays import Array, BoolArray, IntArray

STEPS = 200
"""Steps of the search. With five times as many, the package's hands get the same numbers of spheres."""
CHEAPER = 1e-9
"""Least decrease of the total cost that counts, above rounding."""


def cheapest(covered: BoolArray, costs: Array) -> IntArray:
    """The columns of `covered` (K, C) that cover all K rows together, at a small sum of their `costs` (C,).

    Each row must be covered by at least one column.
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

    A row is redundant if all columns of another row cover it too. A column is redundant if another column costs no more
    and covers all its rows. Each removal can make others redundant, so both alternate.
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
    """Which of the sets (N, M) contain no other set that costs no more; of equal ones, the first."""
    members = sets.astype(np.float32)  # products of floats count exactly, and fast
    worse = (members @ members.T >= members.sum(axis=1)) & (costs[:, None] >= costs)  # [i, j]: set i contains set j
    order = np.arange(len(sets))
    return ~(worse & (~worse.T | (order[:, None] > order))).any(axis=1)


class _Choice:
    """A selection of the sets, and how often each point is in them."""

    def __init__(self, rows: BoolArray, costs: Array) -> None:
        """Begin with the greedy cover: one after the other, the set with most uncovered points for its cost."""
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
        """Whether each point (K,) is uncovered."""
        return self._count == 0

    @property
    def cost(self) -> float:
        """Total cost of the selection."""
        return float(self._costs[self._inside].sum())

    @property
    def chosen(self) -> IntArray:
        """The sets."""
        return np.flatnonzero(self._inside)

    def drop(self, step: int) -> None:
        """Remove the set with the least newly uncovered weight for its cost; of equal ones, the oldest."""
        loss = self._sets[self.chosen] @ (self._weights * (self._count == 1)) / self._costs[self.chosen]
        self._move(int(self.chosen[np.lexsort((self._moved[self.chosen], loss))[0]]), step)

    def exchange(self, step: int, bound: float, rng: np.random.Generator) -> bool:
        """Remove one more set, and add sets that cover uncovered points while the total cost is below `bound`."""
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
        """Add a set to the selection or remove it."""
        self._inside[one] = not self._inside[one]
        self._count += self._sets[one] if self._inside[one] else -self._sets[one]
        self._moved[one] = step
