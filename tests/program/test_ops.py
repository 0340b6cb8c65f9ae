"""The smooth operations tend to the exact ones, stay finite, and keep their signs."""

import casadi as ca
import numpy as np
import pytest
from finite_differences import assert_jacobian

from sgnlp.program.ops import LOG_CUT, ROUND_NORM, Exact, Smooth

WIDTHS = {
    "distance": 5e-4,
    "collision": 1.5e-3,
    "log_width": 0.02,
    "force": 0.1,
    "deviation": 5e-4,
    "exponent": 30.0,
}
HUGE = np.array([-1e12, -1e6, -1e3, 0.0, 1e3, 1e6, 1e12])


def smooth(factor: float = 1.0) -> Smooth:
    """Smooth operations with all widths times a factor; the exponent saturates later as they fall."""
    exponent = WIDTHS["exponent"] / factor
    return Smooth(**({name: width * factor for name, width in WIDTHS.items()} | {"exponent": exponent}))


def values(name: str, op: Smooth, *arguments: np.ndarray) -> np.ndarray:
    """A smooth operation on numbers."""
    symbols = [ca.SX.sym(f"x{i}", *np.atleast_1d(a).shape) for i, a in enumerate(arguments)]
    return np.array(ca.Function("f", symbols, [getattr(op, name)(*symbols)])(*arguments)).squeeze()


ELEMENTWISE = {
    "abs": (np.array([-0.02, -1e-3, 2e-3, 0.05]),),
    "hinge": (np.array([-0.02, -5e-3, 5e-3, 0.05]),),
    "log": (np.array([0.05, 0.3, 1.0, 30.0]),),
    "least": (np.full(4, 2.0), np.array([0.3, 1.0, 2.5, 9.0])),
    "residual": (np.array([[0.3, -0.2, 0.1], [3.0, 0.0, 4.0], [-1.0, 1.0, 0.0]]),),
    "density": (np.array([-4e-3, 1e-3, 0.0, 6e-3]), np.array([2e-3, 3e-3, 1e-3, 5e-3])),
}


@pytest.mark.parametrize("name", ELEMENTWISE)
def test_a_smooth_form_tends_to_the_exact_one_as_its_width_goes_to_zero(name):
    exact = getattr(Exact(), name)(*ELEMENTWISE[name])
    scale = np.abs(exact).max()
    error = [np.abs(values(name, smooth(f), *ELEMENTWISE[name]) - exact).max() / scale for f in (1, 0.1, 1e-3)]
    assert error[0] > error[1] >= error[2]
    assert error[2] < 2e-4


AT_THEIR_WIDTHS = {
    "abs": lambda d: np.hypot(d, 5e-4),
    "hinge": lambda d: 1.5e-3 * np.logaddexp(0.0, d / 1.5e-3),
    "log": lambda u: np.log((u + np.sqrt(u**2 + 4 * 0.02**2)) / 2),
    "least": lambda bound, f: (bound + f) / 2 - np.hypot(bound - f, 0.1) / 2,
    "residual": lambda A: np.array([np.hypot(np.linalg.norm(a), 0.1) for a in A]),
}


@pytest.mark.parametrize("name", AT_THEIR_WIDTHS)
def test_a_smooth_form_is_the_documented_one_at_its_width(name):
    near = {"abs": (np.array([-1e-3, 0.0, 2e-4]),), "hinge": (np.array([-2e-3, -1e-4, 0.0, 3e-4, 2e-3]),)}
    for arguments in (ELEMENTWISE[name], near.get(name, ELEMENTWISE[name])):
        np.testing.assert_allclose(
            values(name, smooth(), *arguments), AT_THEIR_WIDTHS[name](*arguments), rtol=1e-12, atol=1e-15
        )


def test_norm_dot_square_and_sums_are_the_exact_ones_up_to_their_rounding():
    rng, op, exact = np.random.default_rng(0), smooth(), Exact()
    A, B, x = rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), rng.normal(size=12)
    np.testing.assert_allclose(values("norm", op, A), exact.norm(A), rtol=ROUND_NORM**2 * 10)
    np.testing.assert_allclose(values("dot", op, A, B), exact.dot(A, B))
    np.testing.assert_allclose(values("square", op, A), exact.square(A))
    np.testing.assert_allclose(values("sum", op, A), exact.sum(A))
    f = ca.SX.sym("x", 12)
    fingers = ca.Function("f", [f], [op.fingers(f, 3)])(x)
    np.testing.assert_allclose(np.array(fingers).ravel(), exact.fingers(x, 3))
    np.testing.assert_allclose(exact.fingers(x, 3), [x[:3].sum(), x[3:6].sum(), x[6:9].sum(), x[9:].sum()])


