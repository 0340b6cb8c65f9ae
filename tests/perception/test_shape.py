"""Convex shapes: exact distances against nearest points that are sought, wrong ones refused."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear, minimize

from sgnlp.base.errors import InputError
from sgnlp.perception.shape import Shape

TURN = pin.exp3(np.array([0.3, -0.5, 0.8]))
SHAPES = {
    "box": Shape.box([0.1, 0.0, 0.05], [0.1, 0.2, 0.06], TURN),
    "sphere": Shape.sphere([0.0, 0.1, 0.2], 0.04),
    "cylinder": Shape.cylinder([-0.1, -0.1, 0.1], 0.05, 0.2, TURN),
    "rounded box": Shape.box([0.0, 0.0, 0.1], [0.05, 0.05, 0.1], TURN).inflated(0.01),
}
coordinate = st.floats(-0.3, 0.3)


def nearest(shape: Shape, point: np.ndarray) -> float:
    """How far a point outside is from the shape, by a search over the points of the shape in its own frame."""
    u = shape.local(point[None])[0]
    if shape.circular:
        bounds = [(-shape.half[0], shape.half[0])] * 2 + [(-shape.half[2], shape.half[2])]
        within = {"type": "ineq", "fun": lambda v: 1e3 * (shape.half[0] ** 2 - v[0] ** 2 - v[1] ** 2)}
        start, options = np.zeros(3), {"bounds": bounds, "constraints": [within], "tol": 1e-14}
        found = minimize(lambda v: 1e2 * ((v - u) ** 2).sum(), start, **options)
    else:
        half = np.array(shape.half) + 1e-9  # [m]: lower bounds are to be below upper ones, for a sphere too
        found = lsq_linear(np.eye(3), u, (-half, half), tol=1e-14)
    return float(np.linalg.norm(found.x - u)) - shape.radius


@pytest.mark.parametrize("name", SHAPES)
@settings(max_examples=25, deadline=None, derandomize=True)
@given(point=st.tuples(coordinate, coordinate, coordinate))
def test_the_distance_outside_is_that_to_the_nearest_point(name, point):
    shape, place = SHAPES[name], np.array(point)
    sought, found = nearest(shape, place), float(shape.distance(place[None])[0])
    if sought > 1e-3:
        assert found == pytest.approx(sought, abs=2e-5)
    else:
        assert found < 2e-3


def test_the_distance_inside_is_the_depth_below_the_nearest_face():
    box = Shape.box([0.0, 0.0, 0.0], [0.1, 0.2, 0.3])
    inside = box.distance(np.array([[0.04, 0.0, 0.0], [0.0, -0.07, 0.0], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(inside, [-0.01, -0.03, -0.05], atol=1e-12)
    tube = Shape.cylinder([0.0, 0.0, 0.0], 0.05, 0.3)
    np.testing.assert_allclose(
        tube.distance(np.array([[0.0, 0.03, 0.0], [0.0, 0.0, 0.14]])), [-0.02, -0.01], atol=1e-12
    )


def test_a_half_space_is_all_behind_its_plane():
    normal = np.array([1.0, 2.0, 2.0]) / 3
    half = Shape.half_space([0.1, 0.0, 0.0], [1.0, 2.0, 2.0])
    P = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3))
    np.testing.assert_allclose(half.distance(P), (P - [0.1, 0.0, 0.0]) @ normal, atol=1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_moved_and_inflated_shapes_keep_their_distances(name):
    shape, by = SHAPES[name], np.array([0.3, -0.2, 0.1])
    P = np.random.default_rng(1).uniform(-0.3, 0.3, (20, 3))
    np.testing.assert_allclose(shape.moved(by).distance(P + by), shape.distance(P), atol=1e-12)
    np.testing.assert_allclose(shape.inflated(0.01).distance(P), shape.distance(P) - 0.01, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Shape.box([0, 0, 0], [0.1, 0.0, 0.1], name="crate"), "the size of 'crate' must be three positive"),
        (lambda: Shape.box([0, 0], [0.1, 0.1, 0.1]), "the centre of 'box' must be three numbers"),
        (lambda: Shape.box([0, 0, np.nan], [0.1, 0.1, 0.1]), "the centre of 'box' must be three numbers"),
        (lambda: Shape.box([0, 0, 0], [0.1] * 3, 2 * np.eye(3)), "the rotation of 'box' must be a rotation matrix"),
        (lambda: Shape.box([0, 0, 0], [0.1] * 3, "z"), "the rotation of 'box' must be a rotation matrix"),
        (lambda: Shape.box([0, 0, 0], [0.1] * 3, -np.eye(3)), "the rotation of 'box' must be a rotation matrix"),
        (lambda: Shape.sphere([0, 0, 0], -0.1), "the radius of 'sphere' must be a positive number"),
        (lambda: Shape.cylinder([0, 0, 0], 0.1, np.inf), "the height of 'cylinder' must be a positive number"),
        (lambda: Shape.half_space([0, 0, 0], [0, 0, 0]), "the normal of 'half-space' must not be 0"),
    ],
)
def test_what_is_no_shape_is_refused_by_its_name(make, said):
    with pytest.raises(InputError, match=said):
        make()
