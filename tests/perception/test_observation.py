"""Reading and cleaning a cloud: every format, every kind of bad file, and what the notes say."""

import dataclasses
import io
import os
import subprocess
import sys
import warnings
import zipfile

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.perception import open3d_files as reader
from sgnlp.perception.observation import Observation, ObservationSettings, load, observe
from sgnlp.perception.sampling import farthest_points

TABLE = 0.0
CAMERAS = np.eye(3) + np.array([0.0, 0.0, 0.1])


def sphere(count=600, radius=0.04, seed=0):
    """Points (count, 3) on a sphere that rests on the table."""
    direction = np.random.default_rng(seed).normal(size=(count, 3))
    return radius * (direction / np.linalg.norm(direction, axis=1, keepdims=True) + [0, 0, 1])


def saved(folder, **arrays):
    """An npz file of the arrays."""
    file = folder / "cloud.npz"
    np.savez(file, **arrays)
    return file


def assert_loads_or_is_refused(file):
    """No exception but `InputError` escapes, and that one says it in one line."""
    try:
        message = load(file).name
    except InputError as error:
        message = str(error)
    assert message.isprintable()


def test_a_file_with_everything_is_read_whole_and_read_only(tmp_path):
    view = np.repeat([0, 2], 300)
    cameras = CAMERAS
    file = saved(
        tmp_path,
        points=sphere().astype(np.float32),
        view=view,
        camera_positions=cameras,
        table_height=-0.001,
        name="ball 1",
        mesh_vertices=np.eye(3),
        mesh_faces=[[0, 1, 2]],
        mass=0.3,
        friction=0.8,
        half="tuning",
    )
    observation = load(file, scale=1.1)
    assert isinstance(observation, Observation)
    assert observation.name == "ball 1"
    assert observation.table_height == pytest.approx(-0.0011)
    assert (observation.mass, observation.friction) == (0.3, 0.8)  # no lengths, which a scale changes
    assert not [note for note in observation.notes if "unknown" in note]
    assert observation.view_names == ("0", "1", "2")
    assert observation.points.dtype == np.float64
    assert len(observation.points) == len(observation.view) > 550
    np.testing.assert_array_equal(observation.camera_positions, 1.1 * cameras)
    np.testing.assert_array_equal(observation.mesh_faces, [[0, 1, 2]])
    for point, camera in zip(observation.points, observation.view, strict=True):
        nearest = np.linalg.norm(1.1 * sphere() - point, axis=1).argmin()
        assert view[nearest] == camera
    for field in dataclasses.fields(observation):
        value = getattr(observation, field.name)
        if isinstance(value, np.ndarray):
            assert not value.flags.writeable, field.name


def test_points_alone_are_enough_and_every_assumption_is_noted(tmp_path):
    observation = load(saved(tmp_path, points=sphere(), colors=np.zeros((600, 3))))
    assert observation.name == "cloud"
    assert observation.view_names == ("0",)
    assert observation.camera_positions is None
    assert observation.mesh_vertices is None
    assert observation.notes[0] == "Ignored the unknown keys colors."
    assert observation.notes[1].startswith("Assumed the table at 0.000")
    assert observation.notes[2].startswith("Dropped 3 of 600 points that lie below the table")
    assert "outliers" in observation.notes[3]


def test_an_array_for_each_camera_makes_a_view_of_each(tmp_path):
    left, right = sphere()[:400], sphere()[400:]
    file = saved(tmp_path, points_right=right, points_left=left, table_height=TABLE)
    both = load(file)
    assert both.view_names == ("left", "right")
    one = load(file, views=["right"])
    assert one.view_names == ("right",)
    assert set(one.view) == {0}
    assert set(map(tuple, one.points)) <= set(map(tuple, right))
    assert load(file, views=[1]).digest != one.digest  # the options as they were given count
    np.testing.assert_array_equal(load(file, views=[1]).points, one.points)
    np.testing.assert_array_equal(load(file, views=1).points, one.points)
    for first in (0, np.int64(0), np.array([0]), {"left"}):
        assert load(file, views=first).view_names == ("left",)
    np.testing.assert_array_equal(load(file, views=["right", 0]).points, both.points)
    assert one.notes[0] == "Dropped 400 of 600 points that belong to views that were not chosen."


def test_views_of_one_name_are_refused():
    with pytest.raises(InputError, match="two of the views have the same name; found a, a"):
        observe(sphere(), view=np.repeat([0, 1], 300), view_names=["a", "a"])


