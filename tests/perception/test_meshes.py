"""Meshes: volume, centre, closedness, and where they lie."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sgnlp.perception.synthetic.meshes import Mesh

OFFSET = np.array([0.3, -0.2, 0.5])
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
TETRAHEDRON = Mesh(CORNERS + OFFSET, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))


def test_volume_and_centre_of_a_tetrahedron_are_those_of_its_formulas():
    assert TETRAHEDRON.volume == pytest.approx(1 / 6)
    np.testing.assert_allclose(TETRAHEDRON.centroid, TETRAHEDRON.vertices.mean(axis=0))
    inside_out = Mesh(TETRAHEDRON.vertices, TETRAHEDRON.faces[:, ::-1])
    assert inside_out.volume == pytest.approx(-1 / 6)
    np.testing.assert_allclose(inside_out.centroid, TETRAHEDRON.centroid)


def test_volume_and_centre_agree_with_trimesh():
    trimesh = pytest.importorskip("trimesh")
    solid = trimesh.creation.annulus(0.02, 0.05, 0.1)
    mesh = Mesh(np.array(solid.vertices) + OFFSET, np.array(solid.faces))
    assert mesh.volume == pytest.approx(solid.volume)
    np.testing.assert_allclose(mesh.centroid, solid.center_mass + OFFSET)
    assert mesh.open_edges == 0


def test_a_missing_or_turned_or_doubled_face_leaves_open_edges():
    vertices, faces = TETRAHEDRON.vertices, TETRAHEDRON.faces
    assert TETRAHEDRON.open_edges == 0
    assert Mesh(vertices, faces[1:]).open_edges == 3
    assert Mesh(vertices, np.concatenate([faces[:1, ::-1], faces[1:]])).open_edges > 0
    assert Mesh(vertices, np.concatenate([faces[:1], faces])).open_edges > 0


def test_a_soup_of_triangles_is_welded_into_a_closed_mesh():
    soup = Mesh(TETRAHEDRON.vertices[TETRAHEDRON.faces].reshape(-1, 3), np.arange(12).reshape(4, 3))
    assert soup.open_edges == 12
    unused, degenerate = np.array([[9.0, 9.0, 9.0]]), np.array([[0, 0, 1]])
    welded = Mesh(np.concatenate([soup.vertices, unused]), np.concatenate([soup.faces, degenerate])).welded()
    assert (len(welded.vertices), len(welded.faces), welded.open_edges) == (4, 4, 0)
    assert welded.volume == pytest.approx(1 / 6)


def test_a_body_is_turned_about_the_origin_and_stands_on_the_table():
    turn = Rotation.from_euler("zyx", [20, 50, -70], degrees=True)
    turned = TETRAHEDRON.turned(turn.as_quat())
    np.testing.assert_allclose(turned.vertices, turn.apply(TETRAHEDRON.vertices))
    standing = turned.standing([0.3, -0.1])
    low, high = standing.vertices.min(axis=0), standing.vertices.max(axis=0)
    assert low[2] == pytest.approx(0, abs=1e-15)
    np.testing.assert_allclose((low + high)[:2] / 2, [0.3, -0.1])
    np.testing.assert_allclose(standing.vertices - standing.vertices[0], turned.vertices - turned.vertices[0])
