"""The chain rule through lifted quantities equals plain differentiation of the substituted expression."""

import casadi as ca
import numpy as np
import pytest

from sgnlp.program.lifting import Lifting

NX = 4


def build(x: ca.SX, p: ca.SX, lift, constant) -> tuple[ca.SX, ca.SX]:
    """A nest of definitions of different shapes, some of them used after others, one constant: (parts, rows)."""
    a = lift("a", ca.vertcat(ca.sin(x[0] * x[1]), x[2] ** 2 + p[0], ca.exp(0.3 * x[3])))
    B = lift("B", ca.horzcat(a * x[0], ca.cos(a), ca.cumsum(a) * p[1]))  # (3, 3)
    c = constant("c", ca.sum1(ca.vec(B)) + x[1])
    d = lift("d", B @ a + c * x[:3] ** 2)
    parts = ca.vertcat(ca.dot(d, a) + x[3] ** 3, ca.sumsqr(B) * ca.sin(c + x[0]), p[1] * d[1] * x[2], ca.SX(2.0))
    rows = ca.vertcat(d, ca.log(1 + ca.sumsqr(a)), x[0] * c, B[2, 1])
    return parts, rows


@pytest.fixture(scope="module")
def both():
    """Functions of (x, p) through a chain, and of (x, p, c) by plain differentiation with c held constant."""
    x, p, c = ca.SX.sym("x", NX), ca.SX.sym("p", 2), ca.SX.sym("c")
    chain = Lifting(x)
    parts, rows = build(x, p, chain.lift, chain.constant)
    energy = ca.sum1(parts)
    split = [parts[i] for i in range(parts.numel())]
    outputs = [parts, rows, chain.gradient(energy), chain.jacobian(rows), chain.hessian(split)]
    lifted = ca.Function("lifted", [x, p], chain.values(outputs))

    kept: list[ca.SX] = []

    def hold(name: str, definition: ca.SX) -> ca.SX:
        kept.append(definition)
        return c

    parts, rows = build(x, p, lambda name, definition: definition, hold)
    H, g = ca.hessian(ca.sum1(parts), x)
    plain = ca.Function("plain", [x, p, c], [parts, rows, g, ca.jacobian(rows, x), H])
    return lifted, plain, ca.Function("held", [x, p], kept)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("i", range(5), ids=["scalars", "rows", "gradient", "jacobian", "hessian"])
def test_through_the_chain_everything_equals_plain_differentiation(both, seed, i):
    lifted, plain, held = both
    rng = np.random.default_rng(seed)
    x, p = rng.normal(size=NX), rng.normal(size=2)
    found, expected = np.array(lifted(x, p)[i]), np.array(plain(x, p, held(x, p))[i])
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)


def test_a_constant_has_its_value_but_no_derivative():
    x = ca.SX.sym("x")
    chain = Lifting(x)
    c = chain.constant("c", x**2)
    f = ca.Function("f", [x], chain.values([c * x, chain.gradient(c * x), chain.hessian([c * x])]))
    np.testing.assert_allclose([float(v) for v in f(3.0)], [27.0, 9.0, 0.0])


def test_a_displacement_is_zero_and_has_the_derivatives_of_what_it_stands_for():
    x = ca.SX.sym("x", 2)
    chain = Lifting(x)
    delta = chain.displacement("moved", x**2)
    f = ca.Function("f", [x], chain.values([delta, chain.jacobian(delta), chain.hessian([delta[0], 3 * delta[1]])]))
    value, J, H = (np.array(found) for found in f([2.0, -1.0]))
    np.testing.assert_array_equal(value, 0.0)
    np.testing.assert_array_equal(J, np.diag([4.0, -2.0]))
    np.testing.assert_array_equal(H, np.diag([2.0, 6.0]))


def test_derivatives_are_those_of_the_slope_and_values_those_of_the_value():
    x = ca.SX.sym("x")
    chain = Lifting(x)
    at = chain.displacement("moved", x)
    u = chain.lift("u", ca.exp(x), ca.exp(1.0) * (1 + at + at**2 / 2))  # the same at 1, to second order
    f = ca.Function("f", [x], chain.values([u**2, chain.gradient(u**2), chain.hessian([u**2])]))
    np.testing.assert_allclose([float(v) for v in f(1.0)], np.exp(2.0) * np.array([1, 2, 4]), rtol=1e-14)


@pytest.mark.parametrize("late", [(), ("a",), ("B",), ("d",), ("a", "d"), ("a", "B", "d")], ids=str)
def test_the_order_of_folding_changes_no_derivative(both, late):
    x, p = ca.SX.sym("x", NX), ca.SX.sym("p", 2)
    chain = Lifting(x)
    parts, rows = build(x, p, lambda name, value: chain.lift(name, value, late=name in late), chain.constant)
    outputs = [chain.jacobian(rows), chain.hessian([parts[i] for i in range(parts.numel())])]
    f = ca.Function("f", [x, p], chain.values(outputs))
    rng = np.random.default_rng(1)
    x, p = rng.normal(size=NX), rng.normal(size=2)
    for found, expected in zip(f(x, p), both[0](x, p)[3:], strict=True):
        np.testing.assert_allclose(np.array(found), np.array(expected), rtol=1e-12, atol=1e-12)


def test_the_hessian_does_not_depend_on_how_a_sum_is_split_into_parts(both):
    x = ca.SX.sym("x", NX)
    chain = Lifting(x)
    u = chain.lift("u", ca.sin(x) * x[::-1])
    parts = [ca.sumsqr(u), u[0] * x[1] ** 2, ca.exp(u[3])]
    whole = ca.Function("f", [x], chain.values([chain.hessian(parts), chain.hessian([sum(parts)])]))
    a, b = whole(np.arange(1.0, 5.0))
    np.testing.assert_allclose(np.array(a), np.array(b), rtol=1e-13, atol=1e-13)


def test_a_gradient_has_a_number_for_each_variable_whatever_it_depends_on():
    x = ca.SX.sym("x", 3)
    assert Lifting(x).gradient(x[1] ** 2).is_dense()


def test_without_lifted_quantities_it_is_casadis_own_differentiation():
    x = ca.SX.sym("x", 3)
    chain = Lifting(x)
    f = ca.Function("f", [x], chain.values([chain.gradient(ca.sumsqr(x)), chain.hessian([ca.sumsqr(x)])]))
    g, H = f([1.0, 2.0, 3.0])
    np.testing.assert_array_equal(np.array(g).ravel(), [2, 4, 6])
    np.testing.assert_array_equal(np.array(H), 2 * np.eye(3))
