"""The interface of a solver: one method, from a nonlinear program and a start to an answer.

min f(x, p)   subject to   g_low ≤ g(x, p) ≤ g_high,  x_low ≤ x ≤ x_high
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import nan
from typing import Any

import numpy as np

from sgnlp.base import settings
from sgnlp.base.arrays import Array
from sgnlp.base.brief import brief
from sgnlp.base.checked import Typed, require, require_fields
from sgnlp.base.errors import InputError, SolverError
from sgnlp.program.oracle import Functions

Bounds = tuple[Array, Array]
Multipliers = tuple[Array, Array]
"""(λ_x (nx), λ_g (ng)): positive ones push down from upper bounds."""
PLAIN = (str, int, float, bool, type(None))
"""Values that JSON can hold."""


class Refusal(SolverError):
    """A solver cannot take a program; the message says why."""


@dataclass(frozen=True, eq=False)
class NlpInstance(Typed):
    """A nonlinear program in scaled variables and rows, with its numbers and stopping criteria.

    min f(x, p)   subject to   g_low ≤ g(x, p) ≤ g_high,  x_low ≤ x ≤ x_high

    with nx variables and ng rows. `functions` are CasADi functions of (x, p); the methods evaluate them in NumPy at
    this `p`.
    """

    called = "a program"
    __repr__ = brief

    functions: Functions
    p: Array
    x_bounds: Bounds
    g_bounds: Bounds
    tolerance: float  # as the solver itself defines it
    iterations: int  # at most
    rates: Array  # (nx,), step sizes of first-order methods; NaN for variables without one
    multipliers: Multipliers | None = None  # initial multipliers, for solvers that use them

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
    """The end x (nx,) of a solver; everything else is optional. Only x is trusted; residuals are recomputed from it.

    `multipliers` (λ_x (nx,), λ_g (ng,)) are estimated if there are none. `calls` counts f, grad, g, jac and hess, and
    `seconds` is the time of these calls. `lowest` is the lowest f on the way, whether or not rows are satisfied, for a
    method that does not end at its last point. `way` has one number for each iterate: `obj` (f), `inf_pr`, `inf_du` and
    `mu`.
    """

    __repr__ = brief

    x: Array  # (nx,)
    status: str = ""
    iterations: int = 0
    multipliers: Multipliers | None = None
    calls: dict[str, int] | None = None
    seconds: float = nan
    lowest: float = nan
    way: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Also that what is told beside x and multipliers is of its kind; these two are checked where they fit."""
        require_fields(self, "an answer", ("status", "iterations", "calls", "seconds", "lowest", "way"))


@dataclass(frozen=True)
class Solver:
    """A solver; its options are its fields. Your own is a subclass with a `solve`."""

    tolerance: float | None = None
    """convergence tolerance; that of the settings if None"""

    def __post_init__(self) -> None:
        """Also that the tolerance is one."""
        require("the tolerance of a solver", self.tolerance, float | None)
        if self.tolerance is not None and not self.tolerance > 0:
            raise InputError(f"the tolerance of a solver must be positive, not {self.tolerance:g}")

    @property
    def name(self) -> str:
        """Name in tables and results: the name of its class in lower case, unless the class has a `name`."""
        return type(self).__name__.lower()

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Solve a program from x (nx,), a point within its bounds. Raises `Refusal` if it cannot."""
        raise NotImplementedError

    def prepare(self, nlp: NlpInstance) -> None:
        """Build what takes long and does not depend on the numbers; `solve` does so if this was not called."""

    def settled(self, chosen: settings.Solver) -> "Solver":
        """The solver with the options that it leaves open taken from the settings."""
        return self

    @property
    def warm(self) -> "Solver":
        """The solver for a warm start near the solution; itself if that makes no difference."""
        return self

    def backends(self) -> dict[str, str]:
        """What of it runs in compiled code on some machines only, and whether it does here, for the same record."""
        return {}

    def told(self) -> dict[str, Any]:
        """Its name and its options in plain values, for the record of a result."""
        options = {f.name: getattr(self, f.name) for f in fields(self) if f.repr and f.name != "name"}
        return {"name": self.name} | {name: v if isinstance(v, PLAIN) else str(v) for name, v in options.items()}


@dataclass(frozen=True)
class Entry:
    """A row of the table of solvers.

    `kind` is the algorithm's family, `derivatives` the highest order that it uses. `known` is the reason why a
    comparison leaves the solver out unless it is named.
    """

    solver: Solver
    kind: str
    derivatives: int
    summary: str
    known: str = ""
