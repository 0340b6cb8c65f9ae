"""Depth images as clouds: geometry, the table around the object, files, and every bad input in one clear line."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from archives import unpacked
from PIL import Image
from scipy.spatial.transform import Rotation

import sgnlp
from sgnlp.base.errors import InputError
from sgnlp.cli import codes, run
from sgnlp.perception.depth import DepthImage, arrays, from_depth
from sgnlp.perception.synthetic.cameras import DepthCamera, image, looking_at
from sgnlp.perception.synthetic.meshes import Mesh

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
    found = arrays(lifted)
    assert len(found["points"]) == FRONT.mask.sum() + BACK.mask.sum()
    assert np.unique(found["background_view"]).tolist() == [0, 1]
    np.testing.assert_allclose(found["background"][:, 2], 0.3, atol=1e-9)  # the table beside the box
    np.testing.assert_array_equal(observation.background, found["background"])


def test_one_image_as_two_views_is_refused_and_noted_where_the_poses_differ():
    copy = replace(FRONT, name="copy")
    with pytest.raises(InputError, match="two views, '0' and 'copy', are the same, number by number; give each once"):
        from_depth([FRONT, copy])
    notes = arrays([FRONT, replace(copy, pose=BACK.pose)])["notes"]
    assert "Two views, '0' and 'copy', are the same, number by number. If the scene" in notes[0]


def test_poses_that_are_those_of_other_images_are_refused():
    with pytest.raises(
        InputError, match=r"the poses of the images '0' and '1' are swapped: .* exchanged tilted by 0.0"
    ):
        from_depth([replace(FRONT, pose=BACK.pose), replace(BACK, pose=FRONT.pose)])
    with pytest.raises(
        InputError, match=r"'0' and '1' have one pose, but \d+% of their pixels differ by more than 20 mm"
    ):
        from_depth([FRONT, replace(BACK, pose=FRONT.pose)])
    again = FRONT.depth + np.random.default_rng(0).normal(0, 0.002, FRONT.depth.shape)  # a second shot from one place
    assert len(arrays([FRONT, replace(FRONT, depth=again)])["notes"]) == 1
    low = FRONT.pose - np.outer([0, 0, 1, 0], [0, 0, 0, 0.1])  # one pose is wrong, which exchanging does not mend
    assert any("was measured at" in note for note in arrays([replace(FRONT, pose=low), BACK])["notes"])


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
        ({"pose": np.diag([1.0, 1, -1, 1])}, "the pose must be .*; this one mirrors"),
        ({"pose": np.diag([2.0, 2, 2, 1])}, "the pose must be .*; this one scales by 2"),
        ({"pose": np.diag([2.0, 1, 1, 1])}, "the pose must be .* camera to world$"),
        ({"pose": 2 * np.eye(4)}, "the pose must be"),
        ({"unit": 0.0}, "the unit of the depths must be a positive number of metres; found 0.0"),
        ({"depth": np.zeros((120, 160))}, "no depth was measured at any marked pixel of the image '0'"),
        ({"unit": 0.001}, "in units of 0.001 m the object is 0.0005.* --unit 1 would make it 0.55 m"),
        ({"unit": 1000.0}, "in units of 1000 m the object is 5.* --unit 1 would make it 0.55 m"),
        ({"depth": np.zeros((120, 160, 3))}, "the depths are a picture of 3 channels"),
        ({"depth": -FRONT.depth}, "all depths are negative, as OpenGL's z is: give their absolute values"),
        ({"depth": np.ma.masked_array(FRONT.depth, True)}, "no depth was measured at any marked pixel"),
        ({"mask": np.ma.masked_array(FRONT.mask, FRONT.mask)}, "'pixels of the mask' has masked entries"),
        ({"intrinsics": K.T}, "the intrinsics are transposed: cx and cy belong into the last column"),
        ({"intrinsics": K / [[160], [120], [1]]}, "the intrinsics give a field of view of 1.. deg, more than 150"),
        ({"pose": FRONT.pose.T}, "the pose is transposed: its translation belongs into the last column"),
        ({"pose": FRONT.pose[:3, :3]}, "'pose' must be an array of real numbers of shape"),
        ({"mask": np.zeros((120, 160), bool)}, "the mask of the image '0' marks no pixel"),
        ({"mask": ~FRONT.mask}, r"the mask marks 9.% of the pixels and 100% of the image's edges: it is inverted"),
        ({"depth": np.round(FRONT.depth / 0.02) * 0.02}, "the depths come in steps of 20 mm, more than 17 mm"),
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
    for i, shot in enumerate((FRONT, BACK)):
        depth = np.where(np.isfinite(shot.depth), np.round(shot.depth / 1e-4), 0).astype(np.uint16)
        Image.fromarray(depth).save(f"depth_{i}.png")
        Image.fromarray(np.where(shot.mask, 255, 0).astype(np.uint8)).save(f"mask_{i}.png")
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
    counts = f"points from each view: {FRONT.mask.sum()}, {BACK.mask.sum()}"
    assert f"box: {counts}\nwritten: box.npz" in capfd.readouterr().out
    observation = sgnlp.load("box.npz")
    assert (observation.name, observation.view_names, observation.table_height) == ("box", ("0", "1"), 0.0)
    exact = arrays([FRONT, BACK])["points"]
    np.testing.assert_allclose(unpacked("box.npz")["points"], exact, atol=1e-4)


def test_a_depth_in_metres_is_read_from_npy(files):
    np.save("depth_0.npy", FRONT.depth)
    arguments = ["depth_0.npy", "--masks", "mask_0.png", "--cameras", "camera_0.json", "--unit", "1"]
    assert run(["cloud", *arguments]) == codes.FEASIBLE
    np.testing.assert_allclose(unpacked("object.npz")["points"], FRONT.points()[FRONT.mask], atol=1e-12)


@pytest.mark.parametrize(
    ("broken", "content", "message"),
    [
        ("camera_0.json", b"{}", "camera_0.json: the key 'K' is missing; a camera has K and pose"),
        ("camera_0.json", b"K", "camera_0.json: is not the JSON or YAML of a camera"),
        ("camera_0.json", b'{"K": [1, 2], "pose": 0}', "camera_0.json: 'K' has 2 numbers; give the 9"),
        ("camera_0.json", b"\x93NUMPY", "camera_0.json: is an array of NumPy, not the JSON or YAML of a camera"),
        ("depth_0.png", b"version https://git-lfs.github.com/spec/v1", "depth_0.png: is a pointer of Git LFS"),
        ("depth_1.png", b"no image", "depth_1.png: is a damaged .png file"),
        ("depth_1.png", None, "depth_1.png: there is no such file"),
        ("mask_0.png", b"\x89PNG\r\n\x1a\n", "mask_0.png: is a damaged .png file"),
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


def picture(name: str, pixels: np.ndarray, mode: str | None = None) -> str:
    Image.fromarray(pixels, mode).save(name) if mode is None else Image.fromarray(pixels).convert(mode).save(name)
    return name


def one(depth: str = "depth_0.png", mask: str = "mask_0.png", camera: str = "camera_0.json", *more: str) -> int:
    """The command for one image, whose unit is not given."""
    return run(["cloud", depth, "--masks", mask, "--cameras", camera, "--out", "one.npz", *more])


def test_what_was_assumed_travels_in_the_file_to_the_plan(files, capfd):
    depth = np.where(np.isfinite(FRONT.depth), np.round(1000 * FRONT.depth), 0).astype(np.uint16)
    depth[FRONT.mask] = np.where(np.arange(FRONT.mask.sum()) % 10 == 0, 65535, depth[FRONT.mask])
    assert one(picture("mm.png", depth)) == codes.FEASIBLE
    notes = sgnlp.load("one.npz").notes
    dropped = -(-FRONT.mask.sum() // 10)
    assert notes[1:3] == (
        "Assumed that depths are in units of 0.001 m; see --unit.",
        f"Dropped {dropped} of {FRONT.mask.sum()} marked pixels of depth 65535: no return.",
    )
    printed = capfd.readouterr().out
    assert all(note in printed for note in notes[:3])
    np.savez("bad.npz", points=np.zeros((3, 3)), notes=np.array(3))
    with pytest.raises(InputError, match="'notes' must be texts"):
        sgnlp.load("bad.npz")


def test_a_note_on_all_images_is_said_once_and_one_on_one_image_with_its_name():
    shots = [replace(FRONT, notes=["a.", "b."], name="left"), replace(BACK, notes=["a."], name="right")]
    assert arrays(shots)["notes"][1:] == ["a.", "left: b."]


def test_depths_of_a_sensors_largest_value_or_below_0_are_no_points():
    shot = np.round(1e4 * np.nan_to_num(FRONT.depth, posinf=0))
    lost = FRONT.mask & (np.indices(shot.shape).sum(axis=0) % 4 == 0)
    expected = (1e-4 * shot)[FRONT.mask & ~lost]
    for kind, value in ((np.uint16, 65535), (np.int32, -1), (np.float32, -1.0)):
        found = replace(FRONT, depth=np.where(lost, value, shot).astype(kind), unit=1e-4)
        assert len(arrays([found])["points"]) == len(expected)
        assert found.notes == (
            f"Dropped {lost.sum()} of {FRONT.mask.sum()} marked pixels of depth {value:g}: no return.",
        )


def test_a_far_value_for_no_return_is_dropped_and_does_not_hide_the_table():
    lost = FRONT.mask & (np.indices(FRONT.depth.shape).sum(axis=0) % 4 == 0)
    beside = np.zeros_like(lost)
    beside[::2] = True
    far = replace(FRONT, depth=np.where(lost | (beside & ~FRONT.mask), 10.0, FRONT.depth))
    found = arrays([far])
    assert len(found["points"]) == (FRONT.mask & ~lost).sum()
    counts = f"{lost.sum()} of {FRONT.mask.sum()} marked pixels"
    assert found["notes"][1] == f"Dropped {counts}, more than 0.5 m nearer or farther than their median."
    assert len(found["notes"]) == 2


def test_images_without_a_fault_have_no_note_but_that_of_the_table():
    assert len(arrays([FRONT, BACK])["notes"]) == 1


@pytest.mark.parametrize(
    ("change", "note"),
    [
        ({"unit": 2.0}, r"The table was measured at -0.400 m, more than 0.1 m below the world's origin: .* --unit"),
        ({"unit": 3.0}, r"In units of 3 m the object is 1.6\d m from the camera, not 0.2 to 1.5 m: see --unit"),
        ({"unit": 0.3}, r"In units of 0.3 m the object is 0.16\d m from the camera"),
        ({"depth": np.round(FRONT.depth / 0.008) * 0.008}, "The depths come in steps of 8 mm, more than 3 mm"),
        ({"depth": FRONT.depth / FRONT.depth.max()}, "The largest depth is exactly 1: .* if they were normalised"),
        ({"intrinsics": K * [[0.72], [0.72], [1]]}, r"cx, cy = .* lie 14% of the image off the middle of 160 x 120"),
        ({"intrinsics": K * [[1], [1.3], [1]]}, r"fx = .* and fy = .* differ by 30%, more than 3%"),
        (
            {"depth": np.where(np.indices((120, 160))[1] % 3 > 0, 0, FRONT.depth)},
            r"6\d% of the \d+ marked pixels have no",
        ),
    ],
)
def test_what_nobody_can_be_sure_of_is_a_note_with_its_threshold(change, note):
    notes = arrays([replace(FRONT, **change)])["notes"]
    assert any(re.match(note, line) for line in notes), notes


def test_a_mask_of_most_of_the_image_is_remarked_upon():
    v, u = np.nonzero(FRONT.mask)
    crop = (slice(v.min(), v.max() + 1), slice(u.min(), u.max() + 1))
    at = K - [[0, 0, u.min()], [0, 0, v.min()], [0, 0, 0]]
    notes = arrays([replace(FRONT, depth=FRONT.depth[crop], mask=FRONT.mask[crop], intrinsics=at)])["notes"]
    assert any("of the pixels, more than 50%: right for an image cropped to the object" in note for note in notes)


def test_poses_in_millimetres_and_views_that_disagree_are_remarked_upon():
    far = FRONT.pose.copy()
    far[:3, 3] *= 1000
    assert (
        "A camera is 600 m from the origin of the world, more than 10 m"
        in arrays([replace(FRONT, pose=far)])["notes"][1]
    )
    far[:3, 3] /= 100  # decimetres
    assert any(
        "The table was measured at 3.6 m, more than 2 m above" in n for n in arrays([replace(FRONT, pose=far)])["notes"]
    )
    moved = BACK.pose + np.outer([0, 0, 1, 0], [0, 0, 0, 0.2])
    notes = arrays([FRONT, replace(BACK, pose=moved)])["notes"]
    assert any(note.startswith("The table is taken to be at ") for note in notes)
    assert any(note.startswith("Two views see the object 0.1") for note in notes)


def test_the_table_is_below_the_camera():
    with pytest.raises(InputError, match=r"the table at 0.5000 m is above the camera at 0.4000 m"):
        from_depth(FRONT, table_height=0.5)
    bare = replace(FRONT, depth=np.where(FRONT.mask, FRONT.depth, 0), pose=FRONT.pose @ np.diag([1, -1, -1, 1]))
    assert any(note.startswith("The object is above the camera") for note in arrays([bare], 0.0)["notes"])


def test_three_rows_of_a_pose_are_enough():
    np.testing.assert_array_equal(replace(FRONT, pose=FRONT.pose[:3]).pose, FRONT.pose)


def test_a_picture_of_depths_is_told_from_depths(files, capfd):
    steps = (np.nan_to_num(FRONT.depth, posinf=0) / 0.008).astype(np.uint8)
    assert one(picture("colour.png", np.dstack([steps] * 3))) == codes.BAD_INPUT
    assert one(picture("eight.png", steps)) == codes.BAD_INPUT
    errors = capfd.readouterr().err.splitlines()
    assert errors[0].startswith("error: colour.png: is a picture (RGB), not depths")
    assert errors[1].startswith("error: eight.png: 8 bits hold 256 depths")
    assert one("eight.png", "mask_0.png", "camera_0.json", "--unit", "0.008") == codes.FEASIBLE
    assert any("in steps of 8 mm" in note for note in sgnlp.load("one.npz").notes)


def test_a_label_chooses_in_each_mask(files, capfd):
    labels = np.where(FRONT.mask, 5, 0).astype(np.uint8)
    labels[-20:][labels[-20:] == 0] = 3
    picture("labels.png", labels)
    names = ["depth_0.png", "depth_1.png", "--masks", "labels.png", "mask_1.png"]
    command = ["cloud", *names, "--cameras", "camera_0.json", "camera_1.json", "--unit", "0.0001"]
    assert run([*command, "--label", "5", "255"]) == codes.FEASIBLE
    assert np.bincount(unpacked("object.npz")["view"]).tolist() == [FRONT.mask.sum(), BACK.mask.sum()]
    assert run(command) == codes.BAD_INPUT
    assert run([*command, "--label", "1", "2", "3"]) == codes.BAD_INPUT
    errors = capfd.readouterr().err
    assert "labels.png: the mask has several labels; choose with --label" in errors
    assert "--label needs one value, or one for each mask; found 3" in errors


def test_of_a_palette_the_index_counts_not_the_colour(files, capfd):
    for colours in ([68, 1, 84, 253, 231, 37], [68, 1, 84, 0, 0, 0]):
        palette = Image.fromarray(FRONT.mask.astype(np.uint8)).convert("P")
        palette.putpalette(colours)
        palette.save("palette.png")
        assert one("depth_0.png", "palette.png", "camera_0.json", "--unit", "0.0001") == codes.FEASIBLE
        assert len(unpacked("one.npz")["points"]) == FRONT.mask.sum()
    palette.putpalette([255, 255, 255, 0, 0, 0])
    palette.save("palette.png")
    assert one("depth_0.png", "palette.png") == codes.BAD_INPUT
    assert "palette.png: its palette has white at 0 and black for the rest" in capfd.readouterr().err


def test_the_camera_must_be_of_the_images_size(files, capfd):
    camera = json.loads(Path("camera_0.json").read_text(encoding="utf-8")) | {"width": 320, "height": 240}
    Path("big.json").write_text(json.dumps(camera), encoding="utf-8")
    assert one("depth_0.png", "mask_0.png", "big.json") == codes.BAD_INPUT
    assert "big.json: is of images of 320 x 240 pixels, this one has 160 x 120" in capfd.readouterr().err
