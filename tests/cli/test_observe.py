"""`sgnlp observe`: a problem from any mesh."""

from pathlib import Path

import numpy as np
import pytest
from archives import unpacked
from box import BOX

from sgnlp import load
from sgnlp.base.errors import InputError
from sgnlp.cli import codes, run
from sgnlp.perception import open3d_files
from sgnlp.perception.synthetic.meshes import Mesh


@pytest.fixture(autouse=True)
def workplace(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def obj(mesh: Mesh = BOX, file: str = "box.obj") -> str:
    """Write a mesh as OBJ."""
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices] + [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    Path(file).write_text("\n".join(lines), encoding="utf-8")
    return file


@pytest.fixture
def read_at_once(monkeypatch) -> None:
    """OBJ files of `obj` are read without a process that loads Open3D, where how they are read is not in question."""

    def read(path: Path, kind: str) -> dict[str, np.ndarray]:
        lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
        vertices, faces = ([line[1:] for line in lines if line[0] == letter] for letter in "vf")
        return {"vertices": np.array(vertices, float), "faces": np.array(faces, int) - 1}

    monkeypatch.setattr(open3d_files, "_read", read)


def observed(*arguments: object) -> int:
    return run(["observe", *map(str, arguments)])


def test_a_mesh_becomes_a_problem_that_loads(capfd):
    assert observed(obj(), "--yaw-deg", 45, "--mass", 0.3, "--friction", 0.6) == codes.FEASIBLE
    out, err = capfd.readouterr()
    assert err == ""
    assert out == "box: 113 x 113 x 80 mm, points from each view: 4000, 4000, 4000\nwritten: box.npz\n"
    observation = load("box.npz", views=["0", "2"])
    assert (observation.name, observation.table_height) == ("box", 0)
    assert (observation.mass, observation.friction) == (0.3, 0.6)
    assert observation.view_names == ("0", "2")
    assert np.ptp(observation.mesh_vertices, axis=0) == pytest.approx([0.08 * 2**0.5, 0.08 * 2**0.5, 0.08], abs=1e-5)


def test_the_same_seed_gives_the_same_file_and_settling_another_pose(read_at_once):
    pytest.importorskip("mujoco")
    slab = obj(Mesh(BOX.vertices * [1, 1.5, 0.5], BOX.faces), "slab.obj")
    for out, flags in {"a": [], "b": [], "c": ["--seed", 1, "--ring.points", 500, "--views", 1]}.items():
        assert observed(slab, "--out", f"sub/{out}.npz", "--settle", *flags) == codes.FEASIBLE
    arrays = [unpacked(f"sub/{name}.npz") for name in "abc"]
    assert all(arrays[0][key].tobytes() == arrays[1][key].tobytes() for key in arrays[0] if key != "name")
    assert arrays[0]["mesh_vertices"].tobytes() != arrays[2]["mesh_vertices"].tobytes()
    assert np.bincount(arrays[2]["view"]).tolist() == [500]
    for file in arrays:
        height = np.sort(file["mesh_vertices"][:, 2])
        np.testing.assert_allclose(height[:4], 0, atol=1e-5)  # it rests on a side
        assert np.abs(height[4:] - [[0.04], [0.08], [0.12]]).max(axis=1).min() < 1e-5


@pytest.mark.parametrize("suffix", ["stl", "off", "ply"])
def test_other_formats_are_read_alike_and_millimetres_with_a_scale(suffix, capfd):
    trimesh = pytest.importorskip("trimesh")
    trimesh.Trimesh(BOX.vertices * 1000, BOX.faces, process=False).export(f"box.{suffix}")
    assert observed(f"box.{suffix}", "--scale", 0.001) == codes.FEASIBLE
    assert capfd.readouterr().out.startswith("Multiplied all coordinates by 0.001.\nbox: 80 x 80 x 80 mm")
    with np.load("box.npz") as arrays:
        mesh = Mesh(arrays["mesh_vertices"].astype(float), arrays["mesh_faces"].astype(int))
    assert len(mesh.vertices) == 8  # the corners of an STL's triangles are joined
    assert mesh.volume == pytest.approx(0.08**3, rel=1e-4)


def test_polygons_are_cut_into_triangles_concave_ones_too():
    corners = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in corners]
    lines += ["f 6 5 4 3 2 1", "f 7 8 9 10 11 12", *(f"f {i} {i % 6 + 1} {i % 6 + 7} {i + 6}" for i in range(1, 7))]
    Path("ell.obj").write_text("\n".join(lines), encoding="utf-8")
    vertices, faces = open3d_files.triangles(Path("ell.obj"))
    mesh = Mesh(vertices, faces).welded()
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert (len(mesh.faces), mesh.open_edges, mesh.volume) == (20, 0, pytest.approx(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(14)  # no triangle outside


def test_what_is_up_in_gltf_is_up_in_the_scene():
    trimesh = pytest.importorskip("trimesh")
    trimesh.Trimesh(BOX.vertices * [1, 1.25, 0.5], BOX.faces, process=False).export("box.glb")
    vertices, _ = open3d_files.triangles(Path("box.glb"))
    np.testing.assert_allclose(np.ptp(vertices, axis=0), np.ptp(BOX.vertices * [1, 0.5, 1.25], axis=0), rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("c.obj", b"v 0,5 0 0\n", r"has decimal commas \(line 1\)"),
        ("c.obj", b"v 0 0 0\nf 1 2\n", r"less than three corners \(line 2\)"),
        ("c.stl", b"\0" * 80 + b"\2\0\0\0" + b"\0" * 150, "says that it has 2 faces, and holds 3"),
        ("c.dae", b"", "is of the format Collada, which is not read; save it as .obj"),
        ("c.3mf", b"", "is of the format 3MF"),
    ],
)
def test_what_a_reader_would_misread_is_refused(name: str, content: bytes, message: str):
    Path(name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        open3d_files.triangles(Path(name))


def test_numbers_without_a_digit_before_the_point_are_read():
    Path("bare.obj").write_text(Path(obj()).read_text(encoding="utf-8").replace("0.", "."), encoding="utf-8")
    assert "v -." in Path("bare.obj").read_text(encoding="utf-8")
    for read, expected in zip(*map(open3d_files.triangles, map(Path, ("bare.obj", "box.obj"))), strict=True):
        np.testing.assert_array_equal(read, expected)


def test_pixels_that_meet_neither_body_nor_table_make_no_warning(read_at_once, recwarn):
    wide = ["--camera.field-of-view-deg", 120, "--camera.width", 256, "--camera.height", 256, "--out", "wide.npz"]
    assert observed(obj(), *wide) == codes.FEASIBLE
    assert not [str(warning.message) for warning in recwarn]
    with np.load("wide.npz") as made:
        assert np.isfinite(made["points"]).all()


def test_an_open_mesh_is_taken_and_remarked_upon(read_at_once, capfd):
    assert observed(obj(Mesh(BOX.vertices, BOX.faces[1:]))) == codes.FEASIBLE
    assert "The mesh is not watertight, 3 of its edges do not join two faces" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.obj"], "none.obj: there is no such file"),
        (["."], ".: is not a mesh; give a file ending in .obj .stl"),
        (["text.txt"], "text.txt: is not a mesh; give a file ending in .obj .stl .ply .off"),
        (["text.obj"], "text.obj: is a damaged .obj file"),
        (
            ["box.obj", "--scale", "1000"],
            "box.obj: the body is 138.6 m from corner to corner, and the images hold 0.33 m",
        ),
        (["box.obj", "--out", "box.ply"], "--out must end in .npz; found 'box.ply'"),
        (["box.obj", "--out", "/proc/box.npz"], "the output folder '/proc' cannot be written"),
        (["box.obj", "--out", f"{'x' * 101}.npz"], f"the name '{'x' * 40}' must be 1 to 100 characters"),
        (
            ["box.obj", "--views", "1", "--camera.width", "20"],
            "box.obj: the cameras measure 13 points of the body, and",
        ),
        (["box.obj", "--views", "0"], "--views must be positive, not 0"),
        (["box.obj", "--mass", "-1"], "--mass must be positive, not -1"),
        (["box.obj", "--yaw-deg", "nan"], "--yaw-deg must be a finite number, not nan"),
        (["box.obj", "--seed", "-1"], "--seed must be at least 0, not -1"),
        (["box.obj", "--camera.dropout-share", "2"], "--camera.dropout-share must be between 0 and 1, not 2"),
    ],
)
def test_bad_input_is_told_in_one_line_and_nothing_is_written(arguments, message, capfd):
    obj()
    for file in ("text.txt", "text.obj"):
        Path(file).write_text("hello\n", encoding="utf-8")
    assert observed(*arguments) == codes.BAD_INPUT
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(f"error: {message}")
    assert len(err.splitlines()) == 1
    assert not list(Path().rglob("*.npz"))
