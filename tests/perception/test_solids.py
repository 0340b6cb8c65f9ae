"""Meshes as they come from files: what is mended, what is one body, and what is refused."""

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.perception.synthetic.meshes import Mesh, box, unit_sphere
from sgnlp.perception.synthetic.scenes import body

CUBE = box([0.06, 0.06, 0.06])
BALL = Mesh(0.03 * unit_sphere(300).vertices, unit_sphere(300).faces)
CM3 = 1e-6


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes in one."""
    begin = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + first for mesh, first in zip(meshes, begin[:-1], strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def sized(scale: float, shift=(0, 0, 0)) -> Mesh:
    """The cube, scaled and moved."""
    return Mesh(scale * CUBE.vertices + np.array(shift), CUBE.faces)


def made(mesh: Mesh, scale: float = 1.0) -> tuple[Mesh, str]:
    """The body of a mesh, and its notes as one text."""
    found, notes = body(mesh.vertices, mesh.faces, scale)
    return found, " ".join(notes)


@pytest.mark.parametrize("jitter", [1e-9, 1e-7])
def test_corners_that_differ_by_rounding_are_welded(jitter: float):
    corners = BALL.vertices[BALL.faces].reshape(-1, 3)
    corners = corners + np.random.default_rng(0).normal(0, jitter, corners.shape)
    mesh, notes = made(Mesh(corners, np.arange(len(corners)).reshape(-1, 3)))
    assert (mesh.open_edges, len(mesh.vertices)) == (0, 300)
    assert mesh.volume == pytest.approx(BALL.volume, rel=1e-4)
    assert "Corners within 6e-06 m of each other were welded" in notes


def test_a_mesh_finer_than_the_welding_is_left_open():
    side = np.linspace(0, 0.06, 30) ** 3  # steps far below the welding near the corner
    x, y = (g.ravel() for g in np.meshgrid(side, side))
    dome = np.stack([x, y, np.sqrt(x + y)], axis=1)
    i = (np.arange(29)[:, None] * 30 + np.arange(29)).ravel()
    faces = np.concatenate([np.stack([i, i + 1, i + 31], axis=1), np.stack([i, i + 31, i + 30], axis=1)])
    mesh, notes = made(Mesh(dome, faces))
    assert len(mesh.faces) == len(faces)
    assert "not watertight" in notes


@pytest.mark.parametrize(
    ("other", "volume", "said"),
    [
        (
            sized(0.5),
            216.0,
            "60 x 60 x 60 mm, 30 x 30 x 30 mm. They overlap; their union is taken, of 216.0",
        ),
        (sized(1.0, (0.03, 0.001, 0)), 325.8, "They overlap; their union is taken, of 325.8 cm³"),
        (sized(0.8, (0.1, 0, 0)), 326.592, "two bodies, 60 x 60 x 60 mm, 48 x 48 x 48 mm, 326.6 cm³ together"),
        (sized(0.5).inverted(), 189.0, ""),
        (sized(0.8, (0.1, 0, 0)).inverted(), 326.592, "The faces turned inwards; they were turned over."),
    ],
    ids=["nested", "overlapping", "apart", "cavity", "one inside out"],
)
def test_no_volume_of_several_bodies_counts_twice(other: Mesh, volume: float, said: str):
    mesh, notes = made(joined(CUBE, other))
    assert mesh.open_edges == 0
    assert mesh.volume == pytest.approx(volume * CM3, rel=1e-6)
    assert said in notes
    assert bool(notes) == bool(said)


def test_a_mesh_inside_out_and_its_cavity_are_turned_over_together():
    mesh, notes = made(joined(CUBE, sized(0.5).inverted()).inverted())
    assert mesh.volume == pytest.approx(189.0 * CM3)
    assert notes == "The faces turned inwards; they were turned over."


def test_a_wide_slab_under_a_body_is_told():
    slab = Mesh(CUBE.vertices * [4, 4, 0.1] + [0, 0, -0.033], CUBE.faces)
    assert "the lowest looks like a table" in made(joined(CUBE, slab))[1]


@pytest.mark.parametrize("turned", [slice(0, 1), slice(0, 12, 3)])
def test_faces_that_turn_against_their_neighbours_are_turned_over(turned: slice):
    faces = CUBE.faces.copy()
    faces[turned] = faces[turned, ::-1]
    mesh, notes = made(Mesh(CUBE.vertices, faces))
    assert (mesh.open_edges, mesh.volume) == (0, pytest.approx(216 * CM3))
    assert "Some faces turned against their neighbours" in notes


@pytest.mark.parametrize("again", [CUBE.faces, CUBE.faces[:1], CUBE.faces[:, ::-1]])
def test_faces_that_are_there_twice_count_once(again: np.ndarray):
    mesh, notes = made(Mesh(CUBE.vertices, np.concatenate([CUBE.faces, again])))
    assert (mesh.open_edges, abs(mesh.volume)) == (0, pytest.approx(216 * CM3))
    assert "Faces that were there twice were left out." in notes


def test_a_wall_between_two_boxes_goes():
    beside = Mesh(CUBE.vertices * [-1, 1, 1] + np.array([0.06, 0, 0]), CUBE.faces).inverted()
    mesh, _ = made(joined(CUBE, beside))
    assert mesh.open_edges == 0
    assert mesh.volume == pytest.approx(432 * CM3)


def test_a_good_mesh_stays_as_it_is():
    mesh, notes = made(BALL)
    welded = BALL.welded()
    np.testing.assert_array_equal(mesh.vertices, welded.vertices)
    np.testing.assert_array_equal(mesh.faces, welded.faces)
    assert notes == ""


def test_vertices_of_no_face_may_be_anything():
    assert made(Mesh(np.vstack([CUBE.vertices, np.full(3, np.nan)]), CUBE.faces))[0].volume == pytest.approx(216 * CM3)


CORNERS = np.array([[-0.3, -0.3, -0.03], [0.3, -0.3, -0.03], [0.3, 0.3, -0.03], [-0.3, 0.3, -0.03]])
FLOOR = Mesh(CORNERS, np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (Mesh(CUBE.vertices + np.array([694386.2, 5155487.5, 381]), CUBE.faces), "lies too far from the origin"),
        (Mesh(np.where(np.arange(8)[:, None] == 3, np.nan, CUBE.vertices), CUBE.faces), "1 of its 8 vertices are NaN"),
        (
            Mesh(CUBE.vertices, np.vstack([CUBE.faces, [[0, 1, 20]]])),
            "a face has the corner 20: 'mesh_faces' must",
        ),
        (joined(CUBE, FLOOR), "a flat part 0.6 m wide beside a body of 0.06 m, as of a floor or table"),
        (FLOOR, "is flat"),
    ],
    ids=["far", "not finite", "no such vertex", "floor", "flat"],
)
def test_what_is_no_body_is_refused(mesh: Mesh, message: str):
    with pytest.raises(InputError, match=message):
        made(mesh)
