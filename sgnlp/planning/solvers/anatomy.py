"""The anatomy of a solver: a task is prepared once and solved from as many starts as one likes.

    min f(x, p)   subject to   g_low ≤ g(x, p) ≤ g_high,  x_low ≤ x ≤ x_high

A solver is a file beside this one that has `METHODS`; it is found when the package is asked for its methods.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.errors import SolverError
from sgnlp.program.oracle import Functions

Array = NDArray[np.float64]
Bounds = tuple[Array, Array]
Multipliers = tuple[Array, Array]
"""(λ_x (nx), λ_g (ng)): positive ones push down from upper bounds."""


@dataclass(frozen=True, eq=False)
class Task:
    """A nonlinear program with numbers, and when to stop.

    `tolerance` is what the solver is asked for, in its own sense; `rates` (nx) are the steps of first-order methods.
    """

    functions: Functions
    p: Array
    x_bounds: Bounds
    g_bounds: Bounds
    tolerance: float
    iterations: int
    rates: Array  # (nx,)


@dataclass(frozen=True, eq=False)
class Answer:
    """Where a solver ended. `status` is its word, never believed; multipliers are None if it has none.

    `calls` of f, grad, g, jac and hess are the solver's own counts, None where those taken at the functions are as
    good; `lowest` is the lowest f on the way, rows met or not, for a method that does not end at its last point.
    """

    x: Array  # (nx,)
    status: str
    iterations: int
    multipliers: Multipliers | None = None
    calls: dict[str, int] | None = None
    lowest: float = nan


Solve = Callable[[Array], Answer]
"""From a start x (nx)."""


class Refusal(SolverError):
    """A solver cannot take a task; the message says why."""


@dataclass(frozen=True)
class Method:
    """A solver with its options.

    Attributes:
        name: what the command line and the rows call it.
        kind: the algorithm's family.
        derivatives: the order of the derivatives that it asks for.
        summary: what it is, in a line.
        prepare: builds the solver for a task; what it returns solves it from a start.
        known: why it is left out unless it is asked for by name: what it was seen to do on these problems.
    """

    name: str
    kind: str
    derivatives: int
    summary: str
    prepare: Callable[[Task], Solve]
    known: str = ""
