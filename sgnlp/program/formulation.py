"""What a formulation is: the program, or the programs in turn, that a solver is given of energy and constraints."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.base.settings import Settings, Solver
from sgnlp.hand.hand import Hand
from sgnlp.program import equilibrium
from sgnlp.program.attitude import attitude
from sgnlp.program.constraint import Constraint
from sgnlp.program.lifting import Lifting
from sgnlp.program.terms.term import Term
from sgnlp.program.variables import Variables

Array = NDArray[np.float64]
Bounds = tuple[Array, Array]


@dataclass(frozen=True)
class Phase:
    """A program to be solved, with at most so many iterations."""

    formulation: "Formulation"
    iterations: int


@dataclass(frozen=True)
class Formulation:
    """The energy that no constraint replaces, under all constraints. Others answer some of these questions otherwise.

    A formulation of your own is a subclass; its name is that of the class in lower case, unless it has another.
    `exact_feet` says where the gap of a pad is measured: at its foot p - r n(p), which is right to second order in r,
    or as d(p) - r, which reads 2 mm too little at r = 12 mm but is defined far off the surface, where tips begin.
    """

    name: ClassVar[str] = ""
    exact_feet: ClassVar[bool] = True
    plans_contact: ClassVar[bool] = True
    """Whether it has the joints at first contact as variables, where the settings ask for them."""
    plans_arm: ClassVar[bool] = True
    """Whether an arm that carries the hand is part of it."""
    source: ClassVar[str] = ""
    """Hash of the file that a formulation was loaded from; it goes into the key of compiled functions."""

    def __init_subclass__(cls) -> None:
        """Name the formulation after its class."""
        super().__init_subclass__()
        if "name" not in cls.__dict__:
            cls.name = cls.__name__.lower()

    def check(self, settings: Settings) -> None:
        """Raise `InputError` if the formulation cannot say what the settings ask for."""

    def phases(self, solver: Solver) -> tuple[Phase, ...]:
        """The programs to solve in turn, each from where the one before it ended."""
        return (Phase(self, solver.max_iterations),)

    def terms(self, terms: Sequence[Term]) -> tuple[Term, ...]:
        """The terms of the objective, of all that the plan has."""
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
        """Where the scaled variables that it adds begin, for those that stand before them, x."""
        return np.zeros(0)

    def strict(self, nlp: Any, x: Array) -> Array:
        """x (nx,) without what it relaxes rows by."""
        return x

    @property
    def inner(self) -> "Formulation":
        """The formulation whose functions it takes and wraps: itself, if it has its own."""
        return self

    def wrap(self, nlp: Any) -> Any:
        """Its `Nlp`, made of that of `inner`."""
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
