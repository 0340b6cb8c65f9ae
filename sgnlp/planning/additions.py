"""The user's changes of a plan: added or removed terms and constraints, a kernel, a formulation, a solver."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, TypeVar

from sgnlp.base import settings as base
from sgnlp.base.checked import require, require_fields, typed
from sgnlp.base.errors import InputError, unknown
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.planning.solvers.solver import Solver
from sgnlp.program.around import ALONE, Around
from sgnlp.program.constraint import Constraint, is_own
from sgnlp.program.constraints import preset_constraints
from sgnlp.program.formulation import Formulation, Phase
from sgnlp.program.formulations import formulation
from sgnlp.program.structure import Structure, structure
from sgnlp.program.terms import Term, preset_terms
from sgnlp.surface.kernel import Kernel
from sgnlp.surface.kernels import KERNELS

Part = TypeVar("Part", Term, Constraint)
CHECKS = ("joint_limits", "arm_limits", "arm_effort", "way", "stable")
"""Checks of every plan that are not constraints (`sgnlp.planning.solution`)."""


@dataclass(frozen=True)
class Additions:
    """Additions to the built-in terms and constraints of a preset. One with a built-in one's name replaces it."""

    terms: tuple[Term, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    without_terms: tuple[str, ...] = ()
    without_constraints: tuple[str, ...] = ()
    formulation: Formulation | None = None  # else that of the settings
    solver: Solver | None = None  # else Ipopt as the settings have it
    kernel: type[Kernel] | None = None  # else that of the settings

    def __post_init__(self) -> None:
        """Refuse what is no term, constraint or kernel, or has a name that something built-in needs."""
        for term in self.terms:
            _check("term", term, Term)
            _check_method("term", term, Term, "value", "(self, g, op)")
            require(f"the weight of term '{term.name}'", term.weight, float)
            if not isfinite(term.weight):
                raise InputError(f"term '{term.name}' has the weight {term.weight}; valid: a finite number")
        for constraint in self.constraints:
            _check("constraint", constraint, Constraint)
            if constraint.name in CHECKS:
                raise InputError(
                    f"a check of every plan is called '{constraint.name}'; give the constraint another name"
                )
            if not (constraint.bounded or not is_own(constraint.value)):
                raise InputError(f"constraint '{constraint.name}' bounds nothing; give it lower, upper or both")
        if self.solver is not None:
            _check_method("solver", self.solver, Solver, "solve", "(self, nlp, x)")
        require_fields(self, "a plan", ("without_terms", "without_constraints"))
        if self.kernel is None:
            return
        if not (isinstance(self.kernel, type) and issubclass(self.kernel, Kernel)):
            raise InputError(f"kernel must be a subclass of `sgnlp.Kernel`, not {self.kernel!r}")
        if self.kernel is not KERNELS.get(self.kernel.name, self.kernel):
            raise InputError(f"a built-in kernel is called '{self.kernel.name}' too; give yours another name")

    def and_of(self, other: "Additions") -> "Additions":
        """These and others together; where both give a kernel, formulation or solver, this one's is taken."""
        return Additions(
            terms=other.terms + self.terms,
            constraints=other.constraints + self.constraints,
            without_terms=other.without_terms + self.without_terms,
            without_constraints=other.without_constraints + self.without_constraints,
            formulation=self.formulation or other.formulation,
            solver=self.solver or other.solver,
            kernel=self.kernel or other.kernel,
        )

    def chosen(self, settings: Settings) -> Formulation:
        """The formulation of a plan with these settings."""
        return self.formulation or formulation(settings.solver.formulation)

    def structures(self, settings: Settings, around: Around = ALONE) -> list[Structure]:
        """The structures of the programs that a plan with these settings and surroundings solves in turn."""
        terms, constraints = self.all_terms(settings, around), self.all_constraints(settings, around)
        phases = phases_of(self.chosen(settings), settings.solver)
        return [posed(settings, phase.formulation, terms, constraints, around) for phase in phases]

    def all_terms(self, settings: Settings, around: Around = ALONE) -> tuple[Term, ...]:
        """The terms of a plan with these settings, without an arm none of an arm's.

        Raises `InputError` for a duplicate or unknown name.
        """
        joined = _joined("term", preset_terms(settings, around), self.terms, self.without_terms)
        return tuple(term for term in joined if around.carried or not term.of_arm)

    def all_constraints(self, settings: Settings, around: Around = ALONE) -> tuple[Constraint, ...]:
        """The constraints of a plan with these settings, without an arm none of an arm's.

        Raises `InputError` for a duplicate or unknown name.
        """
        ours = preset_constraints(settings, around)
        joined = _joined("constraint", ours, self.constraints, self.without_constraints)
        return tuple(constraint for constraint in joined if around.carried or not constraint.of_arm)


NOTHING = Additions()


def phases_of(form: Formulation, solver: base.Solver) -> tuple[Phase, ...]:
    """The programs that a formulation solves in turn; raises `InputError` if it gives none."""
    phases = form.phases(solver)
    if not (isinstance(phases, list | tuple) and phases and all(isinstance(phase, Phase) for phase in phases)):
        needed = "one `Phase(formulation, iterations)` or more"
        raise InputError(f"the phases of formulation '{form.name}' must be {needed}, not {phases!r:.60}")
    return tuple(phases)


def posed(
    settings: Settings, form: Formulation, terms: Sequence[Term], constraints: Sequence[Constraint], around: Around
) -> Structure:
    """The structure of a program of these parts; raises `InputError` if its objective has no term."""
    found = structure(settings, form, terms, constraints, around)
    if not found.objective:
        raise InputError(f"the formulation '{form.name}' has no term in its objective; leave one in, or add your own")
    return found


def _check(kind: str, part: Any, of: type[Term] | type[Constraint]) -> None:
    """Raise `InputError` for what is no term or constraint, or has no name."""
    if not isinstance(part, of):
        told = f"the class {part.__name__}; call it" if isinstance(part, type) else f"{part!r:.60}"
        raise InputError(f"a {kind} must be a `sgnlp.{of.__name__}`, not {told}")
    if not (isinstance(part.name, str) and part.name):
        raise InputError(f"a {kind} is called {part.name!r}; its name must be a text that is not empty")
    try:
        hash(part)
    except TypeError as error:
        raise InputError(f"{kind} '{part.name}': {error}; its fields must be numbers, texts or tuples") from None


def _joined(kind: str, ours: Sequence[Part], theirs: Sequence[Part], without: Collection[str]) -> tuple[Part, ...]:
    names, new = {part.name: part for part in ours}, {part.name: part for part in theirs}
    if len(new) < len(theirs):
        twice = next(p.name for p in theirs if sum(q.name == p.name for q in theirs) > 1)
        raise InputError(f"two of the given {kind}s are called '{twice}'; give one of them another name")
    for name in without:
        if name not in names:
            raise unknown(kind, name, names)
    both = names | new  # a built-in one keeps its place when it is changed
    return tuple(part for name, part in both.items() if name not in without)


def _check_method(kind: str, part: Any, base_class: type, name: str, arguments: str) -> None:
    """Raise `InputError` for a part of the user's own without the method that makes it one."""
    if getattr(type(part), name) is getattr(base_class, name):
        raise InputError(f"{kind} '{part.name}' has no method `{name}{arguments}`")


class Named(Mapping[str, Part]):
    """Parts by name; an unknown name raises `InputError` with the valid names."""

    def __init__(self, kind: str, parts: Sequence[Part]):
        self._kind = kind
        self._parts: dict[str, Part] = {part.name: part for part in parts}

    def __getitem__(self, name: str) -> Part:
        if name not in self._parts:
            raise unknown(self._kind, name, self._parts)
        return self._parts[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)

    def __contains__(self, name: Any) -> bool:
        return name in self._parts


@typed
def terms(settings: Settings = ROBUST) -> Named[Term]:
    """The built-in terms of settings, with their weights, by name. `Term` gives the equation of each.

    Looking up an unknown name raises `InputError` with the valid names.

    >>> replace(sgnlp.terms()["uncer"], weight=50.0)  # given to `solve`, it replaces the built-in one
    """
    return Named("term", preset_terms(settings))


@typed
def constraints(settings: Settings = ROBUST) -> Named[Constraint]:
    """The built-in constraints of settings, with their bounds in SI units, by name.

    Looking up an unknown name raises `InputError` with the valid names.

    >>> replace(sgnlp.constraints()["stiffness"], lower=0.02)
    """
    return Named("constraint", preset_constraints(settings))
