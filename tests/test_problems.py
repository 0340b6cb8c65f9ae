"""The problem files, and the bodies and cameras that they are made with."""

import sys
from pathlib import Path

import numpy as np
import pytest

from sgnlp.observation import load

PROBLEMS = Path(__file__).parents[1] / "problems"
sys.path.insert(0, str(PROBLEMS))

import bodies  # noqa: E402
import cameras  # noqa: E402
import make  # noqa: E402

NAMES = sorted(make.CATALOGUE)
MAX_GRASP = 0.09  # [m] an Allegro hand closes on no more


def signed_distance(mesh: bodies.Mesh, points: np.ndarray) -> np.ndarray:
    """Distances (n,) [m] of points to a mesh, negative inside."""
    import open3d as o3d

    tensor = o3d.core.Tensor.from_numpy
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(tensor(mesh.vertices.astype(np.float32)), tensor(mesh.faces.astype(np.uint32)))
    return scene.compute_signed_distance(tensor(points.astype(np.float32))).numpy()


@pytest.mark.parametrize("name", NAMES)
def test_a_body_is_watertight_turned_outwards_and_stands_on_the_table(name):
    trimesh = pytest.importorskip("trimesh")
    mesh = make.CATALOGUE[name]()
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume > 0
    assert solid.body_count == 1
    assert solid.euler_number == (0 if name == "mug" else 2)  # a handle makes a torus of the mug
    assert len(np.unique(mesh.faces)) == len(mesh.vertices)
    assert solid.bounds[0, 2] == pytest.approx(0, abs=1e-12)
    assert solid.bounds[:, :2].sum(axis=0) == pytest.approx(0, abs=1e-12)


def test_the_bodies_have_the_volumes_of_their_formulas():
    trimesh = pytest.importorskip("trimesh")

    def volume(mesh):
        return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume

    assert volume(bodies.box(0.1, 0.06, 0.13)) == pytest.approx(0.1 * 0.06 * 0.13)
    assert volume(bodies.pyramid(0.08, 0.06)) == pytest.approx(0.08**2 * 0.06 / 3)
    assert volume(bodies.ball(0.04)) == pytest.approx(4 / 3 * np.pi * 0.04**3, rel=0.01)
    assert volume(bodies.can(0.03, 0.1, 1e-9)) == pytest.approx(np.pi * 0.03**2 * 0.1, rel=0.01)
    rounded = bodies.box(0.1, 0.06, 0.08, corner=0.02, edge=1e-9)
    assert volume(rounded) == pytest.approx((0.1 * 0.06 - (4 - np.pi) * 0.02**2) * 0.08, rel=0.01)
    shell = np.pi * (0.04**2 * 0.09 - 0.036**2 * 0.086)
    assert shell < volume(bodies.mug(0.04, 0.09, 0.004, 0.03)) < 1.2 * shell


@pytest.mark.parametrize("name", NAMES)
def test_a_body_is_of_the_size_of_a_hand(name):
    vertices = make.CATALOGUE[name]().vertices
    turned = [np.ptp(vertices[:, :2] @ [np.cos(a), np.sin(a)]) for a in np.linspace(0, np.pi, 180)]
    assert min(*turned, np.ptp(vertices[:, 2])) < MAX_GRASP
    assert 0.05 < max(*turned, np.ptp(vertices[:, 2])) < 0.2


@pytest.mark.parametrize("name", NAMES)
def test_a_committed_file_loads_and_lies_on_its_mesh_within_the_noise(name):
    file = PROBLEMS / f"{name}.npz"
    observation = load(file)
    assert observation.name == name
    assert observation.view_names == ("0", "1", "2")
    assert observation.table_height == 0
    assert observation.camera_positions.shape == (3, 3)
    np.testing.assert_allclose(observation.mesh_vertices, make.CATALOGUE[name]().vertices, atol=1e-7)
    assert observation.points[:, 2].min() >= make.CROP - make.RESOLUTION
    with np.load(file, allow_pickle=False) as arrays:
        assert np.bincount(arrays["view"]).tolist() == [make.POINTS_PER_VIEW] * 3
    mesh = bodies.Mesh(observation.mesh_vertices, observation.mesh_faces)
    distance = signed_distance(mesh, observation.points)
    for view in range(3):
        seen = distance[observation.view == view]
        assert abs(np.median(seen)) < make.SHIFT[1]
        assert 3e-4 < np.std(seen) < 2e-3
    assert np.abs(distance).max() < 0.01


