"""The elastic program: exact derivatives, the constrained solution where there is one, else what cannot be met."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from finite_differences import assert_jacobian
from scenes import SMALL, oracle, posed, random_point, with_added
from test_nlp import full

from sgnlp.base.settings import Settings, Solver
from sgnlp.planning.planner import Planner
from sgnlp.planning.solution import Solution, solution
from sgnlp.planning.starts import starts
from sgnlp.planning.violations import violations
from sgnlp.program.constraints import CONSTRAINTS
from sgnlp.program.formulations import formulation
from sgnlp.program.oracle import Oracle

ELASTIC = replace(SMALL, solver=Solver(formulation="elastic", compiled=False))
IMPOSSIBLE = replace(ELASTIC, limits=replace(SMALL.limits, table_margin=0.1))
"""A palm 10 cm over the table may be; fingers around an object 8 cm high may not."""


def elastic(settings: Settings = ELASTIC) -> Oracle:
    return oracle(settings, "elastic")


def at(functions: Oracle, settings: Settings = ELASTIC, seed: int = 0):
    """A point near a start with random slacks, and its parameters."""
    problem = posed(settings)
    start, x = random_point(problem, oracle(SMALL, "constrained").nlp, seed)
    slacks = np.random.default_rng(seed).uniform(0, 1, len(functions.nlp.units) - len(x))
    return np.concatenate([x, slacks]), problem.parameters(functions.nlp, start.wrist, start.joints)


def solved(settings: Settings, index: int = 0) -> Solution:
    planner = Planner(posed(settings))
    start = starts(planner.problem, index + 1, 0)[index]
    return solution(planner.problem, start, planner.solve(start), planner.stages[-1].nlp)


def test_the_rows_and_the_objective_are_the_constrained_ones_and_the_slacks():
    rigid, functions = oracle(SMALL, "constrained"), elastic()
    x, p = at(functions)
    nx, ng = len(rigid.nlp.units), sum(rigid.nlp.row_sizes)
    up, down = x[nx : nx + ng], x[nx + ng :]
    np.testing.assert_allclose(functions.values(x, p), rigid.values(x[:nx], p[:-1]) + up - down)
    weight = ELASTIC.solver.elastic_weight
    expected = float(rigid.objective(x[:nx], p[:-1])) + weight * (up.sum() + down.sum())
    assert float(functions.objective(x, p)) == pytest.approx(expected)
    np.testing.assert_array_equal(functions.terms(x, p), rigid.terms(x[:nx], p[:-1]))


def test_the_derivatives_match_differences():
    functions = elastic()
    x, p = at(functions, seed=1)
    lam = np.random.default_rng(1).normal(size=sum(functions.nlp.row_sizes))
    D = np.random.default_rng(2).normal(size=(len(x), 4)) / 5  # directions: the rest is the constrained program's
    f, gradient = functions.gradient(x, p)
    g, J = functions.jacobian(x, p)
    assert float(f) == pytest.approx(float(functions.objective(x, p)))
    np.testing.assert_allclose(np.array(g).ravel(), functions.values(x, p))
    assert_jacobian(lambda t: float(functions.objective(x + D @ t, p)), np.array(gradient).T @ D, np.zeros(4))
    assert_jacobian(lambda t: functions.values(x + D @ t, p), np.array(J) @ D, np.zeros(4))

    def lagrangian(t):
        _, gradient = functions.gradient(x + D @ t, p)
        return np.array(gradient).ravel() + np.array(functions.jacobian(x + D @ t, p)[1]).T @ lam

    assert_jacobian(lagrangian, full(functions.hessian(x, p, 1.0, lam)) @ D, np.zeros(4))


def test_only_rows_that_say_where_the_functions_are_defined_have_no_slack_and_no_side_without_a_bound_has_one():
    nlp, problem = elastic().nlp, posed(ELASTIC)
    low, high = problem.row_bounds(nlp)
    up, down = np.split(nlp.structure.formulation.variable_bounds(nlp, (low, high))[1], 2)
    free = {row: (u > 0, d > 0) for row, u, d in zip(nlp.row_names, up, down, strict=True)}
    assert free["contact[ring]"] == free["force[ring]"] == (True, True)
    assert free["shift[thumb]"] == (False, True)
    assert free["table[middle_distal]"] == (True, False)
    assert {row for row, sides in free.items() if not any(sides)} == {
        "stiffness", "rotation", *(f"workspace[{f.name}]" for f in problem.hand.fingers)
    }  # fmt: skip
    assert [len(bound) for bound in formulation("constrained").variable_bounds(nlp, (low, high))] == [0, 0]


def test_a_point_that_is_handed_over_is_within_its_bounds_and_a_relaxed_one_has_no_slack():
    functions, problem = elastic(), posed(ELASTIC)
    x, p = at(functions)
    low, high = problem.row_bounds(functions.nlp)
    x = with_added(functions, x, p, (low, high))
    g = functions.values(x, p)
    assert (g >= low - 1e-12).all()
    assert (g <= high + 1e-12).all()
    shared = len(oracle(SMALL, "constrained").nlp.units)
    assert functions.nlp.structure.formulation.strict(functions.nlp, x)[shared:].max() == 0
    assert (x >= 0)[-len(g) :].all()


def test_where_the_constraints_can_be_met_it_is_the_constrained_program():
    phases = formulation("elastic").phases(ELASTIC.solver)
    assert [(phase.formulation.name, phase.iterations) for phase in phases] == [("penalty", 25), ("elastic", 400)]
    rigid, soft = (
        solved(replace(SMALL, solver=replace(ELASTIC.solver, formulation=f))) for f in ("two_phase", "elastic")
    )
    assert soft.feasible
    assert not soft.violations
    assert soft.kkt.worst < 1e-5
    assert soft.energy == pytest.approx(rigid.energy, rel=1e-5)


def test_where_they_cannot_it_ends_with_their_names_and_sizes():
    s = solved(IMPOSSIBLE)
    assert s.kkt.worst < 1e-5
    clearances = dict(zip(elastic().nlp.row_names[slice(*table_rows())], s.grasp.table_clearances, strict=True))
    low = {name for name, clearance in clearances.items() if clearance < 0.1 - 1e-6}
    assert low
    assert {v.name for v in s.violations if v.name.startswith("table[")} == low
    for v in s.violations:
        if v.name.startswith("table["):
            assert v.unit == "mm"
            assert v.limit == pytest.approx(100)
            assert v.value == pytest.approx(1e3 * clearances[v.name], abs=1e-6)
            assert v.size == pytest.approx((v.limit - v.value) / 10)
    assert [v.size for v in s.violations] == sorted((v.size for v in s.violations), reverse=True)


def test_what_is_not_met_is_told_in_the_units_of_its_rows():
    names = {"stiffness": 10.0, "force": 1.0, "table": 10.0, "sag": 100.0}  # [mN m, N, mm, N/m]
    units = [constraint for constraint in CONSTRAINTS if constraint.name in names]
    nlp = SimpleNamespace(
        constraints=units,
        row_sizes=(1,) * 4,
        row_names=[c.name for c in units],
        structure=posed(SMALL).structure(formulation("penalty")),
    )
    low, high = np.zeros(4), np.full(4, 2.0)
    found = violations(nlp, lambda x: np.array([3.0, -0.5, 2.5, 1.0]), np.zeros(0), (low, high), 1e-6)
    order = [c.name for c in units]
    assert [v.name for v in found] == order[:3]
    for v, row, limit in zip(found, (3.0, -0.5, 2.5), (2.0, 0.0, 2.0), strict=True):
        assert (v.value, v.limit) == pytest.approx((row * names[v.name], limit * names[v.name]))
        assert v.size == pytest.approx(abs(row - limit))
    assert {v.name: v.unit for v in found}["stiffness"] == "mN m"


def table_rows() -> tuple[int, int]:
    """Where the rows of the table begin and end."""
    nlp = elastic().nlp
    i = [c.name for c in nlp.constraints].index("table")
    return sum(nlp.row_sizes[:i]), sum(nlp.row_sizes[: i + 1])


def test_what_is_not_met_is_told_in_degrees_where_the_row_is_a_trace():
    turned = replace(
        SMALL, limits=replace(SMALL.limits, rotation_deg=1e-3), solver=Solver(formulation="penalty", max_iterations=1)
    )
    found = {v.name: v for v in solved(turned).violations}
    angle = found["rotation"]
    assert angle.unit == "deg"
    assert angle.limit == pytest.approx(1e-3, rel=1e-3)
    assert angle.value > 0.01
