"""Logistic regression: its gradient, its minimum, and that it finds again what its data were drawn from."""

import numpy as np
import pytest
from finite_differences import assert_jacobian
from scipy.optimize import minimize

from sgnlp.base.errors import InputError
from sgnlp.experiments.logistic import STRENGTHS, fitted, gradient, left_out, loss, minimum
from sgnlp.planning.confidence import Feature, Model

TRUE = np.array([0.8, 1.5, -0.7, 0.0])


def drawn(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Features (count, 3) and what held, of the model TRUE."""
    rng = np.random.default_rng(seed)
    phi = rng.normal(size=(count, 3))
    return phi, rng.random(count) < 1 / (1 + np.exp(-(TRUE[0] + phi @ TRUE[1:])))


def shape(units: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Model:
    return Model(0.0, tuple(Feature(f"x{i}", "", unit) for i, unit in enumerate(units)))


@pytest.mark.parametrize("strength", [0.0, 3.0])
def test_the_gradient_of_the_loss_is_that_of_differences(strength):
    phi, held = drawn(40)
    theta = np.array([0.3, -0.2, 0.9, 0.4])
    assert_jacobian(lambda t: loss(t, phi, held, strength), gradient(theta, phi, held, strength), theta)


def test_the_loss_is_the_log_of_the_probability_of_what_came_true_and_the_ridge():
    phi, held = drawn(40)
    p = 1 / (1 + np.exp(-(TRUE[0] + phi @ TRUE[1:])))
    told = -np.log(np.where(held, p, 1 - p)).sum()
    assert loss(TRUE, phi, held, 0.0) == pytest.approx(told)
    assert loss(TRUE, phi, held, 4.0) == pytest.approx(told + 2.0 * (TRUE[1:] @ TRUE[1:]))


@pytest.mark.parametrize("strength", [0.1, 1.0, 100.0])
def test_newton_ends_where_another_solver_does(strength):
    phi, held = drawn(60, seed=1)
    found = minimum(phi, held, strength)
    other = minimize(loss, np.zeros(4), (phi, held, strength), tol=1e-12).x
    np.testing.assert_allclose(found, other, atol=1e-4)
    assert abs(gradient(found, phi, held, strength)).max() < 1e-8


def test_the_coefficients_of_simulated_trials_are_found_again():
    phi, held = drawn(20000)
    model, strength = fitted(shape(), phi, held, [str(i % 2) for i in range(len(phi))])
    assert strength in STRENGTHS
    assert model.intercept == pytest.approx(TRUE[0], abs=0.08)
    assert [f.weight for f in model.features] == pytest.approx(list(TRUE[1:]), abs=0.08)
    assert [(f.low, f.high) for f in model.features] == list(zip(phi.min(axis=0), phi.max(axis=0), strict=True))


def test_features_are_fitted_in_their_units_and_probabilities_do_not_change_with_them():
    phi, held = drawn(5000)
    model, _ = fitted(shape((10.0, 0.1, 2.0)), phi * [10.0, 0.1, 2.0], held, [str(i % 2) for i in range(len(phi))])
    plain, _ = fitted(shape(), phi, held, [str(i % 2) for i in range(len(phi))])
    assert [f.weight for f in model.features] == pytest.approx([f.weight for f in plain.features])
    np.testing.assert_allclose(model.probability(phi * [10.0, 0.1, 2.0]), plain.probability(phi))


def test_separable_trials_have_a_finite_fit():
    phi = np.linspace(-1, 1, 20)[:, None]
    found = minimum(phi, phi[:, 0] > 0, 0.1)
    assert np.isfinite(found).all()
    assert found[1] > 1


def test_the_ridge_is_that_which_judges_left_out_groups_best():
    phi, held = drawn(60, seed=2)
    groups = [str(i % 6) for i in range(60)]
    names, told = np.array(groups), {}
    for strength in STRENGTHS:
        told[strength] = 0.0
        for name in sorted(set(groups)):
            theta = minimum(phi[names != name], held[names != name], strength)
            p = 1 / (1 + np.exp(-(theta[0] + phi[names == name] @ theta[1:])))
            told[strength] -= np.log(np.where(held[names == name], p, 1 - p)).sum()
        assert left_out(phi, held, groups, strength) == pytest.approx(told[strength])
    assert fitted(shape(), phi, held, groups)[1] == min(STRENGTHS, key=told.__getitem__)
    assert min(STRENGTHS) < min(STRENGTHS, key=told.__getitem__) < max(STRENGTHS)


def test_where_no_group_can_be_left_out_the_strongest_ridge_is_taken():
    phi, held = drawn(30)
    assert fitted(shape(), phi, held, ["one"] * 30)[1] == max(STRENGTHS)


@pytest.mark.parametrize("held", [True, False])
def test_trials_that_all_ended_alike_are_refused(held):
    with pytest.raises(InputError, match="some held and some did not"):
        minimum(np.zeros((3, 1)), np.full(3, held), 1.0)
