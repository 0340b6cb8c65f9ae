"""The true surface: signed distances and samples of a mesh against an analytic sphere and a box."""

import numpy as np
import pytest
from scenes import sphere_points

from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import signed_distance, surface_samples

RADIUS = 0.05
CORNERS = np.array([[x, y, z] for x in (0, 2) for y in (0, 1) for z in (0, 3)], dtype=float)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
FACES = np.array([face for a, b, c, d in QUADS for face in ((a, b, c), (a, c, d))])
BOX = Mesh(CORNERS, FACES)


def sphere(rings: int = 120) -> Mesh:
    """A watertight sphere with its vertices on the surface."""
    polar = np.pi * np.arange(1, rings) / rings
    around = 2 * np.pi * np.arange(2 * rings) / (2 * rings)
    ring = np.stack(np.broadcast_arrays(*np.meshgrid(polar, around, indexing="ij")), axis=-1).reshape(-1, 2)
    body = np.stack(
        [np.sin(ring[:, 0]) * np.cos(ring[:, 1]), np.sin(ring[:, 0]) * np.sin(ring[:, 1]), np.cos(ring[:, 0])]
    )
    vertices = RADIUS * np.vstack([body.T, [[0, 0, 1], [0, 0, -1]]])
    n = 2 * rings
    faces = []
    for j in range(n):
        k = (j + 1) % n
        faces += [[len(vertices) - 2, j, k], [len(vertices) - 1, (rings - 2) * n + k, (rings - 2) * n + j]]
        for i in range(rings - 2):
            faces += [[i * n + j, (i + 1) * n + j, (i + 1) * n + k], [i * n + j, (i + 1) * n + k, i * n + k]]
    return Mesh(vertices, np.array(faces))


def test_the_signed_distance_is_that_of_the_sphere():
    pytest.importorskip("open3d")
    scales = np.random.default_rng(1).uniform(0.1, 2.5, 400)
    points = RADIUS * scales[:, None] * sphere_points(400, 0)
    found = signed_distance(sphere(), points)
    assert np.abs(found - RADIUS * (scales - 1)).max() < 2e-5  # the facets are 17 µm inside
    assert (found < 0).any()
    assert (found > 0).any()


def test_the_signed_distance_of_a_box_is_exact_at_faces_edges_and_corners():
    pytest.importorskip("open3d")
    points = np.array([[1, 0.5, 3.5], [1, 0.25, 1], [-3, -4, 1], [3, 2, 4], [1, 0.5, 1.5]])
    assert signed_distance(BOX, points) == pytest.approx([0.5, -0.25, 5, np.sqrt(3), -0.5], abs=1e-6)


def test_samples_lie_on_the_surface_and_their_normals_point_out():
    points, normals = surface_samples(BOX, 2000, np.random.default_rng(0))
    walls = np.stack([-points, points - CORNERS.max(axis=0)])  # (2, Q, 3) signed distances to the six walls
    assert np.abs(walls.max(axis=(0, 2))).max() < 1e-12
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1)
    assert (np.abs((np.stack([-normals, normals]) * (np.abs(walls) < 1e-12)).sum(axis=(0, 2)) - 1) < 1e-9).all()


def test_samples_are_spread_by_area():
    points, normals = surface_samples(BOX, 20_000, np.random.default_rng(0))
    shares = [(np.abs(normals[:, i]) > 0.5).mean() for i in range(3)]
    assert shares == pytest.approx([3 / 11, 6 / 11, 2 / 11], abs=0.01)
    top = points[normals[:, 2] > 0.5]
    assert top[:, :2].mean(axis=0) == pytest.approx([1, 0.5], abs=0.03)
    assert top[:, :2].var(axis=0) == pytest.approx([4 / 12, 1 / 12], rel=0.06)
