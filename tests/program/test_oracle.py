"""The program joined with a surface: one evaluation a point, the same answers, clear names."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scenes import SMALL, posed, random_point, surface

from sgnlp.program.formulations import formulation
from sgnlp.program.nlp import build
from sgnlp.program.oracle import Surface, SurfaceJets, join
from sgnlp.program.parameters import ParameterVector
from sgnlp.surface.gpis import MEAN_JET, VARIANCE_JET


@pytest.fixture
def joined():
    """A fresh oracle of the constrained formulation, a point and its parameters."""
    problem = posed(SMALL)
    oracle = join(build(problem.hand, problem.structure(formulation("constrained"))), problem.gpis)
    start, x = random_point(problem, oracle.nlp, 0)
    return oracle, x, problem.parameters(oracle.nlp, start.wrist, start.joints)


def test_the_surface_is_evaluated_once_for_each_new_point(joined):
    oracle, x, p = joined
    lam = np.zeros(sum(oracle.nlp.row_sizes))
    for i, point in enumerate((x, x + 1e-3, x), start=1):
        for _ in range(2):
            oracle.objective(point, p)
            oracle.gradient(point, p)
            oracle.rows(point, p)
            oracle.jacobian(point, p)
            oracle.hessian(point, p, 1.0, lam)
            oracle.terms(point, p)
        assert oracle.surface.evaluations == oracle.surface.completions == i


def test_a_trial_point_takes_no_derivatives_of_the_surface(joined):
    oracle, x, p = joined
    oracle.objective(x, p)
    oracle.rows(x, p)
    assert (oracle.surface.evaluations, oracle.surface.completions) == (1, 0)
    oracle.gradient(x, p)
    assert (oracle.surface.evaluations, oracle.surface.completions) == (1, 1)


def test_objective_and_rows_are_the_same_bits_with_and_without_derivatives_of_the_surface(joined):
    oracle, x, p = joined
    alone = float(oracle.objective(x, p)), np.array(oracle.rows(x, p))
    f, g = oracle.gradient(x, p)[0], oracle.jacobian(x, p)[0]
    assert (float(f), float(oracle.objective(x, p))) == (alone[0], alone[0])
    np.testing.assert_array_equal(np.array(g), alone[1])
    np.testing.assert_array_equal(np.array(oracle.rows(x, p)), alone[1])


def test_gains_alone_do_not_move_the_query_points(joined):
    oracle, x, p = joined
    oracle.objective(x, p)
    x = x.copy()
    x[-1] += 0.1
    oracle.objective(x, p)
    assert oracle.surface.evaluations == 1


def test_a_remembered_answer_equals_a_fresh_one(joined):
    oracle, x, p = joined
    first = np.array(oracle.gradient(x, p)[1])
    oracle.gradient(x + 0.01, p)
    np.testing.assert_array_equal(np.array(oracle.gradient(x, p)[1]), first)


def test_the_surface_gives_the_jets_of_the_layout_with_the_feet_below_the_contacts():
    nlp, gpis = build(posed(SMALL).hand, posed(SMALL).structure(formulation("penalty"))), surface()
    layout = nlp.layout
    both = Surface(gpis, layout, nlp.jets)
    jets, m, before = SurfaceJets(both, complete=True), layout.m, layout.before_feet
    Z = gpis.centre + 0.05 * np.random.default_rng(0).normal(size=(layout.points - m, 3))
    depths = np.linspace(0.0, 0.012, m)
    feet = Z[:m] - depths[:, None] * gpis.normal(Z[:m])
    mean = gpis.mean_jet(np.concatenate([Z[:before], feet, Z[before:]]))
    expected = layout.function()(mean.T, gpis.variance_jet(Z[: layout.uncertain]).T)
    for found, block in zip(jets(Z, depths, np.empty((0, 3))), [*expected, np.empty((0, 10))], strict=True):
        np.testing.assert_allclose(np.array(found), np.array(block), rtol=1e-9, atol=1e-9)


def test_points_that_are_not_finite_give_an_answer_that_is_not_finite_and_are_not_remembered():
    nlp, gpis = build(posed(SMALL).hand, posed(SMALL).structure(formulation("penalty"))), surface()
    layout = nlp.layout
    jets, depths = SurfaceJets(Surface(gpis, layout, nlp.jets), complete=True), np.zeros(layout.m)
    Z = np.full((layout.points - layout.m, 3), np.nan)
    assert not np.isfinite(np.array(jets(Z, depths, np.empty((0, 3)))[0])).any()
    good = np.zeros_like(Z) + gpis.centre + 0.04
    assert np.isfinite(np.array(jets(good, depths, np.empty((0, 3)))[0])).all()


def test_the_functions_carry_the_names_that_ipopt_looks_for(joined):
    oracle, _, _ = joined
    assert oracle.gradient.name_out() == ["f", "grad_f_x"]
    assert oracle.jacobian.name_out() == ["g", "jac_g_x"]
    assert oracle.hessian.name_in() == ["x", "p", "lam_f", "lam_g"]
    assert oracle.hessian.name_out() == ["triu_hess_gamma_x_x"]
    assert oracle.hessian.sparsity_out(0).is_triu()


def test_one_program_serves_two_surfaces(joined):
    oracle, x, p = joined
    other = join(oracle.nlp, replace(oracle_surface(joined), prior=0.9))
    assert float(other.objective(x, p)) != float(oracle.objective(x, p))


def oracle_surface(joined):
    return posed(SMALL).gpis


def test_a_raw_jet_has_as_many_numbers_as_documented():
    assert (MEAN_JET, VARIANCE_JET) == (20, 10)


# --- parameters ------------------------------------------------------------------------------------------------------


def test_parameters_are_packed_in_the_order_of_their_blocks():
    vector = ParameterVector({"a": 2, "b": 1})
    np.testing.assert_array_equal(vector.pack({"b": 3.0, "a": [1, 2]}), [1, 2, 3])
    symbols, blocks = vector.symbols()
    f = ca.Function("f", [symbols], [blocks.a, blocks.b])
    a, b = f(vector.pack({"a": [1, 2], "b": 3}))
    np.testing.assert_array_equal(np.array(a).ravel(), [1, 2])
    assert float(b) == 3


def test_a_block_of_the_wrong_size_or_a_missing_one_is_refused_by_name():
    vector = ParameterVector({"a": 2, "b": 1})
    with pytest.raises(ValueError, match="parameter 'a' has 3 numbers, not 2"):
        vector.pack({"a": [1, 2, 3], "b": 0})
    with pytest.raises(KeyError, match="b"):
        vector.pack({"a": [1, 2]})
