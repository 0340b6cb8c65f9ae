"""What a solver is: one method, from a nonlinear program with numbers and a start to an answer.

min f(x, p)   subject to   g_low ≤ g(x, p) ≤ g_high,  x_low ≤ x ≤ x_high
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.errors import SolverError
from sgnlp.program.oracle import Functions

Array = NDArray[np.float64]
Bounds = tuple[Array, Array]
Multipliers = tuple[Array, Array]
"""(λ_x (nx), λ_g (ng)): positive ones push down from upper bounds."""


class Refusal(SolverError):
    """A solver cannot take a program; the message says why."""


@dataclass(frozen=True, eq=False)
class NlpInstance:
    """A nonlinear program in scaled variables and rows, with numbers, and when to stop.

    `functions` are CasADi's, of (x, p); the methods are the same in NumPy at this `p`.
    """

    functions: Functions
    p: Array
    x_bounds: Bounds
    g_bounds: Bounds
    tolerance: float  # what the solver is asked for, in its own sense
    iterations: int  # at most
    rates: Array  # (nx,), steps of first-order methods; NaN for variables that have none

    def objective(self, x: Array) -> float:
        """f."""
        return float(self.functions.objective(x, self.p))

    def gradient(self, x: Array) -> Array:
        """∇f (nx,)."""
        return np.array(self.functions.gradient(x, self.p)[1]).ravel()

    def rows(self, x: Array) -> Array:
        """g (ng,)."""
        return np.array(self.functions.rows(x, self.p)).ravel()

    def jacobian(self, x: Array) -> Array:
        """J (ng, nx)."""
        return np.array(self.functions.jacobian(x, self.p)[1])

    def hessian(self, x: Array, lam_f: float, lam_g: Array) -> Array:
        """λ_f ∇²f + Σ λ_g ∇²g (nx, nx)."""
        U = np.array(self.functions.hessian(x, self.p, lam_f, lam_g))
        return U + np.triu(U, 1).T


@dataclass(frozen=True, eq=False)
class Answer:
    """Where a solver ended, all else optional. Nothing of it is believed but x.

    `multipliers` are estimated if it has none. `calls` are its own counts of f, grad, g, jac and hess. `lowest` is the
    lowest f on the way, rows met or not, for a method that does not end at its last point. `way` has a number for each
    point that it went through: `obj` (f), `inf_pr`, `inf_du` and `mu`.
    """

    x: Array  # (nx,)
    status: str = ""
    iterations: int = 0
    multipliers: Multipliers | None = None
    calls: dict[str, int] | None = None
    lowest: float = nan
    way: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Solver:
    """A solver with its options. One of your own is a subclass with a `solve`.

    `name`, `kind` (the algorithm's family), `derivatives` (the highest order that it asks for) and `summary` stand in
    tables; `known` says why a comparison leaves it out unless it is asked for by name.
    """

    tolerance: float | None = None
    """what it is asked for; that of the settings if None"""

    name: ClassVar[str] = ""
    kind: ClassVar[str] = ""
    derivatives: ClassVar[int] = 1
    summary: ClassVar[str] = ""
    known: ClassVar[str] = ""

    def __init_subclass__(cls) -> None:
        """Name the solver after its class."""
        super().__init_subclass__()
        if "name" not in cls.__dict__:
            cls.name = cls.__name__.lower()

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Solve a program from x (nx,), a point within its bounds. Raises `Refusal` if it cannot."""
        raise NotImplementedError

    def prepare(self, nlp: NlpInstance) -> None:
        """Build what takes long and does not depend on the numbers; `solve` does so where this was not called."""
