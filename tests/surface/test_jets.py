"""Jets: Taylor polynomials of the surface, and the metric quantities made of them."""

from itertools import product

import casadi as ca
import numpy as np
import pytest
from scenes import sphere_points, surface

from sgnlp.surface.gpis import MEAN_JET, MIN_SLOPE, PAIRS, TRIPLES, VARIANCE_JET
from sgnlp.surface.jets import JET, SINGLES, Layout, expand, metric, polynomial
from sgnlp.surface.kernels import KERNELS
from sgnlp.surface.symbolic import Posterior


def test_a_polynomial_is_the_taylor_series_of_its_coefficients():
    rng = np.random.default_rng(0)
    value, g, H, T = rng.normal(), rng.normal(size=3), rng.normal(size=(3, 3)), rng.normal(size=(3, 3, 3))
    H = H + H.T
    T = sum(T.transpose(order) for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)))
    J = ca.DM([value, *g, *[H[p] for p in PAIRS], *[T[t] for t in TRIPLES]])
    delta = rng.normal(size=3)
    found = polynomial(ca.SX(J), ca.SX(ca.DM(delta)), (SINGLES, PAIRS, TRIPLES))
    expected = value + g @ delta + delta @ H @ delta / 2
    expected += sum(T[i, j, k] * delta[i] * delta[j] * delta[k] for i, j, k in product(range(3), repeat=3)) / 6
    assert float(ca.DM(found)) == pytest.approx(expected, rel=1e-12)


def test_an_expansion_has_the_value_and_both_derivatives_of_its_jets_at_zero():
    jets, delta = ca.SX.sym("jets", 2, JET), ca.SX.sym("delta", 2, 3)
    y = expand(jets, delta)
    blocks = [ca.hessian(y[q], delta[q, :]) for q in range(2)]
    f = ca.Function("f", [jets, delta], [y, *[b for pair in blocks for b in pair]])
    numbers = np.random.default_rng(1).normal(size=(2, JET))
    value, *derivatives = (np.array(a) for a in f(numbers, np.zeros((2, 3))))
    np.testing.assert_allclose(value.ravel(), numbers[:, 0])
    for q in range(2):
        H, g = derivatives[2 * q], derivatives[2 * q + 1]
        np.testing.assert_allclose(g.ravel(), numbers[q, 1:4])
        np.testing.assert_allclose([H[p] for p in PAIRS], numbers[q, 4:])
        np.testing.assert_allclose(H, H.T)


def jet(y: ca.MX, x: ca.MX) -> ca.MX:
    """Value, gradient and the six second derivatives by CasADi's own differentiation."""
    H, g = ca.hessian(y, x)
    return ca.vertcat(y, g, *[H[p] for p in PAIRS])


def metric_jets(J, V) -> list[ca.DM]:
    """Jets of d, of the three n, and of d and σ_d² together."""
    functions = metric()
    return [functions["distance"](J), functions["normal"](J), *functions["distance_variance"](J, V)]


@pytest.mark.parametrize("name", sorted(KERNELS))
def test_metric_jets_equal_plain_differentiation_of_the_metric_quantities(name):
    gpis = surface(KERNELS[name], 24)
    x = ca.MX.sym("x", 3)
    posterior = Posterior(gpis, x.T)
    mean, gradient, variance = posterior.mean(), posterior.gradient(), posterior.variance()
    slope = ca.sqrt(ca.sumsqr(gradient) + MIN_SLOPE**2)
    plain = [mean / slope, *[gradient[a] / slope for a in range(3)], mean / slope, variance / slope**2]
    expected = ca.Function("expected", [x], [jet(y, x) for y in plain])
    Z = gpis.centre + 0.08 * sphere_points(6, 2)
    for z, J, V in zip(Z, gpis.mean_jet(Z), gpis.variance_jet(Z), strict=True):
        found = np.concatenate([np.array(block).ravel() for block in metric_jets(J, V)])
        truth = np.concatenate([np.array(block).ravel() for block in expected(z)])
        for i in range(6):
            part = slice(JET * i, JET * (i + 1))
            np.testing.assert_allclose(found[part], truth[part], rtol=1e-7, atol=1e-8 * np.abs(truth[part]).max())


def test_at_a_ridge_where_the_slope_vanishes_everything_is_finite():
    for block in metric_jets(np.zeros(MEAN_JET), np.zeros(VARIANCE_JET)):
        assert np.isfinite(np.array(block)).all()


def test_the_layout_counts_its_points_and_gives_each_kind_its_jets():
    layout, gpis = Layout(m=3, K=4, S=5), surface()
    Q, V = layout.points, layout.uncertain
    assert (Q, V, layout.distances) == (3 + 12 + 5 + 3 + 3, 3 + 12, 3 + 12 + 5 + 3)
    Z = gpis.centre + 0.06 * sphere_points(Q, 0)
    J, W = gpis.mean_jet(Z), gpis.variance_jet(Z[:V])
    distance, variance, normal, mean = (np.array(block) for block in layout.function()(J.T, W.T))
    assert [block.shape for block in layout.symbols()] == [a.shape for a in (distance, variance, normal, mean)]
    np.testing.assert_allclose(distance[:, 0], gpis.distance(Z[:-3]), rtol=1e-3)
    np.testing.assert_allclose(np.sqrt(variance[:, 0]), gpis.distance_deviation(Z[:V]), rtol=1e-3)
    np.testing.assert_allclose(normal[:, ::JET], gpis.normal(Z[:3]), atol=1e-3)
    np.testing.assert_allclose(mean[:, 0], gpis.mean(Z[-3:]), rtol=1e-12)
    np.testing.assert_allclose(mean[:, 1:4], gpis.gradient(Z[-3:]), rtol=1e-10, atol=1e-12)
