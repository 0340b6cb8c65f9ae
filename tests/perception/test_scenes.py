"""A body on the table, seen by the cameras around it."""

from dataclasses import replace

import numpy as np
import pytest
from box import BOX

from sgnlp.base.errors import InputError
from sgnlp.perception.observation import observe
from sgnlp.perception.synthetic.cameras import DepthCamera
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.scenes import RING, Ring, body, scene

NORMALS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])  # of the sides but the bottom
HEIGHTS = np.array([0.04, 0.04, 0.04, 0.04, 0.08])  # [m] of the sides along their normals
TRUTH = {"mass": 0.2, "friction": 0.7}


def seen(mesh: Mesh = BOX, seed: int = 0, **options: object) -> dict[str, np.ndarray]:
    return scene(mesh, "box", np.random.default_rng(seed), **TRUTH, **options)


def nearest_side(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The side (n,) of the box that each point is nearest to, and its signed distance (n,) [m] from it."""
    distance = points @ NORMALS.T - HEIGHTS
    side = np.abs(distance).argmin(axis=1)
    return side, np.take_along_axis(distance, side[:, None], axis=1)[:, 0]


def test_the_cameras_stand_evenly_around_the_target_within_their_limits():
    target = np.array([0.1, -0.2, 0.05])
    offsets = np.concatenate([RING.positions(3, target, np.random.default_rng(k)) - target for k in range(200)])
    distance = np.linalg.norm(offsets, axis=1)
    elevation = np.degrees(np.arcsin(offsets[:, 2] / distance))
    assert (distance.min(), distance.max()) == (pytest.approx(0.5, abs=0.002), pytest.approx(0.6, abs=0.002))
    assert (elevation.min(), elevation.max()) == (pytest.approx(40, abs=0.2), pytest.approx(50, abs=0.2))
    azimuth = np.degrees(np.arctan2(offsets[:, 1], offsets[:, 0])).reshape(-1, 3)
    np.testing.assert_allclose(azimuth, np.broadcast_to([-10, 110, -130], (200, 3)))


def test_the_arrays_are_those_of_a_problem_and_an_observation_takes_them():
    arrays = seen(views=2)
    assert arrays["points"].dtype == np.float32
    assert np.bincount(arrays["view"]).tolist() == [RING.points] * 2
    assert arrays["camera_positions"].shape == (2, 3)
    np.testing.assert_allclose(arrays["mesh_vertices"], BOX.vertices, atol=1e-7)
    np.testing.assert_array_equal(arrays["mesh_faces"], BOX.faces)
    observation = observe(**arrays | {"name": "box", "mass": 0.2, "friction": 0.7})
    assert observation.view_names == ("0", "1")
    assert (observation.mass, observation.friction, observation.table_height) == (0.2, 0.7, 0)


def test_the_same_generator_gives_the_same_arrays_and_another_others():
    one, same, other = seen(), seen(), seen(seed=1)
    assert all(one[key].tobytes() == same[key].tobytes() for key in one)
    assert one["points"].tobytes() != other["points"].tobytes()
    assert one["mesh_vertices"].tobytes() == other["mesh_vertices"].tobytes()


def test_each_camera_sees_the_sides_that_face_it_down_to_the_crop():
    arrays = seen(camera=replace(DepthCamera(), flying_share=0.0))
    assert arrays["points"][:, 2].min() == pytest.approx(RING.crop, abs=5e-4)
    for number, position in enumerate(arrays["camera_positions"]):
        points = arrays["points"][arrays["view"] == number]
        side, distance = nearest_side(points)
        assert np.quantile(np.abs(distance), 0.99) < 0.005
        facing = NORMALS @ position > 0.04
        assert facing.sum() >= 2
        assert np.mean(facing[side]) > 0.99  # noise takes a few across an edge


def test_calibration_errors_move_each_view_as_a_whole():
    ring = Ring(shift_min=0.003, shift_max=0.003, turn_deg=0.0, azimuth_deg=-45.0)
    arrays = seen(ring=ring, views=2, camera=replace(DepthCamera(), subpixel_error=0.0, flying_share=0.0))
    shifts = []
    for number in range(2):
        side, distance = nearest_side(arrays["points"][arrays["view"] == number])
        seen_sides = np.flatnonzero(np.bincount(side, minlength=len(NORMALS)) > 300)
        assert len(seen_sides) == 3
        shifts.append(sum(np.median(distance[side == k]) * NORMALS[k] for k in seen_sides))
    np.testing.assert_allclose(np.linalg.norm(shifts, axis=1), 0.003, rtol=0.03)
    assert np.linalg.norm(shifts[0] - shifts[1]) > 0.0005


@pytest.mark.parametrize(
    ("size", "message"),
    [
        (10.0, r"1.386 m from corner to corner, and the images hold 0.33 m; is it in inches \(--scale 0.0254\)"),
        (0.1, r"0.008 m wide, less than 0.01 m; is its unit the metre\?"),
    ],
)
def test_a_body_that_is_too_large_or_small_is_refused(size, message):
    with pytest.raises(InputError, match=message):
        seen(Mesh(BOX.vertices * size, BOX.faces))


def test_a_body_below_the_crop_is_refused():
    with pytest.raises(InputError, match="camera 0 measures nothing of the body above the table"):
        seen(ring=Ring(crop=0.1))


def test_a_sound_mesh_is_a_body_as_it_is():
    mesh, notes = body(BOX.vertices, BOX.faces)
    assert notes == []
    assert mesh.volume == pytest.approx(0.08**3)


def test_whatever_is_assumed_of_a_mesh_is_noted():
    mesh, notes = body(BOX.vertices * 1000, BOX.faces[:, ::-1], scale=0.001)
    assert mesh.volume == pytest.approx(0.08**3)
    assert notes == ["Multiplied all coordinates by 0.001.", "The faces turned inwards; they were turned over."]
    mesh, notes = body(BOX.vertices, BOX.faces[1:])
    assert mesh.open_edges == 3
    assert notes[1:] == ["A grasp of it can be planned, but not simulated."]
    assert notes[0].startswith("The mesh is not watertight, 3 of its edges do not join two faces")


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (BOX.vertices * [1, 1, 0], BOX.faces, "is flat"),
        (BOX.vertices, BOX.faces * 0, "no triangle with three different corners"),
        (BOX.vertices, BOX.faces + 1, "'mesh_faces' must lie in 0..7"),
        (BOX.vertices * np.nan, BOX.faces, "8 of its 8 vertices are NaN or infinite"),
    ],
)
def test_what_is_no_body_is_refused(vertices, faces, message):
    with pytest.raises(InputError, match=message):
        body(vertices, faces)


def test_a_ring_out_of_range_is_refused():
    with pytest.raises(InputError, match=r"--ring\.elevation-max-deg must be between 1 and 89"):
        Ring(elevation_max_deg=90.0)
    with pytest.raises(InputError, match=r"--ring\.distance-min is above --ring\.distance-max: 0\.7 > 0\.6"):
        Ring(distance_min=0.7)
