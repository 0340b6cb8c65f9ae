"""`sgnlp cloud` without masks: it lists what stands on the table, and writes what is chosen."""

import json
from pathlib import Path

import numpy as np
import pytest
from archives import unpacked
from PIL import Image
from tabletops import SMALL, TINY, Tabletop, random_bodies, seen

import sgnlp
from sgnlp.cli import codes, run

BODIES = 3


@pytest.fixture(scope="module")
def top() -> Tabletop:
    """Three bodies, in a quarter of the pixels."""
    rng = np.random.default_rng(5)
    return seen(random_bodies(BODIES, rng, reach=0.12), rng, camera=TINY)


@pytest.fixture
def files(top, tmp_path, monkeypatch) -> Path:
    """A folder with the scene as a depth image, and as clouds."""
    monkeypatch.chdir(tmp_path)
    Image.fromarray(np.nan_to_num(np.round(1000 * top.depth)).astype(np.uint16)).save("scene.png")
    np.save("depth.npy", top.depth)
    np.save("own.npy", top.own)
    K = top.camera.intrinsics.tolist()
    Path("camera.json").write_text(json.dumps({"K": K}), encoding="utf-8")
    Path("posed.json").write_text(json.dumps({"K": K, "pose": top.pose.tolist()}), encoding="utf-8")
    return tmp_path


IMAGE = ("scene.png", "--cameras", "camera.json")


def cloud(*arguments: str) -> int:
    return run(["cloud", *map(str, arguments)])


def body_of(top: Tabletop, file: str, transform: bool = True) -> int:
    """The body that the points of a problem file are of: those within 5 mm of its box."""
    data = unpacked(file)
    to_world = top.pose @ np.linalg.inv(data["transform"]) if transform else np.eye(4)
    points = data["points"] @ to_world[:3, :3].T + to_world[:3, 3]
    inside = [
        ((points > b.vertices.min(axis=0) - 0.005) & (points < b.vertices.max(axis=0) + 0.005)).all(axis=1).mean()
        for b in top.bodies
    ]
    assert max(inside) > 0.95
    return int(np.argmax(inside))


def test_several_objects_and_no_choice_are_listed_with_how_to_choose(files, capfd):
    assert cloud(*IMAGE) == codes.BAD_INPUT
    printed = capfd.readouterr()
    rows = [line.split() for line in printed.out.splitlines() if line[:2].strip().isdigit()]
    assert [row[0] for row in rows] == ["1", "2", "3"]
    counts = [int(row[1]) for row in rows]
    assert counts == sorted(counts, reverse=True)
    assert printed.err == (
        "error: 3 objects stand on the table: choose one by --pick N, --near X Y Z or --pixel U V, or write --all\n"
    )
    assert not Path("object.npz").exists()


def test_each_way_to_choose_takes_the_same_object(files, top, capfd):
    assert cloud(*IMAGE, "--pick", 2, "--out", "picked.npz") == codes.FEASIBLE
    data = unpacked("picked.npz")
    scene = sgnlp.segment(sgnlp.DepthImage(np.array(Image.open("scene.png")), None, top.camera.intrinsics, unit=0.001))
    v, u = np.argwhere(scene.pixels(2)[0])[100]
    place = map(str, data["points"].mean(axis=0))
    assert cloud(*IMAGE, "--pixel", u, v, "--out", "at.npz") == codes.FEASIBLE
    assert cloud(*IMAGE, "--near", *place, "--out", "near.npz") == codes.FEASIBLE
    for other in ("at.npz", "near.npz"):
        np.testing.assert_array_equal(unpacked(other)["points"], data["points"])
    assert body_of(top, "picked.npz") == int(np.bincount(top.labels[scene.pixels(2)[0]]).argmax()) - 1