def test_a_pose_is_a_matrix_or_its_numbers(tmp_path):
    file, turn = saved(tmp_path, points=sphere(), table_height=TABLE), np.diag([-1.0, -1, 1, 1])
    expected = load(file, pose=tuple(turn.ravel())).points
    for pose in (turn, turn.tolist(), tuple(map(tuple, turn))):
        np.testing.assert_array_equal(load(file, pose=pose).points, expected)


def test_a_view_is_found_by_name_before_place_and_cameras_follow(tmp_path):
    number = np.repeat([1, 2, 7], 200)
    file = saved(tmp_path, points=sphere(), view=number, table_height=TABLE)
    assert load(file).view_names == ("1", "2", "7")
    assert load(file, views=["1"]).view_names == ("1",)
    assert load(file, views=["0"]).view_names == ("1",)
    file = saved(tmp_path, points=sphere(), view=number // 3, camera_positions=CAMERAS, table_height=TABLE)
    np.testing.assert_array_equal(load(file, views=[2, 0]).camera_positions, CAMERAS[[0, 2]])
    for views in (["3"], ["left"], [-1]):
        with pytest.raises(InputError, match=r"unknown view .*; valid: 0, 1, 2"):
            load(file, views=views)
    with pytest.raises(InputError, match="no view is chosen; valid: 0, 1, 2"):
        observe(sphere(), view=number // 3, camera_positions=CAMERAS, table_height=TABLE, views=[])


def test_camera_positions_without_views_are_set_aside_and_noted():
    observation = observe(sphere(), camera_positions=np.eye(3), table_height=TABLE)
    assert observation.camera_positions is None
    assert "camera positions" in observation.notes[0]
    np.testing.assert_array_equal(observe(sphere(), camera_positions=[[1, 2, 3]]).camera_positions, [[1, 2, 3]])


GOOD = sphere()
BAD_ARRAYS = {
    "empty archive": ({}, "neither 'points' nor 'points_<camera>'; its keys: none"),
    "misnamed key": ({"point": GOOD, "vew": [1]}, "its keys: point, vew"),
    "both layouts": ({"points": GOOD, "points_a": GOOD}, "both 'points' and 'points_<camera>'"),
    "one row": ({"points": GOOD[0]}, r"'points' must be .* shape \(N, 3\); found float64 of shape \(3,\)"),
    "two columns": ({"points": GOOD[:, :2]}, r"found float64 of shape \(600, 2\)"),
    "bad camera array": ({"points_a": GOOD[:, :2]}, r"'points_a' must be .* found float64 of shape \(600, 2\)"),
    "text": ({"points": np.array([["a", "b", "c"]])}, "must be an array of real numbers"),
    "complex": ({"points": GOOD + 1j}, "found complex128"),
    "bool": ({"points": GOOD > 0}, "found bool"),
    "no points": ({"points": np.zeros((0, 3))}, "the cloud has 0 points, at least 30 are needed"),
    "29 points": ({"points": GOOD[:29]}, "the cloud has 29 points, at least 30 are needed"),
    "too many NaN": ({"points": np.where(np.arange(600)[:, None] < 571, np.nan, GOOD)}, "Dropped 571 of 600 points"),
    "many far": ({"points": np.where(np.arange(600)[:, None] < 130, -1e9, GOOD)}, "22% of the points are too far"),
    "huge": ({"points": np.full((600, 3), 1e308)}, "100% of the points are too far from the origin"),
    "equal": ({"points": np.full((600, 3), 0.1)}, "the cloud has 1 different points of 600"),
    "few": (
        {"points": np.repeat(GOOD[:4], 50, axis=0)},
        "cloud has 4 different points of 200, at least 30 are",
    ),
    "four columns": ({"points": np.c_[GOOD, GOOD[:, 0]]}, r"save the three columns .* points\[:, :3\]"),
    "a transform of zeros": ({"points": GOOD, "transform": np.zeros((4, 4))}, "the transform must be"),
    "a point a column": ({"points": GOOD.T}, r"save its transpose, points\.T"),
    "an index": ({"points": np.c_[np.arange(600), GOOD[:, :2]]}, "the first column counts"),
    "a line": ({"points": GOOD[:, :1] * [1, 2, 3]}, "all points lie on one line"),
    "a plane": ({"points": GOOD * [1, 1, 0]}, "all points lie on one plane"),
    "a circle": (
        {"points": np.exp(2j * np.pi * np.arange(60) / 60)[:, None].view(float) @ np.eye(2, 3) / 10},
        "one plane",
    ),
    "a tilted plane": ({"points": GOOD[:, :2] @ [[1, 0, 1], [0, 1, 2.0]]}, "all points lie on one plane"),
    "millimetres": ({"points": 1e3 * GOOD}, r"more than 0.5 m; is it in mm \(--scale 0.001\)"),
    "too small": ({"points": 0.1 * GOOD}, "m wide, less than 0.01 m; .*--scale"),
    "high table": ({"points": GOOD, "table_height": 0.05}, "the table at 0.0500 m is above .*% of the cloud"),
    "table not finite": ({"points": GOOD, "table_height": np.nan}, "the table height must be a finite number"),
    "table array": ({"points": GOOD, "table_height": [0.0, 1.0]}, "'table_height' must be .* of shape"),
    "short view": ({"points": GOOD, "view": [0, 1]}, "'view' has 2 entries for 600 points"),
    "float view": ({"points": GOOD, "view": np.zeros(600)}, "'view' must be an array of integers"),
    "view range": (
        {"points": GOOD, "view": np.full(600, 3), "camera_positions": np.eye(3)},
        r"'view' must lie in 0\.\.2; found 3\.\.3",
    ),
    "one cloud twice": (
        {"points_a": GOOD, "points_b": GOOD, "points_c": GOOD + 0.001},
        "two views, 'points_a' and 'points_b', are the same",
    ),
    "few cameras": ({"points_a": GOOD, "points_b": GOOD + 0.001, "camera_positions": np.eye(3)}, "3 rows for 2 views"),
    "bad camera": ({"points": GOOD, "camera_positions": [[np.nan, 0, 0]]}, "'camera_positions' must be finite"),
    "no mass": ({"points": GOOD, "mass": 0.0}, "'mass' must be a positive number of kg, .*; found 0.0"),
    "a friction in degrees": ({"points": GOOD, "friction": 45.0}, "'friction' must be a positive number, at most 5"),
    "a mass in grams": ({"points": GOOD, "mass": 350.0}, "'mass' must be .* of kg, at most 100; found 350"),
    "a table in mm": ({"points": GOOD, "table_height": -35.0}, "the table at -35.0000 m is more than 10 m below"),
    "a result": ({"wrist": np.zeros((1, 7)), "tips_pregrasp": np.ones((1, 4, 3))}, "result of sgnlp solve, not a"),
    "two frictions": ({"points": GOOD, "friction": [1.0, 0.5]}, "'friction' must be an array of real numbers"),
    "half a mesh": ({"points": GOOD, "mesh_faces": [[0, 1, 2]]}, "must be given together"),
    "bad faces": (
        {"points": GOOD, "mesh_vertices": np.eye(3), "mesh_faces": [[0, 1, 3]]},
        r"'mesh_faces' must lie in 0\.\.2",
    ),
    "bad vertices": (
        {"points": GOOD, "mesh_vertices": np.full((3, 3), np.inf), "mesh_faces": [[0, 1, 2]]},
        "'mesh_vertices' must be finite",
    ),
    "path as name": ({"points": GOOD, "name": "../../x"}, r"the name '\.\./\.\./x' must be"),
    "wide name": ({"points": GOOD, "name": "x" * 101}, "must be 1 to 100 characters"),
}


@pytest.mark.parametrize(("arrays", "message"), BAD_ARRAYS.values(), ids=BAD_ARRAYS.keys())
def test_bad_arrays_are_refused_in_one_line(tmp_path, arrays, message):
    file = saved(tmp_path, **arrays)
    with pytest.raises(InputError, match=message) as caught:
        load(file)
    assert str(caught.value).startswith(str(file))
    assert str(caught.value).isprintable()
    assert os.listdir(tmp_path) == ["cloud.npz"]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"scale": "mm"}, "scale must be a number, not 'mm'"),
        ({"mass": "1"}, "mass must be a number or None, not '1'"),
        ({"table_height": "0"}, "table_height must be a number or None, not '0'"),
        ({"name": 3}, "name must be a text, not 3"),
        ({"pose": [[1, 0], [0]]}, "'pose' must be an array of real numbers of shape"),
    ],
)
def test_arguments_of_another_kind_are_refused(wrong, said):
    with pytest.raises(InputError, match=said):
        observe(GOOD, **wrong)


