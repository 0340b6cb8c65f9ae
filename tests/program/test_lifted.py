"""The lifted program: where its equations hold it is the constrained one, and it ends in the same solutions."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import SMALL, exact_grasp, oracle, posed, random_point, with_added
from test_elastic import solved
from test_nlp import LOADED, TORQUES, full

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Contact, Settings, Solver
from sgnlp.program.formulations import formulation
from sgnlp.program.formulations.lifted import EQUATIONS
from sgnlp.program.variables import variable_units


def at(settings: Settings, seed: int = 0):
    """The functions, a point where what is lifted follows from the rest, its parameters and its start."""
    functions, problem = oracle(settings, "lifted"), posed(settings)
    start, x = random_point(problem, functions.nlp, seed)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    return functions, with_added(functions, x, p, problem.row_bounds(functions.nlp)), p, start


def equations(functions) -> np.ndarray:
    """Which rows (ng,) define what is lifted."""
    return np.repeat([c in EQUATIONS for c in functions.nlp.constraints], functions.nlp.row_sizes)


def added_units(functions) -> np.ndarray:
    """Units of the lifted variables."""
    return functions.nlp.structure.formulation.variables(functions.nlp.hand).units


@pytest.mark.parametrize("settings", [SMALL, LOADED, TORQUES], ids=["small", "loaded", "torques"])
@pytest.mark.parametrize("seed", range(3))
def test_where_its_equations_hold_it_has_the_objective_and_the_rows_of_the_constrained_program(settings, seed):
    functions, x, p, _ = at(settings, seed)
    rigid, free = oracle(settings, "constrained"), len(variable_units(posed(settings).hand))
    g, defined = functions.values(x, p), equations(functions)
    assert len(x) == free + len(added_units(functions))
    np.testing.assert_allclose(g[defined], 0, atol=1e-8)
    np.testing.assert_allclose(g[~defined], rigid.values(x[:free], p), atol=1e-8)
    assert float(functions.objective(x, p)) == pytest.approx(float(rigid.objective(x[:free], p)), rel=1e-9)


def test_eliminating_what_is_lifted_gives_the_derivatives_of_the_constrained_program():
    """Reduced by u(y), with D = -(∂c/∂u)⁻¹ ∂c/∂y and multipliers of c from ∇_u L = 0 (Nocedal & Wright, 15.3)."""
    functions, x, p, _ = at(LOADED, 1)
    rigid, free = oracle(LOADED, "constrained"), len(variable_units(posed(LOADED).hand))
    g, J = (np.array(a) for a in functions.jacobian(x, p))
    defined = equations(functions)
    D = -np.linalg.solve(J[defined][:, free:], J[defined][:, :free])
    gradient = np.array(functions.gradient(x, p)[1]).ravel()
    expected = np.array(rigid.gradient(x[:free], p)[1]).ravel()
    near = {"rtol": 1e-6, "atol": 1e-6 * np.abs(expected).max()}
    np.testing.assert_allclose(gradient[:free] + D.T @ gradient[free:], expected, **near)
    J_rigid = np.array(rigid.jacobian(x[:free], p)[1])
    reduced = J[~defined][:, :free] + J[~defined][:, free:] @ D
    np.testing.assert_allclose(reduced, J_rigid, atol=1e-6 * np.abs(J_rigid).max())
    lam = np.zeros(len(g))
    lam[~defined] = np.random.default_rng(1).normal(size=(~defined).sum())
    slope = gradient[free:] + J[~defined][:, free:].T @ lam[~defined]
    lam[defined] = -np.linalg.solve(J[defined][:, free:].T, slope)
    along = np.vstack([np.eye(free), D])
    H = along.T @ full(functions.hessian(x, p, 1.0, lam)) @ along
    H_rigid = full(rigid.hessian(x[:free], p, 1.0, lam[~defined]))
    np.testing.assert_allclose(H, H_rigid, atol=1e-6 * np.abs(H_rigid).max())


def test_the_lifted_variables_are_the_tips_and_the_equilibrium_of_the_recomputed_grasp():
    functions, x, _, start = at(LOADED, 2)
    problem = posed(LOADED)
    g = exact_grasp(problem, start, x[: len(variable_units(problem.hand))])
    tips, turn, shift = np.split(x[-len(added_units(functions)) :] * added_units(functions), [-6, -3])
    np.testing.assert_allclose(tips.reshape(-1, 3), g.tips, atol=1e-12)
    angle = 2 * np.arctan(np.linalg.norm(turn))
    axis = turn / np.linalg.norm(turn)
    np.testing.assert_allclose(g.rotation @ axis, axis, atol=1e-9)
    assert np.trace(g.rotation) == pytest.approx(1 + 2 * np.cos(angle))
    centre = (g.contacts - problem.com) @ g.rotation.T + problem.com + shift
    np.testing.assert_allclose(centre, g.contacts_eq, atol=1e-9)
    names = functions.nlp.variable_names
    first = problem.hand.fingers[0].name
    assert names[len(variable_units(problem.hand))] == f"tip.{first}.x"
    assert functions.nlp.row_names[-18] == f"tip[{first}.x]"
    assert names[-6:] == tuple(f"equilibrium.{name}" for name in ("rx", "ry", "rz", "x", "y", "z"))


@pytest.mark.parametrize("index", [0, 1])
def test_it_ends_in_a_solution_of_the_constrained_program(index):
    phases = formulation("lifted").phases(Solver())
    assert [(phase.formulation.name, phase.iterations) for phase in phases] == [("lifted", 400)]
    rigid, lifted = (
        solved(replace(SMALL, solver=Solver(formulation=form, compiled=False)), index)
        for form in ("constrained", "lifted")
    )
    assert lifted.kkt.worst < 1e-5
    assert lifted.feasible
    assert not lifted.violations
    assert lifted.energy == pytest.approx(rigid.energy, rel=1e-3)


@pytest.mark.parametrize(
    "contact", [Contact(metric="closure"), Contact(equilibrium="printed")], ids=["closure", "printed"]
)
def test_it_refuses_an_equilibrium_that_is_none(contact):
    with pytest.raises(InputError, match="lifted needs --contact"):
        posed(replace(SMALL, contact=contact)).structure(formulation("lifted"))
