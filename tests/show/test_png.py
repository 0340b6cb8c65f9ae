"""Pictures: a mesh is drawn with what can be seen of it."""

import numpy as np
import pytest

from sgnlp.base import palette
from sgnlp.perception.synthetic.meshes import unit_sphere
from sgnlp.show.png import MERGED, _merged
from sgnlp.show.scene_parts import HAND, Shape


@pytest.mark.parametrize(("vertices", "dense"), [(500, False), (8000, True)])
def test_a_dense_mesh_is_drawn_with_fewer_triangles_in_its_place(vertices: int, dense: bool):
    mesh = unit_sphere(vertices)
    shape = Shape(HAND, 0.02 * mesh.vertices, mesh.faces, palette.INK)
    drawn = _merged(shape)
    assert (len(drawn.cells) < len(shape.cells) / 2) == dense
    a, b, c = np.moveaxis(drawn.vertices[drawn.cells], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(4 * np.pi * 0.02**2, rel=0.15)
    assert np.linalg.norm((a + b + c) / 3, axis=1).min() > 0.02 - MERGED
