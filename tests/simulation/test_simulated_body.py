"""The true object: closed, convex in pieces, refused where it is no body."""

import sys
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("coacd")

from grips import box, cylinder, sphere
from scipy.spatial import Delaunay

from sgnlp.base.errors import InputError
from sgnlp.perception.observation import observe
from sgnlp.simulation import body, true_body
from sgnlp.simulation.pieces import pieces

CUBE = box(0.06, 0.06, 0.06)


def within(thing):
    """Points (200, 3) in the box of a body."""
    return np.random.default_rng(0).uniform(thing.vertices.min(axis=0), thing.vertices.max(axis=0), (200, 3))


def bracket():
    """An L of three cubes of 3 cm, one vertex a corner: 12 corners in the plane, twice."""
    outline = 0.03 * np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    points = np.concatenate([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 0.03)])
    cap = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    sides = [((i, (i + 1) % 6, (i + 1) % 6 + 6), (i, (i + 1) % 6 + 6, i + 6)) for i in range(6)]
    down, up = [(a, c, b) for a, b, c in cap], [(a + 6, b + 6, c + 6) for a, b, c in cap]
    return body(points, [*down, *up, *(triangle for pair in sides for triangle in pair)])


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "sgnlp"


@pytest.mark.parametrize(
    ("thing", "volume"),
    [
        (CUBE, 0.06**3),
        (bracket(), 3 * 0.03**3),
        (cylinder(), np.pi * 0.033**2 * 0.08),
        (sphere(), 4 / 3 * np.pi * 0.035**3),
    ],
    ids=["cube", "bracket", "cylinder", "sphere"],
)
def test_the_volume_is_that_of_the_shape(thing, volume):
    assert thing.volume == pytest.approx(volume, rel=0.02)


def test_a_convex_body_is_one_piece_and_needs_no_cache(cache):
    (piece,) = pieces(CUBE, 0.002)
    assert len(piece) == 8
    assert not cache.exists()


def test_the_pieces_of_a_bracket_are_the_bracket():
    thing = bracket()
    hulls = [Delaunay(piece) for piece in pieces(thing, 0.002)]
    rng = np.random.default_rng(0)
    points = rng.uniform(0, [0.06, 0.06, 0.03], (2000, 3))
    inside = np.any([hull.find_simplex(points) >= 0 for hull in hulls], axis=0)
    expected = (points[:, 0] < 0.03) | (points[:, 1] < 0.03)
    near = np.abs(points[:, :2] - 0.03).min(axis=1) < 0.002
    assert len(hulls) > 1
    np.testing.assert_array_equal(inside[~near], expected[~near])


def test_a_body_that_must_be_cut_is_refused_where_coacd_is_missing_and_a_convex_one_is_not(cache, monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(InputError, match=r"is not convex; to cut it: pip install 'sgnlp\[sim\]', CoACD is missing"):
        pieces(bracket(), 0.002)
    assert len(pieces(CUBE, 0.002)) == 1


def test_pieces_are_kept_and_read_again(cache, monkeypatch):
    first = pieces(bracket(), 0.002)
    assert len(list(cache.glob("pieces-*.npz"))) == 1
    monkeypatch.setattr("coacd.run_coacd", None)
    again = pieces(bracket(), 0.002)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))


def test_what_is_not_closed_is_refused():
    with pytest.raises(InputError, match="not closed"):
        body(CUBE.vertices, CUBE.faces[1:])


def test_what_is_inside_out_is_refused():
    with pytest.raises(InputError, match="counter-clockwise"):
        body(CUBE.vertices, CUBE.faces[:, ::-1])


def test_faces_of_missing_vertices_are_refused():
    with pytest.raises(InputError, match=r"must lie in 0\.\.4"):
        body(CUBE.vertices[:5], CUBE.faces)


def test_arrays_of_another_shape_are_refused():
    with pytest.raises(InputError, match=r"'mesh_faces' must be an array of integers of shape \(N, 3\)"):
        body(CUBE.vertices, CUBE.faces.ravel())


def test_an_observation_brings_its_surface_and_its_table():
    seen = observe(
        within(CUBE) + np.array([0, 0, 0.01]),
        table_height=0.01,
        mesh_vertices=CUBE.vertices,
        mesh_faces=CUBE.faces,
        name="cube",
    )
    assert (true_body(seen).table_height, true_body(seen).name) == (0.01, "cube")
    np.testing.assert_array_equal(true_body(seen).vertices, CUBE.vertices)
    with pytest.raises(InputError, match="'cube' has no true surface"):
        true_body(replace(seen, mesh_faces=None))


@pytest.mark.parametrize(
    ("moved", "said"),
    [
        (lambda vertices: 1000 * vertices, "is 10.. times as large as its cloud; the mesh must be in metres"),
        (lambda vertices: vertices + np.array([0.2, 0, 0]), "reaches 0.20 m beyond its true surface"),
        (lambda vertices: vertices + np.array([0, 0, 0.1]), "reaches 0.10 m beyond its true surface"),
        (lambda vertices: 0.001 * vertices, "beyond its true surface; the mesh must be in metres"),
        (lambda vertices: vertices * 0.5 + np.array([0, 0, 0.015]), "is 0.5.* times as large as its cloud"),
    ],
)
def test_a_surface_that_is_not_where_the_cloud_is_is_refused(moved, said):
    seen = observe(within(CUBE), mesh_vertices=CUBE.vertices, mesh_faces=CUBE.faces, name="cube")
    with pytest.raises(InputError, match=said):
        true_body(replace(seen, mesh_vertices=moved(CUBE.vertices)))