def test_a_missing_file_a_directory_and_other_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        load(tmp_path / "none.npz")
    with pytest.raises(InputError, match="is a directory; give an npz"):
        load(str(tmp_path))
    with pytest.raises(InputError, match="cannot be read"):
        load(tmp_path / ("x" * 1000))
    fifo = tmp_path / "fifo.npz"
    os.mkfifo(fifo)
    with pytest.raises(InputError, match="is not a regular file"):
        load(fifo)
    other = tmp_path / "other.npz"
    for content in (b"", b"solid ball"):
        other.write_bytes(content)
        with pytest.raises(InputError, match="is not an npz; give an npz with 'points'"):
            load(other)
    other.write_bytes(b"\x80\x04K\x01.")
    with pytest.raises(InputError, match="is a pickle, which is never read"):
        load(other)
    other.write_bytes(b"\x93NUMPY\x01\x00")
    with pytest.raises(InputError, match="is a damaged npy"):
        load(other)


def test_pickled_objects_are_refused_and_never_unpickled(tmp_path):
    class Trap:
        def __reduce__(self):
            return open, (str(tmp_path / "sprung"), "w")

    for arrays in ({"points": np.array([Trap()])}, {"points": GOOD, "extra": np.array([Trap()])}):
        with pytest.raises(InputError, match="holds pickled objects, which are never read"):
            load(saved(tmp_path, **arrays))
    assert not (tmp_path / "sprung").exists()


