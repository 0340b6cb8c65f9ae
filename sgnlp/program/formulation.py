"""A formulation: the program, or the sequence of programs, that is made of energy and constraints for a solver."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.settings import Settings, Solver
from sgnlp.hand.hand import Hand
from sgnlp.program import equilibrium
from sgnlp.program.attitude import attitude
from sgnlp.program.constraint import Constraint
from sgnlp.program.lifting import Lifting
from sgnlp.program.terms.term import Term
from sgnlp.program.variables import Variables

Bounds = tuple[Array, Array]


@dataclass(frozen=True)
class Phase:
    """A program to solve, with its largest number of iterations."""

    formulation: "Formulation"
    iterations: int


@dataclass(frozen=True)
class Formulation:
    """How terms, constraints and variables become a program. The base class is the constrained formulation:

        min_x  Σ w_j E_j(x)   subject to   g_low ≤ g(x) ≤ g_high,   x_low ≤ x ≤ x_high

    with the terms E_j that no constraint replaces, and all constraints g. Your own formulation is a subclass that
    overrides some methods; its name is that of the class in lower case, unless the class has a `name`. With
    `exact_feet` the gap of a pad is d at its foot p - r n(p), which is right to second order in r. Otherwise it is
    d(p) - r, which is 2 mm too small at r = 12 mm, but defined far from the surface, where tips begin.
    """

    name: ClassVar[str] = ""
    exact_feet: ClassVar[bool] = True
    plans_contact: ClassVar[bool] = True
    """Whether it has the joints at first contact as variables, if the settings plan them."""
    plans_arm: ClassVar[bool] = True
    """Whether an arm that carries the hand is part of it."""
    source: ClassVar[str] = ""
    """Hash of the file that a formulation was loaded from; part of the key of compiled functions."""

    def __init_subclass__(cls) -> None:
        """Name the formulation after its class."""
        super().__init_subclass__()
        if "name" not in cls.__dict__:
            cls.name = cls.__name__.lower()

    def check(self, settings: Settings) -> None:
        """Raise `InputError` if the formulation does not support the settings."""

    def phases(self, solver: Solver) -> tuple[Phase, ...]:
        """The programs to solve in turn, each from where the one before it ended."""
        return (Phase(self, solver.max_iterations),)

    def terms(self, terms: Sequence[Term]) -> tuple[Term, ...]:
        """The terms of the objective, out of all terms of the plan."""
        return tuple(term for term in terms if not term.constrained_elsewhere)

    def constraints(self, constraints: Sequence[Constraint]) -> tuple[Constraint, ...]:
        """The rows: all constraints of the plan."""
        return tuple(constraints)

    def variables(self, hand: Hand) -> Variables:
        """The variables that it adds: none."""
        return Variables()

    def variable_bounds(self, nlp: Any, g_bounds: Bounds) -> Bounds:
        """Bounds of the scaled variables that it adds to an `Nlp` whose rows have these bounds (ng,)."""
        return np.zeros(0), np.zeros(0)

    def begin(self, oracle: Any, x: Array, p: Array, g_bounds: Bounds) -> Array:
        """Initial values of the scaled variables that it adds, for the other variables x."""
        return np.zeros(0)

    def strict(self, nlp: Any, x: Array) -> Array:
        """x (nx,) with the relaxation of rows (slacks) set to 0."""
        return x

    @property
    def inner(self) -> "Formulation":
        """The formulation whose functions it wraps; itself if it has its own."""
        return self

    def wrap(self, nlp: Any) -> Any:
        """Its `Nlp`, made from that of `inner`."""
        return nlp

    def tips(self, added: ca.SX, tips: ca.SX) -> ca.SX:
        """The tips (m, 3) [m]: those of the forward kinematics. `added` are the variables that it adds."""
        return tips

    def rotation(self, added: ca.SX, B: ca.SX, lifting: Lifting) -> tuple[ca.SX, ca.SX]:
        """R (3, 3) and ρ [N m] of the object's motion to the equilibrium with profile B, in closed form."""
        return attitude(B, lifting)

    def translation(self, added: ca.SX, R: ca.SX, par: SimpleNamespace, p: ca.SX, o: ca.SX, k: ca.SX) -> ca.SX:
        """t (3) [m] of that motion, for the weighted means (1, 3) of contacts and targets and the gains k (m)."""
        return equilibrium.translation(R, p, o, k, par.mass)