def test_the_files_are_small_and_listed_in_the_readme():
    files = sorted(PROBLEMS.glob("*.npz"))
    assert [file.stem for file in files] == NAMES
    assert sum(file.stat().st_size for file in files) < 3e6
    readme = (PROBLEMS / "README.md").read_text()
    for file in files:
        size = " x ".join(f"{s:.0f}" for s in 1e3 * np.ptp(make.CATALOGUE[file.stem]().vertices, axis=0))
        row = next(line for line in readme.splitlines() if f"`{file.name}`" in line)
        assert size in row


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not(tmp_path, monkeypatch):
    written = []
    for run, seed in enumerate(["3", "3", "4"]):
        out = tmp_path / str(run)
        out.mkdir()
        monkeypatch.setattr("time.time", lambda run=run: 1e9 + 1e6 * run)  # zip entries may hold no clock time
        monkeypatch.setattr(sys, "argv", ["make.py", "pyramid", "--seed", seed, "--out", str(out)])
        make.main()
        written.append((out / "pyramid.npz").read_bytes())
    assert written[0] == written[1]
    assert written[0] != written[2]


def test_each_camera_sees_only_its_side():
    arrays = make.problem("ball", seed=0)
    centre = np.array([0, 0, 0.0365])
    for view, position in enumerate(arrays["camera_positions"]):
        towards = (position - centre) / np.linalg.norm(position - centre)
        assert ((arrays["points"][arrays["view"] == view] - centre) @ towards).min() > -0.005


def test_the_cameras_stand_in_a_ring_and_look_at_the_target():
    target = np.array([0.1, -0.2, 0.05])
    positions = cameras.ring(3, 0.55, 45, -10, target)
    np.testing.assert_allclose(np.linalg.norm(positions - target, axis=1), 0.55)
    np.testing.assert_allclose(positions[:, 2] - target[2], 0.55 * np.sqrt(0.5))
    np.testing.assert_allclose(positions.mean(axis=0)[:2], target[:2])
    for position in positions:
        rotation = cameras.looking_at(position, target)
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1)
        np.testing.assert_allclose(rotation.T @ (target - position), [0, 0, 0.55], atol=1e-12)
        assert rotation[2, 1] < 0  # the image's y points down


def test_the_depth_noise_follows_its_formula():
    camera = cameras.DepthCamera()
    rng = np.random.default_rng(0)
    assert camera.rays().shape == (480, 640, 3)
    corner = np.degrees(np.arctan(np.abs(camera.rays()).max(axis=(0, 1))))
    assert corner[:2] == pytest.approx([25, 19.3], abs=0.1)
    for depth, cosine in [(0.55, 1.0), (1.1, 1.0), (0.55, 0.5)]:
        true = np.full((480, 640), depth)
        measured = camera.measured(true, np.full_like(true, cosine), rng)
        valid = np.isfinite(measured)
        assert valid.mean() == pytest.approx(1 - camera.dropout_share, abs=0.01)
        expected = depth**2 * 0.08 / (camera.focal_length * 0.055) / cosine
        assert np.std(measured[valid]) == pytest.approx(expected, rel=0.02)
        assert np.mean(measured[valid]) == pytest.approx(depth, abs=1e-5)
        steps = measured[valid] / camera.depth_unit
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert np.isnan(camera.measured(true, np.full_like(true, 0.1), rng)).all()


def test_a_miscalibration_is_rigid_and_as_large_as_asked_for():
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.05, 0.05, (50, 3))
    for _ in range(20):
        moved = cameras.miscalibrated(points, (0.001, 0.002), 0.2, np.zeros(3), rng)
        before, after = (np.linalg.norm(p[:, None] - p, axis=-1) for p in (points, moved))
        np.testing.assert_allclose(after, before, atol=2e-6)
        shift = np.linalg.norm(cameras.miscalibrated(np.zeros((1, 3)), (0.001, 0.002), 0.2, np.zeros(3), rng))
        assert 0.001 <= shift <= 0.002