def test_truncated_and_garbled_archives_raise_nothing_but_input_errors(tmp_path):
    rng = np.random.default_rng(0)
    stream = io.BytesIO()
    np.savez_compressed(stream, points=GOOD, view=np.zeros(600, int), table_height=0.0, name="x")
    content = stream.getvalue()
    file = tmp_path / "cloud.npz"
    for cut in rng.integers(4, len(content), 50):
        file.write_bytes(content[:cut])
        with pytest.raises(InputError, match=r"is a (truncated|damaged) npz"):
            load(file)
    for _ in range(300):
        garbled = bytearray(content)
        start = rng.choice([0, len(content) - 400])
        for place in start + rng.integers(0, 400, rng.integers(1, 8)):
            garbled[place] = rng.integers(256)
        file.write_bytes(bytes(garbled))
        assert_loads_or_is_refused(file)


def test_garbled_arrays_in_a_sound_archive_raise_nothing_but_input_errors(tmp_path):
    rng = np.random.default_rng(1)
    file = tmp_path / "cloud.npz"
    arrays = {"points": GOOD, "view": np.zeros(600, int), "table_height": np.array(0.0), "name": np.array("x")}
    for _ in range(300):
        with zipfile.ZipFile(file, "w") as archive:
            for key, array in arrays.items():
                stream = io.BytesIO()
                np.save(stream, array)
                content = bytearray(stream.getvalue())
                for place in rng.integers(0, 128, rng.integers(0, 3)):
                    content[place] = rng.integers(256)
                archive.writestr(f"{key}.npy", bytes(content))
        assert_loads_or_is_refused(file)


def test_invalid_points_below_a_fifth_are_dropped_and_counted():
    points = sphere()
    points[:60] = np.nan
    points[60, 1], points[61, 0], points[62, 2] = np.inf, -np.inf, 1e30
    observation = observe(points, view=np.arange(600), table_height=TABLE)
    assert observation.notes[:2] == (
        "Dropped 62 of 600 points that are NaN or infinite.",
        "Dropped 1 of 538 points that are beyond 1e+07 m.",
    )
    assert np.isfinite(observation.points).all()
    np.testing.assert_array_equal(observation.points, points[observation.view])


def test_too_few_points_after_cleaning_are_refused_with_the_reasons():
    points = np.concatenate([sphere(30), [[0.0, 0.0, -1e-3]]])
    settings = ObservationSettings(outlier_deviations=1e-6)
    with pytest.raises(InputError, match=r"cloud has \d+ points, at least 30 are needed \(Dropped 1 of 31 .* outliers"):
        observe(points, table_height=TABLE, settings=settings)


