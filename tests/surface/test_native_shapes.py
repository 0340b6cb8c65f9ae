"""The compiled jets of shapes: the numbers of NumPy, values alone where no more is asked for."""

import numpy as np
import pytest
from test_shape_field import FIELD, POINTS

from sgnlp.perception.shape import FAR, Shape
from sgnlp.surface import native
from sgnlp.surface.jets import JET
from sgnlp.surface.native_shapes import NativeShapes, NumpyShapes, shape_jets
from sgnlp.surface.shape_field import MIXING, WIDTH, ShapeField

ROUNDING = 1e-12
"""Of a distance; each derivative divides it by the width of the rounding, or by more."""
KINDS = {
    "box": Shape.box([0.1, 0.0, 0.05], [0.1, 0.2, 0.1], FIELD.shapes[0].rotation),
    "sphere": Shape.sphere([0.0, 0.1, 0.2], 0.04),
    "cylinder": FIELD.shapes[2],
    "rounded cylinder": FIELD.shapes[2].inflated(0.01),
    "table": Shape.half_space([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
}


def taken(jets, points, complete=True):
    found = np.full((len(points), JET), np.nan, order="F")
    jets.into(found, np.asfortranarray(points), complete)
    return found


def same(found, expected):
    """Whether jets differ by the rounding of a distance, magnified as derivatives magnify it."""
    scale = np.repeat([1.0, 1 / WIDTH, 1 / WIDTH**2], [1, 3, 6])
    return (np.abs(found - expected) <= ROUNDING * scale).all()


@pytest.mark.parametrize("name", KINDS)
def test_each_kind_of_shape_has_numpys_jets_at_its_faces_edges_axes_and_inside(library, name):
    field = ShapeField([KINDS[name]])
    centre = KINDS[name].centre
    points = np.concatenate([POINTS, centre + 1e-3 * POINTS, centre + np.diag([0.05, 0.1, 0.05])])
    assert same(taken(NativeShapes(library, field), points), field.jets(points))


def test_the_union_has_numpys_jets_where_shapes_meet(library):
    assert same(taken(NativeShapes(library, FIELD), POINTS), FIELD.jets(POINTS))
    twins = ShapeField([FIELD.shapes[0], FIELD.shapes[0], FIELD.shapes[3]])
    assert same(taken(NativeShapes(library, twins), POINTS), twins.jets(POINTS))
    assert twins.jets(POINTS)[:, 0].min() < -0.04 - MIXING / 2


def test_values_alone_are_the_same_to_the_bit_and_their_derivatives_are_zero(library):
    jets = NativeShapes(library, FIELD)
    complete, values = taken(jets, POINTS), taken(jets, POINTS, complete=False)
    np.testing.assert_array_equal(values[:, 0], complete[:, 0])
    np.testing.assert_array_equal(values[:, 1:], 0.0)


def test_points_and_jets_may_be_parts_of_longer_arrays_and_neighbours_do_not_matter(library):
    jets, points, found = NativeShapes(library, FIELD), np.asfortranarray(POINTS[:30]), np.zeros((30, JET), order="F")
    expected = taken(jets, POINTS[:30])
    jets.into(found[10:15], points[10:15], True)
    np.testing.assert_array_equal(found[10:15], expected[10:15])
    assert not found[:10].any()
    assert not found[15:].any()


@pytest.mark.parametrize("compiled", [True, False])
def test_without_shapes_all_is_far_away_and_stays_there(compiled):
    jets = taken(shape_jets(ShapeField(()), compiled), POINTS[:3])
    np.testing.assert_array_equal(jets[:, 0], FAR)
    np.testing.assert_array_equal(jets[:, 1:], 0.0)


def test_without_a_compiler_the_jets_are_numpys(monkeypatch):
    monkeypatch.setattr(native.CLibrary, "load", lambda self: None)
    jets = shape_jets(FIELD)
    assert isinstance(jets, NumpyShapes)
    np.testing.assert_array_equal(taken(jets, POINTS[:9]), FIELD.jets(POINTS[:9]))


def test_a_point_that_is_not_finite_has_a_jet_that_is_not_finite(library):
    jets = taken(NativeShapes(library, FIELD), np.array([[np.nan, 0.0, 0.0], [0.3, 0.3, 0.3]]))
    assert not np.isfinite(jets[0]).any()
    assert np.isfinite(jets[1]).all()
