"""How bodies come to rest."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from box import BOX
from scipy.spatial.transform import Rotation

from sgnlp.base.errors import InputError
from sgnlp.perception.synthetic import settling
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.settling import DROP, random_orientation, settled

SLAB = Mesh(BOX.vertices * [1.0, 1.5, 0.5], BOX.faces)


def down(quaternion: np.ndarray) -> np.ndarray:
    """The direction of gravity (3,) in the body's frame."""
    return Rotation.from_quat(quaternion).inv().apply([0, 0, -1])


@pytest.fixture(autouse=True)
def mujoco():
    return pytest.importorskip("mujoco")


def test_a_tilted_slab_falls_flat_and_an_upright_one_stays():
    for tilt, face in [(0, [0, 0, -1]), (25, [0, 0, -1]), (88, [1, 0, 0]), (90, [1, 0, 0])]:
        rest = settled(SLAB, Rotation.from_euler("y", tilt, degrees=True).as_quat())
        assert np.linalg.norm(rest) == pytest.approx(1)
        assert np.degrees(np.arccos(np.clip(down(rest) @ face, -1, 1))) < 0.1


def test_a_body_stands_if_its_centre_of_mass_is_above_its_base():
    faces = np.array([[0, 2, 1], [1, 2, 3], [0, 1, 4], [1, 3, 4], [3, 2, 4], [2, 0, 4]])
    for lean, stands in [(0.06, True), (0.1, False)]:  # [m] of the apex of a pyramid
        pyramid = Mesh(np.concatenate([BOX.vertices[:4] / 2, [[lean, 0, 0.1]]]), faces)
        assert pyramid.open_edges == 0
        assert (pyramid.centroid[0] < 0.02) == stands  # where the base ends
        rest = settled(pyramid, [0.0, 0.0, 0.0, 1.0])
        assert (down(rest)[2] < -0.999) == stands


def test_the_same_drop_ends_the_same_and_a_rest_is_a_rest():
    start = random_orientation(np.random.default_rng(4))
    rest = settled(SLAB, start)
    np.testing.assert_array_equal(rest, settled(SLAB, start))
    again = settled(SLAB, rest, replace(DROP, height=1e-4))
    assert (Rotation.from_quat(again) * Rotation.from_quat(rest).inv()).magnitude() < np.deg2rad(0.2)


def test_a_body_that_is_still_moving_has_no_rest():
    assert settled(SLAB, [0.0, 0.0, 0.0, 1.0], replace(DROP, timeout=0.01)) is None


def test_an_open_mesh_settles_as_its_hull(mujoco):
    lidless = Mesh(SLAB.vertices, SLAB.faces[np.r_[:2, 4:12]])
    rest = settled(lidless, Rotation.from_euler("x", 20, degrees=True).as_quat())
    assert down(rest)[2] == pytest.approx(-1, abs=1e-4)
    model = settling._model(mujoco, lidless, DROP)
    np.testing.assert_allclose(model.body_ipos[1], SLAB.centroid, atol=1e-6)


def test_orientations_are_drawn_evenly():
    rng = np.random.default_rng(0)
    turned = np.array([down(random_orientation(rng)) for _ in range(4000)])
    np.testing.assert_allclose(turned.mean(axis=0), 0, atol=0.04)
    np.testing.assert_allclose(turned.T @ turned / 4000, np.eye(3) / 3, atol=0.02)


def test_without_mujoco_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r"needs MuJoCo: pip install 'sgnlp\[sim\]'"):
        settled(SLAB, [0.0, 0.0, 0.0, 1.0])


def test_what_is_no_solid_is_refused():
    for thickness in (0.0, 1e-9):
        with pytest.raises(InputError, match="the mesh is no solid to settle"):
            settled(Mesh(SLAB.vertices * [1, 1, thickness], SLAB.faces), [0.0, 0.0, 0.0, 1.0])