def test_millimetres_are_read_with_a_scale(tmp_path):
    metres = saved(
        tmp_path,
        points=GOOD,
        table_height=0.002,
        camera_positions=[[0, 0, 1]],
        mesh_vertices=GOOD[:3],
        mesh_faces=[[0, 1, 2]],
    )
    expected = load(metres)
    file = saved(
        tmp_path,
        points=1e3 * GOOD,
        table_height=2.0,
        camera_positions=[[0, 0, 1e3]],
        mesh_vertices=1e3 * GOOD[:3],
        mesh_faces=[[0, 1, 2]],
    )
    scaled = load(file, scale=0.001)
    assert scaled.table_height == expected.table_height
    for field in ("points", "camera_positions", "mesh_vertices"):
        np.testing.assert_allclose(getattr(scaled, field), getattr(expected, field), rtol=1e-12)
    assert scaled.notes == ("Multiplied all coordinates by 0.001.", *expected.notes)
    assert load(file, scale=0.001, table_height=0.001).table_height == 0.001  # metres: not scaled
    for scale in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match=r"--scale must be (positive|a finite number)"):
            load(file, scale=scale)
        with pytest.raises(InputError, match="'scale' must be a positive number"):
            observe(GOOD, scale=scale)


def test_the_table_is_taken_from_the_argument_then_the_file_then_the_lowest_points(tmp_path):
    file = saved(tmp_path, points=GOOD, table_height=0.002)
    assert load(file).table_height == 0.002
    assert load(file, table_height=0.003).table_height == 0.003
    cloud = sphere(20_000) + np.array([0, 0, 0.3])
    cloud[:50, 2] -= 0.2  # a few points below the table do not move the estimate
    observation = observe(cloud)
    assert observation.table_height == pytest.approx(0.3, abs=5e-4)
    assert observation.notes[0] == (
        f"Assumed the table at {observation.table_height:.4f} m, the 0.5 % quantile of the heights."
    )
    assert observation.points[:, 2].min() >= observation.table_height


def test_points_below_the_table_are_dropped():
    table = 0.01
    below = int(np.sum(GOOD[:, 2] < table))
    assert 0 < below < 120
    observation = observe(GOOD, table_height=table)
    assert observation.notes[0] == f"Dropped {below} of 600 points that lie below the table at 0.0100 m."
    assert observation.points[:, 2].min() >= table


def test_outliers_are_those_of_the_statistical_rule():
    points = np.concatenate([sphere(500), [[0.2, 0, 0.1], [0, 0.15, 0.2]]])
    distances = np.sort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)
    average = distances[:, 1:21].mean(axis=1)
    limit = average.mean() + 2 * average.std()
    expected = average <= limit
    assert not expected[-2:].any()
    observation = observe(points, view=np.arange(502), table_height=TABLE)
    np.testing.assert_array_equal(observation.view, np.flatnonzero(expected))
    assert observation.notes[0].startswith(f"Dropped {502 - expected.sum()} of 502 points that are outliers")
    assert f"mean distance to 20 neighbours above {1e3 * limit:.1f} mm" in observation.notes[0]


def test_farthest_points_agree_with_the_plain_algorithm():
    points = sphere(300)
    chosen = farthest_points(points, 40, seed=5)
    expected = [np.random.default_rng(5).integers(300)]
    while len(expected) < 40:
        to_nearest = np.linalg.norm(points[:, None] - points[expected], axis=2).min(axis=1)
        expected.append(to_nearest.argmax())
    np.testing.assert_array_equal(chosen, expected)
    np.testing.assert_array_equal(chosen, farthest_points(points, 40, seed=5))
    assert set(chosen) != set(farthest_points(points, 40, seed=6))


def test_farthest_points_never_repeat_and_need_something_to_choose_from():
    points = np.repeat(sphere(50), 3, axis=0)
    chosen = farthest_points(points, 100, seed=0)
    assert len(chosen) == len(np.unique(points[chosen], axis=0)) == 50
    for cloud, count in ((points, 0), (np.zeros((0, 3)), 5)):
        with pytest.raises(InputError, match="cannot choose"):
            farthest_points(cloud, count, seed=0)