def test_the_exact_forms_are_the_printed_ones():
    op, d = Exact(), np.array([-2.0, 0.0, 0.5])
    np.testing.assert_array_equal(op.abs(d), [2.0, 0.0, 0.5])
    np.testing.assert_array_equal(op.hinge(d), [0.0, 0.0, 0.5])
    np.testing.assert_array_equal(op.least(1.0, np.array([0.3, 3.0])), [0.3, 1.0])
    np.testing.assert_allclose(op.log(np.array([0.5, 2.0])), np.log([0.5, 2.0]))
    np.testing.assert_allclose(op.density(np.array(0.3), np.array(0.2)), np.exp(-1.125) / np.sqrt(2 * np.pi) / 0.2)
    np.testing.assert_allclose(op.norm(np.array([[3.0, 4.0, 0.0]])), [5.0])
    np.testing.assert_allclose(op.residual(np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])), [5.0, 0.0])


def test_the_exact_logarithm_continues_by_its_tangent_and_falls_without_end():
    op = Exact()
    assert op.log(LOG_CUT * (1 - 1e-9)) == pytest.approx(op.log(LOG_CUT * (1 + 1e-9)), abs=1e-8)
    u = np.linspace(-1, 0.1, 50)
    assert (np.diff(op.log(u)) > 0).all()


@pytest.mark.parametrize("name", ["abs", "hinge", "log", "least", "density"])
def test_values_and_derivatives_are_finite_for_huge_arguments(name):
    x = ca.SX.sym("x")
    op = smooth()
    y = {"least": lambda: op.least(2.0, x), "density": lambda: op.density(x, 1e-3)}.get(
        name, lambda: getattr(op, name)(x)
    )()
    H, g = ca.hessian(y, x)
    f = ca.Function("f", [x], [y, g, H])
    for value in HUGE:
        assert np.isfinite([float(v) for v in f(value)]).all(), value


def test_a_density_with_zero_deviation_is_finite():
    assert np.isfinite(values("density", smooth(), np.array([0.0, 0.01]), np.zeros(2))).all()
    assert np.isfinite(Exact().density(np.array([0.0, 0.01]), np.zeros(2))).all()


def test_the_smooth_norm_is_differentiable_at_zero():
    A = ca.SX.sym("A", 1, 3)
    for size in (smooth().norm(A), smooth().residual(A)):
        H, g = ca.hessian(size, A)
        for number in ca.Function("f", [A], [g, H])(np.zeros((1, 3))):
            assert np.isfinite(np.array(number)).all()


@pytest.mark.parametrize("name", ["abs", "hinge", "log", "least", "density"])
def test_a_smooth_form_has_two_continuous_derivatives_also_where_the_exact_one_has_a_kink(name):
    x = ca.SX.sym("x")
    op = smooth()
    y = op.least(0.0, x) if name == "least" else op.density(x, 1e-3) if name == "density" else getattr(op, name)(x)
    H, g = ca.hessian(y, x)
    value, slope, curvature = (ca.Function("f", [x], [e]) for e in (y, g, H))
    for point in (0.0, 1e-4, -1e-4):
        where = np.array([point])
        assert_jacobian(lambda z: float(value(z)), np.array(slope(point)), where, 1e-6, step=2e-5)
        assert_jacobian(lambda z: float(slope(z)), np.array(curvature(point)), where, 1e-6, step=2e-5, floor=1.0)


def test_signs_and_monotony():
    op, d = smooth(), np.linspace(-0.01, 0.01, 41)
    assert (values("hinge", op, d) > 0).all()
    assert (np.diff(values("hinge", op, d)) > 0).all()
    assert (values("abs", op, d) > 0).all()
    assert (np.diff(values("log", op, np.linspace(-1.5, 1, 41))) > 0).all()
    assert (np.diff(values("least", op, np.full(41, 2.0), np.linspace(0, 9, 41))) > 0).all()
    assert (values("least", op, np.full(41, 2.0), np.linspace(0, 9, 41)) < 2.0).all()
    assert values("density", op, np.array(0.0), np.array(1e-3)) > values("density", op, np.array(1e-3), np.array(1e-3))
