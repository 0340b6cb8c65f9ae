"""Terms and constraints of one's own that mean other things in CasADi than in NumPy are refused."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scenes import SMALL, hand, observation

import sgnlp
from sgnlp.base.errors import InputError
from sgnlp.planning.additions import Additions
from sgnlp.planning.agreement import agree
from sgnlp.planning.problem import build_problem
from sgnlp.planning.starts import starts
from sgnlp.program.around import Around
from sgnlp.program.formulations import FORMULATIONS

FORMS = [name for name in FORMULATIONS if name != "two_phase"]
HEIGHT = {"z": 0.02}  # [m], a number outside a term, which changes


def compared(form: str = "constrained", **added: object) -> None:
    settings = replace(SMALL, solver=replace(SMALL.solver, compiled=False, formulation=form))
    problem = build_problem(observation(), hand(), settings, 0, Additions(**added))
    agree(problem, starts(problem, 1, 0)[0])


OPERATIONS = {
    "norm": lambda g, op: op.norm(g.forces_eq),
    "residual": lambda g, op: op.residual(g.forces_eq),
    "dot": lambda g, op: op.dot(g.forces_eq, g.contacts),
    "square": lambda g, op: op.square(g.contacts),
    "sum": lambda g, op: op.sum(g.gaps),
    "stack": lambda g, op: op.stack(g.gaps, g.contacts),
    "least": lambda g, op: op.least(5.0, op.norm(g.forces_eq)),
    "closest": lambda g, op: op.closest(g.gaps, g.contacts[:, 2]),
    "hinge": lambda g, op: op.hinge(g.contacts[:, 2] - 0.01),
    "abs": lambda g, op: op.abs(g.contacts[:, 0]),
    "log": lambda g, op: op.log(g.contacts[:, 2]),
    "matrix": lambda g, op: g.contacts,
}
"""Constraints, each of one operation: in a sum a small value would not be seen beside a large one."""


@pytest.mark.parametrize("form", FORMS)
def test_what_is_written_in_the_operations_agrees_in_every_formulation(form):
    rows = [sgnlp.Constraint(name, value, upper=1e3) for name, value in OPERATIONS.items()]
    terms = [
        type(name.title(), (sgnlp.Term,), {"value": lambda self, g, op, of=value: op.sum(of(g, op)), "name": name})
        for name, value in OPERATIONS.items()
    ]
    compared(form, constraints=tuple(rows), terms=tuple(term() for term in terms))


def element(g, op):
    return op.sum(g.contacts[0] ** 2)  # a row in NumPy


def number(g, op):
    return float(g.gaps[0])  # NaN in CasADi


def product(g, op):
    return op.sum(g.contacts * g.gains)  # refused by NumPy


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (element, "in CasADi and .* in NumPy"),
        (number, "not finite in CasADi at the first start; float and functions of math"),
        (product, "cannot be computed in NumPy"),
    ],
)
def test_a_term_with_two_meanings_is_refused_by_name(value, said):
    two = type("Two", (sgnlp.Term,), {"value": lambda self, g, op: value(g, op), "__module__": __name__})
    with pytest.raises(InputError, match=f"term 'two' .*{said}"):
        compared(terms=(two(),))


def test_a_constraint_with_other_rows_in_numpy_is_refused():
    with pytest.raises(InputError, match="constraint 'row' has 1 values in CasADi and 3 in NumPy"):
        compared(constraints=(sgnlp.Constraint("row", lambda g, op: g.contacts[0], upper=1.0),))


def test_a_constraint_without_values_is_refused():
    with pytest.raises(
        InputError, match=r"constraint 'none' has no rows for the hand 'allegro_left', .*; leave it out for"
    ):
        compared(constraints=(sgnlp.Constraint("none", lambda g, op: g.contacts[0:0, 2], upper=1.0),))


@dataclass(frozen=True)
class Near(sgnlp.Term):
    """Contacts near a place that is a field of the term."""

    place: object = None

    def value(self, g, op):
        return op.sum(g.contacts)


class Level(sgnlp.Term):
    """Contacts at a height that stands outside the term."""

    def value(self, g, op):
        return op.sum((g.contacts[:, 2] - HEIGHT["z"]) ** 2)


def test_a_term_whose_number_changed_since_it_was_built_is_refused(monkeypatch):
    compared(terms=(Level(),))
    monkeypatch.setitem(HEIGHT, "z", 0.5)
    with pytest.raises(InputError, match="term 'level' is"):
        compared(terms=(Level(),))


def test_a_constraint_whose_number_changed_is_refused_with_what_to_do(monkeypatch):
    lowest = sgnlp.Constraint("lowest", lambda g, op: g.contacts[:, 2] - HEIGHT["z"], lower=-1.0)
    compared(constraints=(lowest,))
    monkeypatch.setitem(HEIGHT, "z", 0.5)
    with pytest.raises(InputError, match=r"constraint 'lowest' is .*; .* numbers that change need a new function"):
        compared(constraints=(lowest,))


def test_the_rows_of_a_matrix_have_one_order_in_the_program_and_in_the_check():
    problem = build_problem(observation(), hand(), SMALL, 0, Additions())
    places = sgnlp.Constraint("places", lambda g, op: g.contacts, upper=0.0, unit="m")
    names = [f"places[{i}]" for i in range(3 * len(problem.hand.fingers))]
    contacts = np.zeros((len(problem.hand.fingers), 3))
    contacts[1, 2] = 1.0  # columns first, as in CasADi
    g = type("Only", (), {"contacts": contacts})()
    assert places.check(g, names).row == f"places[{2 * len(problem.hand.fingers) + 1}]"


NAN, ALWAYS = Level(weight=float("nan")), sgnlp.Constraint("stable", lambda g, op: g.gains, lower=1.0)
UNBOUND = sgnlp.Constraint("free", lambda g, op: g.gains)


@pytest.mark.parametrize(
    ("added", "said"),
    [
        ({"terms": (NAN,)}, "term 'level' has the weight nan"),
        ({"terms": (Level(weight="3"),)}, "the weight of term 'level' must be a number, not '3'"),
        ({"terms": (Near(place=[1.0, 2.0]),)}, "term 'near': unhashable type.*; its fields must be numbers, texts or"),
        ({"terms": (Level,)}, "not the class Level; call it"),
        ({"constraints": (ALWAYS,)}, "a check of every plan is called 'stable'"),
        ({"constraints": (UNBOUND,)}, "constraint 'free' bounds nothing"),
        ({"constraints": (replace(ALWAYS, name=""),)}, "a text that is not empty"),
        ({"constraints": (NAN,)}, "a constraint must be a `sgnlp.Constraint`"),
    ],
)
def test_what_is_no_term_or_constraint_is_refused(added, said):
    with pytest.raises(InputError, match=said):
        Additions(**added)


def test_parts_that_no_hand_has_are_refused():
    ranging = sgnlp.Constraint("odd", lambda g, op: g.gains, lower=1.0, over="fingers")
    with pytest.raises(InputError, match="unknown parts of constraint 'odd', over 'fingers'"):
        compared(constraints=(ranging,))


def test_a_term_that_writes_into_the_grasp_is_refused_and_changes_nothing():
    def centred(self, g, op):
        z = g.contacts[:, 2]
        z -= op.sum(z) / 4
        return op.square(z)

    def lowered(g, op):
        g.contacts[0, 2] = 0.0
        return g.contacts

    def moved(g, op):
        origin = g.links["palm_link"]
        origin += 0.1
        return origin

    writing = type("Writing", (sgnlp.Term,), {"value": centred})
    with pytest.raises(InputError, match=r"term 'writing': it writes into a part of g, .* write z = z - a, not z -= a"):
        compared(terms=(writing(),))
    for value in (lowered, moved):
        with pytest.raises(InputError, match="constraint 'low': it writes into a part of g"):
            compared(constraints=(sgnlp.Constraint("low", value, lower=-1.0),))


def test_what_needs_an_arm_is_left_out_without_one():
    class Home(sgnlp.Term):
        of_arm = True

        def value(self, g, op):
            return op.square(g.arm.joints - g.arm.home)

    high = sgnlp.Constraint("high", lambda g, op: g.arm.joints[0], lower=0.0, of_arm=True)
    added = Additions(terms=(Home(),), constraints=(high,))
    problem = build_problem(observation(), hand(), SMALL, 0, added)
    assert "home" not in {term.name for term in problem.terms}
    assert "high" not in {one.name for one in problem.constraints}
    on_arm = Around(carried=True)
    assert "home" in {term.name for term in added.all_terms(SMALL, on_arm)}
    assert "high" in {one.name for one in added.all_constraints(SMALL, on_arm)}