def test_a_million_points_are_thinned_evenly_and_sampled():
    points = sphere(1_000_000) + np.random.default_rng(1).normal(scale=5e-4, size=(1_000_000, 3))
    points[:300] = np.random.default_rng(2).uniform(-2, 2, (300, 3))  # far points must not make the grid coarse
    observation = observe(points, view=np.arange(1_000_000) % 3, table_height=-3.0)
    assert 20_000 < len(observation.points) <= ObservationSettings().max_points
    assert any("share a cell of the thinning grid" in note for note in observation.notes)
    direction = (observation.points - [0, 0, 0.04]) / 0.04
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1, atol=0.08)
    octants = np.bincount((direction > 0) @ [1, 2, 4], minlength=8)
    assert octants.min() > 0.9 * octants.max()
    assert np.bincount(observation.view).min() > 0.3 * len(observation.points)
    chosen = farthest_points(points[300:], 100, seed=0)
    spread = np.linalg.norm(points[300:][chosen][:, None] - points[300:][chosen], axis=2) + np.eye(100)
    assert spread.min() > 0.009  # 100 even points on this sphere are about 1 cm apart


def test_a_digest_names_the_points_and_the_options_but_not_the_name():
    digest = observe(GOOD, table_height=TABLE).digest
    assert len(digest) == 64
    assert observe(GOOD.copy(), table_height=TABLE, name="other").digest == digest
    others = [
        observe(GOOD + 1e-9, table_height=TABLE),
        observe(GOOD, table_height=-0.001),
        observe(GOOD, table_height=TABLE, views=[0]),
        observe(GOOD, table_height=TABLE, scale=1.1),
        observe(GOOD, table_height=TABLE, view=np.arange(600) % 2),
        observe(GOOD, table_height=TABLE, camera_positions=[[0, 0, 1]]),
        observe(GOOD, table_height=TABLE, settings=ObservationSettings(outlier_neighbours=19)),
    ]
    assert len({digest, *(other.digest for other in others)}) == len(others) + 1


@pytest.mark.parametrize(
    ("setting", "value", "message"),
    [
        ("outlier_deviations", -1.0, "--cleaning.outlier-deviations must be positive, not -1"),
        ("max_width", np.nan, "--cleaning.max-width must be a finite number, not nan"),
        ("max_invalid_share", 1.5, "--cleaning.max-invalid-share must be between 0 and 1, not 1.5"),
        ("table_quantile", -0.1, "--cleaning.table-quantile must be between 0 and 1, not -0.1"),
        ("min_points", 3, "--cleaning.min-points must be at least 4, not 3"),
    ],
)
def test_settings_out_of_range_are_refused(setting, value, message):
    with pytest.raises(InputError, match=message):
        ObservationSettings(**{setting: value})


@pytest.fixture(scope="module")
def open3d_files(tmp_path_factory):
    """The good cloud as .ply, .pcd (text and compressed) and .xyz."""
    with warnings.catch_warnings(action="ignore"):
        open3d = pytest.importorskip("open3d")
    folder = tmp_path_factory.mktemp("open3d")
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(GOOD))
    for suffix in (".ply", ".pcd", ".xyz"):
        open3d.io.write_point_cloud(str(folder / f"ball{suffix}"), cloud, write_ascii=suffix == ".pcd")
    open3d.io.write_point_cloud(str(folder / "ball packed.pcd"), cloud, compressed=True)
    return folder


@pytest.mark.parametrize("name", ["ball.ply", "ball.pcd", "ball packed.pcd", "ball.xyz"])
def test_clouds_that_open3d_wrote_are_read(open3d_files, name, capfd):
    observation = load(open3d_files / name, table_height=TABLE)
    expected = observe(GOOD, table_height=TABLE)
    np.testing.assert_allclose(observation.points, expected.points, atol=1e-6)
    assert observation.name == name.rpartition(".")[0]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", [".ply", ".pcd"])
def test_a_file_that_open3d_reads_only_in_part_is_refused(open3d_files, suffix, tmp_path, capfd):
    content = (open3d_files / f"ball{suffix}").read_bytes()
    file = tmp_path / f"cut{suffix}"
    file.write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match=f"is a damaged {suffix} file"):
        load(file)
    assert capfd.readouterr() == ("", "")


def test_a_text_without_numbers_is_refused(open3d_files, tmp_path):
    file = tmp_path / "empty.xyz"
    file.write_text("hello\n", encoding="utf-8")
    with pytest.raises(InputError, match="holds no line of three numbers"):
        load(file)


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("import os; os.abort()", "is a damaged .obj file"),
        (f"import sys; print('no libusb', file=sys.stderr); sys.exit({reader.ABSENT})", "no libusb.*libusb-1.0-0"),
        ("import time; time.sleep(60)", "was not read by Open3D within 0.5 s"),
    ],
)
def test_a_crash_of_open3d_its_absence_and_a_hang_are_input_errors(tmp_path, monkeypatch, program, message):
    monkeypatch.setattr(reader, "READER", program)
    monkeypatch.setattr(reader, "TIMEOUT", 0.5 if "sleep" in program else 60)
    file = tmp_path / "ball.obj"
    file.write_text("v 0 0 0", encoding="utf-8")
    with pytest.raises(InputError, match=message):
        reader.triangles(file)


