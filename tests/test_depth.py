"""Depth images as clouds: geometry, the table around the object, files, and every bad input in one clear line."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sgnlp
from sgnlp.cameras import DepthCamera, image, looking_at
from sgnlp.cli import codes, run
from sgnlp.depth import DepthImage, arrays, from_depth
from sgnlp.errors import InputError
from sgnlp.meshes import Mesh

CAMERA = DepthCamera(width=160, height=120)
K = CAMERA.intrinsics
TARGET = np.array([0.0, 0.0, 0.04])
CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]) - [0.5, 0.5, 0.0]
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
BOX = Mesh(0.08 * CORNERS, np.array([[a, b, c] for p, q, r, s in SIDES for a, b, c in ((p, q, r), (p, r, s))]))


def seen(position: tuple[float, float, float]) -> DepthImage:
    """The box on the table z = 0, from a position, without any error."""
    R = looking_at(np.array(position), TARGET)
    shot = image(BOX, np.array(position), CAMERA.rays() @ R.T)
    pose = np.block([[R, np.array(position)[:, None]], [np.zeros(3), 1.0]])
    return DepthImage(shot.depth, shot.body, K, pose)


FRONT, BACK = seen((0.4, -0.2, 0.4)), seen((-0.4, 0.1, 0.5))


def test_a_pixel_lies_where_the_camera_that_projects_it_would_see_it():
    rng = np.random.default_rng(0)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.random(random_state=0).as_matrix(), rng.normal(size=3)
    shot = DepthImage(rng.uniform(0.3, 0.9, (120, 160)), np.ones((120, 160), bool), K, pose)
    world = shot.points()
    camera = (world - pose[:3, 3]) @ pose[:3, :3]
    np.testing.assert_allclose(camera[..., 2], shot.depth, atol=1e-12)
    projected = camera @ K.T
    v, u = np.indices((120, 160))
    np.testing.assert_allclose(projected[..., :2] / projected[..., 2:], np.stack([u, v], axis=-1), atol=1e-9)


def test_the_marked_pixels_are_the_surface_of_the_box():
    points = FRONT.points()[FRONT.mask]
    assert len(points) > 300
    sides = np.abs(np.column_stack([points[:, :2] - 0.04, points[:, :2] + 0.04, points[:, 2] - 0.08]))
    assert sides.min(axis=1).max() < 1e-6


def test_two_images_are_two_views_and_the_table_is_measured_around_the_object():
    lifted = [replace(i, pose=i.pose + np.outer([0, 0, 1, 0], [0, 0, 0, 0.3])) for i in (FRONT, BACK)]
    observation = from_depth(lifted, name="box")
    assert observation.view_names == ("0", "1")
    assert observation.table_height == pytest.approx(0.3)
    np.testing.assert_allclose(observation.camera_positions, [[0.4, -0.2, 0.7], [-0.4, 0.1, 0.8]])
    assert observation.notes[0].startswith("Measured the table at 0.3000 m, the median height of ")
    assert from_depth(lifted, table_height=0.29).table_height == 0.29
    assert len(arrays(lifted)["points"]) == FRONT.mask.sum() + BACK.mask.sum()


def test_without_pixels_around_the_object_the_table_is_left_to_the_cloud():
    bare = replace(FRONT, depth=np.where(FRONT.mask, FRONT.depth, 0.0))
    assert "table_height" not in arrays([bare])
    assert any(note.startswith("Assumed the table") for note in from_depth(bare).notes)


def test_what_was_not_measured_is_no_point():
    depth = FRONT.depth.copy()
    first, second, third = np.argwhere(FRONT.mask)[:3]
    depth[tuple(first)], depth[tuple(second)], depth[tuple(third)] = 0, np.nan, np.inf
    assert len(arrays([replace(FRONT, depth=depth)])["points"]) == FRONT.mask.sum() - 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mask": np.ones((3, 3))}, r"the mask must have the shape of the depth image, \(120, 160\); found \(3, 3\)"),
        ({"intrinsics": np.eye(4)}, "'intrinsics' must be an array of real numbers of shape"),
        ({"intrinsics": -np.eye(3)}, "the intrinsics must be"),
        ({"pose": np.diag([1.0, 1, -1, 1])}, "the pose must be"),
        ({"pose": 2 * np.eye(4)}, "the pose must be"),
        ({"unit": 0.0}, "the unit of the depths must be a positive number of metres; found 0.0"),
        ({"depth": np.zeros((120, 160))}, "no depth was measured at any marked pixel of the image '0'"),
        ({"unit": 0.001}, "m wide, less than 0.01 m"),
    ],
)
def test_a_bad_image_is_refused_in_one_line(change, message):
    with pytest.raises(InputError, match=message):
        from_depth(replace(FRONT, **change))
    with pytest.raises(InputError, match="no depth image is given"):
        from_depth([])


@pytest.fixture
def files(tmp_path, monkeypatch) -> Path:
    """Both images as the files of the command."""
    monkeypatch.chdir(tmp_path)
    o3d = pytest.importorskip("open3d")
    for i, shot in enumerate((FRONT, BACK)):
        depth = np.where(np.isfinite(shot.depth), np.round(shot.depth / 1e-4), 0).astype(np.uint16)
        assert o3d.io.write_image(f"depth_{i}.png", o3d.geometry.Image(depth))
        assert o3d.io.write_image(f"mask_{i}.png", o3d.geometry.Image(np.where(shot.mask, 255, 0).astype(np.uint8)))
        Path(f"camera_{i}.json").write_text(
            json.dumps({"K": K.ravel().tolist(), "pose": shot.pose.tolist()}), encoding="utf-8"
        )
    return tmp_path


def cloud(*more: str) -> int:
    names = [[f"{kind}_{i}.{suffix}" for i in (0, 1)] for kind, suffix in (("mask", "png"), ("camera", "json"))]
    files = ["depth_0.png", "depth_1.png", "--masks", *names[0], "--cameras", *names[1]]
    return run(["cloud", *files, "--unit", "0.0001", *more])


def test_the_command_writes_the_cloud_that_the_images_show(files, capfd):
    assert cloud("--out", "box.npz") == codes.FEASIBLE
    assert (
        f"box: points from each view: {FRONT.mask.sum()}, {BACK.mask.sum()}\nwritten: box.npz" in capfd.readouterr().out
    )
    observation = sgnlp.load("box.npz")
    assert (observation.name, observation.view_names, observation.table_height) == ("box", ("0", "1"), 0.0)
    exact = arrays([FRONT, BACK])["points"]
    np.testing.assert_allclose(np.load("box.npz")["points"], exact, atol=1e-4)


def test_a_depth_in_metres_is_read_from_npy(files):
    np.save("depth_0.npy", FRONT.depth)
    arguments = ["depth_0.npy", "--masks", "mask_0.png", "--cameras", "camera_0.json", "--unit", "1"]
    assert run(["cloud", *arguments]) == codes.FEASIBLE
    np.testing.assert_allclose(np.load("object.npz")["points"], FRONT.points()[FRONT.mask], atol=1e-12)


@pytest.mark.parametrize(
    ("broken", "content", "message"),
    [
        ("camera_0.json", b"{}", "camera_0.json: the key 'K' is missing; a camera has K and pose"),
        ("camera_0.json", b"K", "camera_0.json: is not the JSON of a camera"),
        ("camera_0.json", b'{"K": [1, 2], "pose": 0}', "camera_0.json: 'K' must be an array of real numbers"),
        ("depth_1.png", b"no image", "depth_1.png: is a damaged .png file"),
        ("depth_1.png", None, "depth_1.png: there is no such file"),
    ],
)
def test_a_bad_file_is_told_in_one_line(files, capfd, broken, content, message):
    Path(broken).unlink()
    if content is not None:
        Path(broken).write_bytes(content)
    assert cloud() == codes.BAD_INPUT
    error = capfd.readouterr().err
    assert error.startswith(f"error: {message}")
    assert len(error.splitlines()) == 1
    assert not Path("object.npz").exists()


def test_every_image_needs_a_mask_and_a_camera(files, capfd):
    assert run(["cloud", "depth_0.png", "--masks", "mask_0.png", "--cameras"]) != codes.FEASIBLE
    assert run(["cloud", "depth_0.png", "depth_1.png", "--masks", "mask_0.png", "--cameras", "camera_0.json"]) == 3
    assert "found 2 images, 1 masks and 1 cameras" in capfd.readouterr().err
