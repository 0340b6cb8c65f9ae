"""One posterior, three times: in NumPy, in CasADi and in C, with derivatives against CasADi's own and differences."""

import casadi as ca
import numpy as np
import pytest
from finite_differences import jacobian
from scenes import sphere_points, surface
from wendland import Wendland, WendlandInFull

from sgnlp.surface import native
from sgnlp.surface.gpis import MEAN_JET, MIN_SLOPE, PAIRS, TRIPLES, VARIANCE_JET, Gpis
from sgnlp.surface.kernels import KERNELS
from sgnlp.surface.symbolic import Posterior

KINDS = [*KERNELS.values(), Wendland, WendlandInFull]
Jets = tuple[np.ndarray, np.ndarray]


def queries(gpis: Gpis, count: int) -> np.ndarray:
    """Points of the ball in which the model holds."""
    return gpis.centre + 0.7 * gpis.radius * sphere_points(count, 1) * np.linspace(0.1, 1, count)[:, None]


def in_numpy(gpis: Gpis, Z: np.ndarray) -> Jets:
    return gpis.mean_jet(Z), gpis.variance_jet(Z)


def in_casadi(gpis: Gpis, Z: np.ndarray) -> Jets:
    x = ca.MX.sym("x", *Z.shape)
    posterior = Posterior(gpis, x)
    mean, variance = ca.Function("jets", [x], [posterior.mean_jet(), posterior.variance_jet()])(Z)
    return np.array(mean), np.array(variance)


def in_c(gpis: Gpis, Z: np.ndarray) -> Jets:
    jets = native.raw_jets(gpis, len(Z))
    mean, variance = np.full((len(Z), MEAN_JET), np.nan), np.full((len(Z), VARIANCE_JET), np.nan)
    jets.values(np.asfortranarray(Z), mean, variance)
    jets.derivatives(np.asfortranarray(Z), mean, variance)
    return mean, variance


def by_casadis_differentiation(gpis: Gpis, Z: np.ndarray) -> Jets:
    """The jets from μ and σ² alone, and so from k alone."""
    x = ca.MX.sym("x", 1, 3)
    posterior = Posterior(gpis, x)
    H, g = ca.hessian(posterior.mean(), x)
    V, w = ca.hessian(posterior.variance(), x)
    blocks = [posterior.mean(), g, H, ca.jacobian(ca.vec(H), x), posterior.variance(), w, V]
    every = ca.Function("every", [x], [ca.densify(block) for block in blocks])
    mean, variance = [], []
    for z in Z:
        m, g, H, T, v, w, V = (np.array(block) for block in every(z))
        T = T.reshape(3, 3, 3)
        mean.append([m.item(), *g.ravel(), *[H[pair] for pair in PAIRS], *[T[triple] for triple in TRIPLES]])
        variance.append([v.item(), *w.ravel(), *[V[pair] for pair in PAIRS]])
    return np.array(mean), np.array(variance)


def by_differences(gpis: Gpis, Z: np.ndarray) -> Jets:
    """The jets whose derivatives are differences of those of one order less."""
    mean, variance = [], []
    for z in Z:
        dJ = jacobian(lambda y: gpis.mean_jet(y[None])[0, :10], z, step=1e-4)  # each of value, gradient, second
        dV = jacobian(lambda y: gpis.variance_jet(y[None])[0, :4], z, step=1e-4)
        second, third = [dJ[1 + a, b] for a, b in PAIRS], [dJ[4 + PAIRS.index((a, b)), c] for a, b, c in TRIPLES]
        mean.append([gpis.mean(z[None])[0], *dJ[0], *second, *third])
        variance.append([gpis.deviation(z[None])[0] ** 2, *dV[0], *[dV[1 + a, b] for a, b in PAIRS]])
    return np.array(mean), np.array(variance)


def assert_near(found: Jets, expected: Jets, tolerance: float) -> None:
    for one, other in zip(found, expected, strict=True):
        scale = np.abs(other).max(axis=0) + np.abs(other).max(axis=0).max() * 1e-9
        np.testing.assert_allclose(one / scale, other / scale, rtol=0, atol=tolerance)


@pytest.mark.parametrize("count", [24, 61])  # training points that fill the panels of the C source, and that do not
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_numpy_casadi_and_c_give_the_same_values_and_derivatives(kind, count):
    gpis = surface(kind, count)
    Z = queries(gpis, 19)
    expected = in_numpy(gpis, Z)
    assert_near(by_casadis_differentiation(gpis, Z[::3]), tuple(jets[::3] for jets in expected), 1e-8)
    assert_near(by_differences(gpis, Z[::6]), tuple(jets[::6] for jets in expected), 1e-5)
    far = gpis.centre + np.array([0.0, 0.0, 3 * gpis.kernel.support_radius])
    Z[5], Z[6] = gpis.X[3], far
    expected = in_numpy(gpis, Z)
    for twin in (in_casadi, in_c):
        assert_near(twin(gpis, Z), expected, 1e-9)
    slope = np.sqrt((expected[0][:, 1:4] ** 2).sum(axis=1) + MIN_SLOPE**2)
    deviation = np.sqrt(np.maximum(expected[1][:, 0], 0))
    near = {"rtol": 1e-10, "atol": 1e-12}
    np.testing.assert_allclose(gpis.mean(Z), expected[0][:, 0], **near)
    np.testing.assert_allclose(gpis.gradient(Z), expected[0][:, 1:4], **near)
    np.testing.assert_allclose(gpis.normal(Z), expected[0][:, 1:4] / slope[:, None], **near)
    np.testing.assert_allclose(gpis.deviation(Z), deviation, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(gpis.distance(Z), expected[0][:, 0] / slope, **near)
    np.testing.assert_allclose(gpis.distance_deviation(Z), deviation / slope, rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_the_c_source_takes_the_kernels_that_it_knows_and_numpy_the_others(kind):
    if native.LIBRARY.load() is None:
        pytest.skip("no C compiler")
    known = isinstance(native.raw_jets(surface(kind, 24), 1), native.NativeJets)
    assert known == (kind in KERNELS.values())