def test_the_written_file_is_an_observation_with_camera_table_and_obstacles(files, top):
    assert cloud(*IMAGE, "--pick", 1) == codes.FEASIBLE
    observation = sgnlp.load("object.npz")
    np.testing.assert_allclose(observation.camera_positions, [[0, 0, 0.5]], atol=3e-3)
    assert observation.table_height == pytest.approx(0.0, abs=2e-3)
    assert set(np.unique(observation.obstacle)) >= {2, 3}
    assert any(note.startswith("No pose is given") for note in observation.notes)
    assert not [note for note in observation.notes if "Ignored the unknown keys" in note]
    assert unpacked("object.npz")["transform"].shape == (4, 4)


def test_several_numbers_are_parts_of_one_object(files, capfd):
    for numbers in ((1,), (3,), (1, 3)):
        assert cloud(*IMAGE, "--pick", *numbers, "--out", f"{'_'.join(map(str, numbers))}.npz") == codes.FEASIBLE
    both, parts = unpacked("1_3.npz"), [unpacked("1.npz"), unpacked("3.npz")]
    np.testing.assert_array_equal(both["points"], np.concatenate([part["points"] for part in parts]))
    assert set(both["obstacle"]) == {2}
    assert "1_3: cluster 1 and 3, " in capfd.readouterr().out


@pytest.mark.parametrize("out", ["mugs.npz", "mugs"])
def test_all_objects_are_written_into_a_folder(files, top, capfd, out):
    assert cloud("scene.png", "--cameras", "posed.json", "--all", "--out", out) == codes.FEASIBLE
    names = sorted(path.name for path in Path("mugs").iterdir())
    assert names == ["mugs_1.npz", "mugs_2.npz", "mugs_3.npz"]
    assert sorted(body_of(top, f"mugs/{name}", transform=False) for name in names) == [0, 1, 2]
    assert str(unpacked("mugs/mugs_2.npz")["name"]) == "mugs_2"


def test_the_only_object_needs_no_choice(files, capfd):
    rng = np.random.default_rng(0)
    np.save("one.npy", seen(random_bodies(1, rng, reach=0.05), rng, camera=SMALL).own)
    assert cloud("one.npy", "--out", "one.npz") == codes.FEASIBLE
    assert "one: cluster 1" in capfd.readouterr().out


def test_a_cloud_is_not_written_over_itself(files, capfd):
    np.savez("own.npz", points=np.load("own.npy").reshape(-1, 3))
    before = Path("own.npz").read_bytes()
    assert cloud("own.npz", "--out", "own.npz") == codes.BAD_INPUT
    assert "'own.npz' is an input, which the output would replace" in capfd.readouterr().err
    assert Path("own.npz").read_bytes() == before


@pytest.mark.parametrize("kind", ["npy", "npz", "xyz", "ply", "pcd"])
def test_clouds_of_every_kind_are_scenes(files, top, kind):
    points = top.own[np.isfinite(top.own[..., 2])]
    name = f"plain.{kind}"
    if kind == "npy":
        np.save(name, points)
    elif kind == "npz":
        np.savez(name, points_left=points)
    elif kind == "xyz":
        np.savetxt(name, points)
    elif kind == "ply":
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
        Path(name).write_bytes(head.encode() + points.astype("<f4").tobytes())
    else:
        height, width = top.depth.shape
        head = f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {width}\nHEIGHT {height}\n"
        head += f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {width * height}\nDATA binary\n"
        Path(name).write_bytes(head.encode() + top.own.astype("<f4").tobytes())
    assert cloud(name, "--all", "--out", "x.npz") == codes.FEASIBLE
    assert sorted(body_of(top, f"x/x_{i}.npz") for i in (1, 2, 3)) == [0, 1, 2]
    organised = cloud(name, "--pixel", 0, 0)  # which a plain cloud has not
    assert organised == codes.BAD_INPUT


def test_an_organised_pcd_has_pixels(files, top, capfd):
    test_clouds_of_every_kind_are_scenes(files, top, "pcd")
    assert "the pixel" in capfd.readouterr().err
    cloud("own.npy", "--pixel", 999, 0)
    assert "the pixel (999, 0) is outside of the 224 x 168 pixels" in capfd.readouterr().err


