"""Residuals of the optimality conditions: zero at an optimum made by hand, and not zero anywhere else."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from sgnlp.planning.kkt import SCALE_LIMIT, residuals

# min (x - 3)² + (y - p)²  subject to  x + y ≤ 2 (active),  x - y ≥ -10 (inactive),  y ≥ 1/2 (active),  p = 0:
# x = 3/2, y = 1/2; λ_g = 3 on the first row and λ_y = 2 y + 3 = 4 pushes up from the lower bound, so it is negative.
X, P = np.array([1.5, 0.5]), np.array([0.0])
X_BOUNDS = np.array([-np.inf, 0.5]), np.array([np.inf, 10.0])
G_BOUNDS = np.array([-np.inf, -10.0]), np.array([2.0, np.inf])
MULTIPLIERS = np.array([0.0, -4.0]), np.array([3.0, 0.0])


@pytest.fixture(scope="module")
def oracle():
    return made()


def made():
    x, p = ca.MX.sym("x", 2), ca.MX.sym("p")
    f = (x[0] - 3) ** 2 + (x[1] - p) ** 2
    g = ca.vertcat(x[0] + x[1], x[0] - x[1])
    return SimpleNamespace(
        gradient=ca.Function("gradient", [x, p], [f, ca.gradient(f, x)]),
        jacobian=ca.Function("jacobian", [x, p], [g, ca.jacobian(g, x)]),
    )


def check(oracle, x=X, lam_x=MULTIPLIERS[0], lam_g=MULTIPLIERS[1]):
    return residuals(oracle, np.asarray(x, float), P, (np.asarray(lam_x), np.asarray(lam_g)), X_BOUNDS, G_BOUNDS)


def test_all_residuals_are_zero_at_the_optimum(oracle):
    assert check(oracle).worst < 1e-15


@pytest.mark.parametrize(
    ("lam_x", "lam_g"), [([0, -3.9], [3, 0]), ([0, 4.0], [3, 0]), ([0, -4], [2.9, 0]), ([0.1, -4], [3, 0])]
)
def test_a_wrong_multiplier_shows_in_the_dual_residual(oracle, lam_x, lam_g):
    kkt = check(oracle, lam_x=lam_x, lam_g=lam_g)
    assert kkt.dual >= 0.1 - 1e-12
    assert kkt.primal == 0.0


def test_the_worst_residual_is_named():
    names = ("x", "y", "sum", "difference")

    def where(x=X, lam_g=MULTIPLIERS[1]):
        return residuals(functions, np.array(x), P, (MULTIPLIERS[0], np.array(lam_g)), X_BOUNDS, G_BOUNDS, names).where

    functions = made()
    assert where(lam_g=[3, -0.1]) == "difference"
    assert where(lam_g=[3.1, 0]) in ("x", "y")
    assert where(x=[-12, 1]) in ("sum", "difference", "x")


def test_a_multiplier_on_an_inactive_row_shows_in_the_complementarity(oracle):
    kkt = check(oracle, lam_g=[3, -0.1])
    assert kkt.complementarity == pytest.approx(0.1 * 11)


def test_a_multiplier_that_pushes_from_a_bound_that_does_not_exist_shows(oracle):
    assert check(oracle, lam_g=[-3, 0]).complementarity == 3.0
    assert check(oracle, lam_x=[0.2, -4]).complementarity == 0.2


def test_an_infeasible_point_shows_in_the_primal_residual(oracle):
    assert check(oracle, x=[1.75, 0.5]).primal == pytest.approx(0.25)
    assert check(oracle, x=[1.5, 0.2]).primal == pytest.approx(0.3)
    assert check(oracle, x=[-11, 0.5]).primal == pytest.approx(1.5)


def test_a_feasible_point_that_is_not_optimal_has_no_multipliers_that_hide_it(oracle):
    kkt = check(oracle, x=[1.0, 0.5])
    assert kkt.primal == 0.0
    assert kkt.worst > 0.5


def test_large_multipliers_scale_dual_and_complementarity_down_but_never_the_primal(oracle):
    huge = 1e3 * SCALE_LIMIT
    kkt = check(oracle, x=[1.75, 0.5], lam_g=[huge, 0])
    mean = (huge + 4) / 4
    assert kkt.complementarity == pytest.approx(huge * 0.25 / (mean / SCALE_LIMIT))
    assert kkt.primal == pytest.approx(0.25)


def test_the_worst_residual_is_the_largest_of_the_three(oracle):
    kkt = check(oracle, x=[1.75, 0.5])
    assert kkt.worst == max(kkt.dual, kkt.primal, kkt.complementarity)
