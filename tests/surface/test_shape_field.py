"""The smooth distance to several shapes: near the exact one, with exact derivatives, in every kind of place."""

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from finite_differences import jacobian

from sgnlp.perception.shape import FAR, Shape
from sgnlp.surface.gpis import PAIRS
from sgnlp.surface.shape_field import MIXING, WIDTH, ShapeField

TURN = pin.exp3(np.array([0.3, -0.5, 0.8]))
SHAPES = (
    Shape.box([0.1, 0.0, 0.05], [0.1, 0.2, 0.1], TURN),
    Shape.sphere([0.0, 0.1, 0.2], 0.04),
    Shape.cylinder([-0.1, -0.1, 0.1], 0.05, 0.2, TURN),
    Shape.half_space([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
)
FIELD = ShapeField(SHAPES)
POINTS = np.random.default_rng(0).uniform(-0.25, 0.25, (2000, 3))
STEP = 2e-5
"""[m] of differences: a hundredth of the roundings' width."""


def symbolic(shapes, point: ca.SX) -> ca.SX:
    """The smooth distance as a CasADi expression, written from its formula alone."""

    def positive(q):
        return (q + ca.sqrt(q * q + WIDTH**2)) / 2

    each = []
    for s in shapes:
        u = ca.mtimes(s.rotation.T, point - s.centre)
        root = [ca.sqrt(u[i] ** 2 + WIDTH**2) for i in range(3)]
        q = [root[i] - s.half[i] for i in range(3)]
        if s.circular:
            q = [ca.sqrt(u[0] ** 2 + u[1] ** 2 + WIDTH**2) - s.half[0], -FAR, q[2]]
        m = MIXING * ca.logsumexp(ca.vertcat(*q) / MIXING)
        outside = ca.sqrt(sum(positive(x) ** 2 for x in q) + WIDTH**2)
        each.append(outside - positive(-m) - s.radius)
    return -MIXING * ca.logsumexp(-ca.vertcat(*each) / MIXING)


def hessians(jets: np.ndarray) -> np.ndarray:
    H = np.empty((len(jets), 3, 3))
    for i, (a, b) in enumerate(PAIRS):
        H[:, a, b] = H[:, b, a] = jets[:, 4 + i]
    return H


def test_a_centimetre_away_the_smooth_distance_is_the_exact_one_within_the_tolerance_of_a_clearance():
    exact, smooth = FIELD.distance(POINTS), FIELD.jets(POINTS)[:, 0]
    away = exact > 0.01
    assert away.sum() > 500
    assert (smooth - exact)[away].max() < 3e-4
    assert (smooth - exact)[away].min() > -2 * MIXING


def test_it_is_never_far_from_the_exact_one_inside_either():
    exact, smooth = FIELD.distance(POINTS), FIELD.jets(POINTS)[:, 0]
    assert (exact < 0).sum() > 500
    assert np.abs(smooth - exact).max() < 2.5 * WIDTH


def test_jets_are_those_of_casadis_own_differentiation():
    x = ca.SX.sym("x", 3)
    value = symbolic(SHAPES, x)
    H, g = ca.hessian(value, x)
    twin = ca.Function("twin", [x], [value, g, H])
    jets = FIELD.jets(POINTS[:300])
    for point, jet, bend in zip(POINTS[:300], jets, hessians(jets), strict=True):
        v, slope, curve = (np.array(part) for part in twin(point))
        assert jet[0] == pytest.approx(v.item(), abs=1e-12)
        np.testing.assert_allclose(jet[1:4], slope.ravel(), atol=1e-9)
        np.testing.assert_allclose(bend, curve, atol=1e-6 * max(1.0, np.abs(curve).max()))


def test_derivatives_match_differences():
    for point in POINTS[:40]:
        jet = FIELD.jets(point[None])
        slope = jacobian(lambda y: FIELD.jets(y[None])[0, 0], point, STEP)
        curve = jacobian(lambda y: FIELD.jets(y[None])[0, 1:4], point, STEP)
        np.testing.assert_allclose(jet[0, 1:4], slope, atol=1e-8)
        np.testing.assert_allclose(hessians(jet)[0], curve, atol=1e-5 * max(1.0, np.abs(curve).max()))


def test_the_gradient_has_unit_length_away_from_edges_and_points_out_of_the_shape():
    box = ShapeField([Shape.box([0.0, 0.0, 0.0], [0.1, 0.1, 0.1])])
    jets = box.jets(np.array([[0.08, 0.0, 0.0], [0.04, 0.0, 0.0], [0.1, 0.1, 0.1]]))
    np.testing.assert_allclose(jets[:2, 1:4], [[1, 0, 0], [1, 0, 0]], atol=0.02)
    np.testing.assert_allclose(jets[2, 1:4], np.ones(3) / np.sqrt(3), atol=0.01)


def test_far_shapes_have_no_part_in_a_point_and_their_order_none_either():
    near = ShapeField(SHAPES[:1]).jets(np.array([[0.1, 0.0, 0.12]]))
    far = Shape.sphere([1.0, 1.0, 1.0], 0.1)
    np.testing.assert_array_equal(ShapeField([SHAPES[0], far]).jets(np.array([[0.1, 0.0, 0.12]])), near)
    np.testing.assert_allclose(ShapeField(SHAPES[::-1]).jets(POINTS), FIELD.jets(POINTS), atol=1e-9)


def test_without_shapes_all_is_far_away():
    empty = ShapeField(())
    np.testing.assert_array_equal(empty.distance(POINTS[:3]), FAR)
    np.testing.assert_array_equal(empty.jets(POINTS[:3])[:, 1:], 0.0)
    assert empty.nearest(POINTS[:3]) == []


def test_the_nearest_shape_is_told_by_name():
    assert FIELD.nearest(np.array([[0.1, 0.0, 0.15], [0.0, 0.1, 0.3]])) == ["box", "sphere"]