def test_an_open3d_that_cannot_be_imported_is_told_from_a_damaged_file(tmp_path, monkeypatch):
    (tmp_path / "open3d.py").write_text(
        "raise OSError('libusb-1.0.so.0: cannot open shared object file')", encoding="utf-8"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "ball.obj").write_text("v 0 0 0", encoding="utf-8")
    with pytest.raises(InputError, match=r"libusb-1\.0\.so\.0: cannot open.*Debian: libusb-1\.0-0"):
        reader.triangles(tmp_path / "ball.obj")


def run_python(program, *arguments):
    """Run a program in a new interpreter that finds the same modules."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", program, *arguments]
    child = subprocess.run(command, capture_output=True, encoding="utf-8", env=environment)
    assert child.returncode == 0, child.stderr


@pytest.mark.parametrize("path", [None, 3, {"points": GOOD}])
def test_what_is_no_path_is_refused_by_name(path):
    with pytest.raises(InputError, match="path must be a text or a path"):
        load(path)


def test_a_cloud_is_cleaned_in_a_process_that_has_loaded_casadi_and_pinocchio():
    run_python(
        """
import casadi, pinocchio
import numpy as np
from sgnlp.perception.observation import observe
casadi.nlpsol("s", "ipopt", {"x": casadi.SX.sym("x"), "f": 0})
pinocchio.buildSampleModelHumanoid()
for seed in range(10):
    points = np.random.default_rng(seed).normal(scale=0.02, size=(20_000, 3))
    observe(points, table_height=-0.5)
"""
    )


def test_a_plain_npz_needs_no_open3d(tmp_path):
    program = "import sys, sgnlp; sgnlp.load(sys.argv[1]); assert 'open3d' not in sys.modules"
    run_python(program, str(saved(tmp_path, points=GOOD)))


def test_real_clouds_lose_few_points(real_clouds):
    for file in real_clouds:
        for views in (["415"], ["435", "455"], None):
            observation = load(file, views=views, table_height=0.013)
            with np.load(file) as arrays:
                count = sum(len(arrays[f"points_{view}"]) for view in views or ("415", "435", "455"))
            assert 0.9 * count < len(observation.points) < count
            assert load(file, views=views).table_height == pytest.approx(0.0165, abs=0.003)


def test_obstacles_are_moved_as_the_points_are_and_named_by_the_digest(tmp_path):
    plain = observe(GOOD, table_height=TABLE)
    assert plain.obstacle_points is plain.obstacle is None
    place, numbers = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]), np.array([2, 0])
    turn = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    seen = observe(1000 * GOOD, scale=0.001, pose=turn, obstacle_points=1000 * place, obstacle=numbers)
    np.testing.assert_allclose(seen.obstacle_points, [[0.8, 2.1, 3.3], [0.5, 2.4, 3.6]])
    np.testing.assert_array_equal(seen.obstacle, numbers)
    given = observe(GOOD, table_height=TABLE, obstacle_points=place, obstacle=numbers)
    other = observe(GOOD, table_height=TABLE, obstacle_points=place + 1e-9, obstacle=numbers)
    assert len({plain.digest, given.digest, other.digest}) == 3
    read = load(saved(tmp_path, points=GOOD, table_height=TABLE, obstacle_points=place, transform=np.eye(4)))
    np.testing.assert_array_equal(read.obstacle, [0, 0])
    assert not [note for note in read.notes if "unknown keys" in note]


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"obstacle": [1]}, "'obstacle' needs 'obstacle_points'"),
        ({"obstacle_points": np.zeros((3, 2))}, "'obstacle_points' must be an array of real numbers of shape"),
        ({"obstacle_points": np.full((1, 3), np.nan)}, "'obstacle_points' must be finite"),
        ({"obstacle_points": np.zeros((2, 3)), "obstacle": [1]}, "'obstacle' has 1 entries for 2 points"),
    ],
)
def test_obstacles_that_are_none_are_refused(arrays, message):
    with pytest.raises(InputError, match=message):
        observe(GOOD, table_height=TABLE, **arrays)
