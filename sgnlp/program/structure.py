"""The structure of a program: its symbolic functions are built and compiled once for each structure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand
from sgnlp.program.around import ALONE, Around
from sgnlp.program.constraint import Constraint
from sgnlp.program.formulation import Formulation
from sgnlp.program.terms.term import Term
from sgnlp.program.variables import AtContact, Variables, common

OURS = "sgnlp.program."
"""The package of built-in parts; its sources are in the key of compiled functions anyway."""


@dataclass(frozen=True)
class Structure:
    """All that the symbolic functions depend on besides the hand: terms and constraints of the plan, without
    numbers."""

    formulation: Formulation
    samples: int
    density: str
    equilibrium: str
    at_contact: AtContact  # which variables of the hand at first contact the program has
    terms: tuple[Term, ...]  # terms with weight 1
    constraints: tuple[Constraint, ...]  # constraints without bounds
    around: Around = ALONE

    def variables(self, hand: Hand) -> Variables:
        """All variables of the program, in their order."""
        return common(hand) + self.at_contact.of(hand) + self.formulation.variables(hand)

    @property
    def objective(self) -> tuple[Term, ...]:
        """The terms of the objective."""
        return self.formulation.terms(self.terms)

    @property
    def rows(self) -> tuple[Constraint, ...]:
        """The constraints that are rows of the program."""
        return self.formulation.constraints(self.constraints)

    def of(self, hand: Hand) -> Hand:
        """The hand in its programs: on the arm, or alone."""
        return hand if self.around.carried else hand.alone or hand

    @property
    def inner(self) -> "Structure":
        """The structure whose functions this one's program wraps; itself if it has its own."""
        return replace(self, formulation=self.formulation.inner)

    @property
    def key(self) -> str | None:
        """A text that differs whenever the functions may differ; None if the source of a part is not known."""
        parts = [_key(self.formulation, type(self.formulation).__module__)]
        parts += [_key(term, type(term).__module__) for term in self.terms]
        parts += [_key(c, getattr(c.value, "__module__", None) or "") for c in self.constraints]
        numbers = f"{self.samples} {self.density} {self.equilibrium} {self.at_contact} {self.around}"
        return None if None in parts else " ".join([numbers, *map(str, parts)])


def _key(part: Formulation | Term | Constraint, module: str) -> str | None:
    if not (module.startswith(OURS) or part.source):
        return None
    if isinstance(part, Constraint):
        code = getattr(part.value, "__code__", None)
        where = code.co_firstlineno if code else "" if part.source else part.value
        return f"{part.name} {part.source} {module} {where} {part.scale} {part.always}"
    return f"{part.name} {part.source} {part}"


def structure(
    settings: Settings,
    formulation: Formulation,
    terms: Sequence[Term],
    constraints: Sequence[Constraint],
    around: Around = ALONE,
) -> Structure:
    """The structure of a formulation of a plan's terms and constraints.

    Raises `InputError` if the formulation does not support the settings.
    """
    formulation.check(settings)
    contact, closing = settings.contact, settings.closing
    planned = closing.planned and formulation.plans_contact
    around = replace(around, carried=around.carried and formulation.plans_arm)
    return Structure(
        formulation=formulation,
        samples=contact.samples,
        density=contact.density,
        equilibrium=contact.equilibrium,
        at_contact=AtContact(planned, planned and closing.c_freedom > 0),
        terms=tuple(replace(term, weight=1.0) for term in terms if around.carried or not term.of_arm),
        constraints=tuple(replace(c, lower=-inf, upper=inf) for c in constraints if around.carried or not c.of_arm),
        around=around,
    )