def test_a_pose_and_an_axis_are_those_of_solve(files, top):
    numbers = map(str, top.pose.ravel())
    assert cloud("own.npy", "--pose", *numbers, "--near", 0, 0, 0, "--out", "posed.npz") == codes.FEASIBLE
    body_of(top, "posed.npz", transform=False)
    np.testing.assert_allclose(unpacked("posed.npz")["camera_positions"], top.pose[None, :3, 3], atol=1e-9)
    world = (top.own @ top.pose[:3, :3].T + top.pose[:3, 3])[np.isfinite(top.own[..., 2])]
    np.save("y_up.npy", world[:, [0, 2, 1]] * [1, 1, -1])
    assert cloud("y_up.npy", "--up", "y", "--near", 0, 0, 0, "--out", "up.npz") == codes.FEASIBLE
    assert unpacked("up.npz")["table_height"] == pytest.approx(0.0, abs=1e-3)


def test_a_picture_shows_the_numbers(files, capfd):
    pytest.importorskip("matplotlib")
    assert (
        cloud(*IMAGE, "--png", "scene_clusters.png") == codes.BAD_INPUT
    )  # no choice, but the picture helps to make it
    with Image.open("scene_clusters.png") as picture:
        colours = picture.convert("RGB").getcolors(picture.width * picture.height)
    assert {(0, 114, 178), (230, 159, 0), (204, 121, 167)} <= {colour for _, colour in colours}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*IMAGE, "--pick", 9), "error: --pick must be 1 to 3; found 9"),
        ((*IMAGE, "--pixel", 400, 4), "error: the pixel (400, 4) is outside of the 224 x 168 pixels"),
        ((*IMAGE, "--pixel", 5, 160), "error: at the pixel (5, 160) is the table"),
        ((*IMAGE, "--pick", 1, "--all"), "error: give one of --pick and --all"),
        ((*IMAGE, "--unit", 1), "error: scene.png: in units of 1 m the scene is 7"),
        (("depth.npy", *IMAGE[1:]), "error: depth.npy: in units of 0.001 m the scene is 0.0007"),
        (("scene.png",), "error: every depth image needs a camera, its intrinsics (--cameras); found 1 images and 0"),
        (("scene.png", "own.npy", "--cameras", "camera.json"), "error: give depth images or clouds, not both"),
        (("own.npy", "own.npy"), "error: own.npy, own.npy: two views, '0' and '1', are the same, number by number"),
        (
            ("own.npy", "--pose", *np.diag([1, 1, -1, 1]).ravel()),
            "error: own.npy: the pose must be [[R, t], [0 0 0 1]]",
        ),
        ((*IMAGE, "--png", "scene.png"), "error: 'scene.png' is an input, which the output would replace"),
        ((*IMAGE, "--png", "scene.npz"), "error: --png must end in .png; found 'scene.npz'"),
        (("own.npy", "--cameras", "camera.json"), "error: cameras are those of depth images"),
        (("scene.exr", "--cameras", "camera.json"), "error: scene.exr: is OpenEXR, which is not read"),
        (("nowhere.ply",), "error: nowhere.ply: there is no such file"),
        (("scene.jpg",), "error: scene.jpg: is of a kind that is not read here"),
        ((*IMAGE, "--label", 3), "error: --label chooses in --masks"),
        ((*IMAGE, "--masks", "scene.png", "--pick", 1), "error: --pick is for scenes without --masks"),
        (
            ("scene.png", "scene.png", "--cameras", "camera.json", "camera.json"),
            "error: camera.json: has no pose; each",
        ),
    ],
)
def test_a_bad_input_is_told_in_one_line(files, capfd, arguments, message):
    assert cloud(*arguments) == codes.BAD_INPUT
    error = capfd.readouterr().err
    assert error.startswith(message)
    assert len(error.splitlines()) == 1
    assert not Path("object.npz").exists()
