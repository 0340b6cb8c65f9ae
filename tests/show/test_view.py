"""Scenes of planned grasps, and the backends that draw them."""

import io
import json
import threading
from dataclasses import asdict, fields, replace
from html import unescape
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest

pytest.importorskip("skimage")
pytest.importorskip("plotly")

from browser import drawn, needs_a_browser
from grips import box, faces, grip
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from sgnlp.base import palette
from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST
from sgnlp.cli import run
from sgnlp.hand.hand import load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.perception.observation import load
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.planning import reopen, results
from sgnlp.planning.grasps import PER_HAND, Grasps, stack
from sgnlp.program.terms import preset_terms
from sgnlp.show import camera as scene_camera
from sgnlp.show import png, sheets, web_page
from sgnlp.show.scene import scene, stages
from sgnlp.show.scene_parts import (
    ARM,
    AVOID,
    AXES,
    CONES,
    FORCES,
    FRAMES,
    LAYERS,
    LEGEND,
    OBJECT,
    OBSTACLES,
    SPRINGS,
    STARTS,
    SURFACE,
    TOUCH,
    Scene,
)
from sgnlp.show.scene_shapes import coil, cone

ALLEGRO = load_hand("allegro_left")


@pytest.fixture
def grasps(tmp_path) -> Grasps:
    """One grasp of a box, whose cloud is read from a file."""
    return made_in(tmp_path)


def made_in(tmp_path: Path) -> Grasps:
    """The grasp of the box, saved in a folder with the cloud beside it."""
    thing = box()
    rng = np.random.default_rng(0)
    low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    points = rng.uniform(low, high, (400, 3))
    side = rng.integers(3, size=400)
    points[np.arange(400), side] = np.where(rng.random(400) < 0.5, low[side], high[side])
    np.savez(tmp_path / "box.npz", points=points, table_height=0.0, name="box")
    cloud = load(tmp_path / "box.npz")
    meta = {"hand": "allegro_left", "settings": asdict(ROBUST), "source": cloud.source, "object": "box", "seed": 0}
    meta |= {"input_digest": cloud.digest, "reading": asdict(cloud.reading), "table_height": 0.0}
    empty = stack(ALLEGRO, preset_terms(ROBUST), [], meta)
    values = {f.name: getattr(empty, f.name) for f in fields(Grasps) if f.name not in (*PER_HAND, "meta")}
    values = {name: np.zeros((1, *value.shape[1:]), value.dtype) for name, value in values.items()}
    good = asdict(grip(ALLEGRO, *faces(0.06, 0.045)))
    values |= {name: np.array([value]) for name, value in good.items() if name in values and value is not None}
    values["tips_pregrasp"] = frames(ALLEGRO, values["wrist"][0], values["joints"][0])[0][None]
    p = values["contacts"] = values["tips_pregrasp"] * 0.7 + values["targets"] * 0.3
    angle, shift = 0.2, np.array([0.0, 0.01, 0.0])
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    values |= {"rotation_eq": R[None], "translation_eq": shift[None], "contacts_eq": p @ R.T + shift}
    values["contact_points"] = p.copy()
    values["normals"] = np.tile([0.0, 1.0, 0.0], (*p.shape[:2], 1))
    made = replace(empty, **values)
    results.save(made, {}, tmp_path / "made")
    return made


def test_the_last_stage_is_the_equilibrium_and_the_second_has_not_moved(grasps):
    first, contact, *_, last = stages(grasps, 0)
    for still in (first, contact):
        np.testing.assert_allclose(still.rotation, np.eye(3), atol=1e-15)
        np.testing.assert_allclose(still.translation, 0, atol=1e-15)
    moved = grasps.contacts[0] @ last.rotation.T + last.translation
    np.testing.assert_allclose(moved, grasps.contacts_eq[0], atol=1e-12)


def test_a_spring_runs_from_tip_to_target():
    start, end = np.array([0.1, 0.0, 0.2]), np.array([0.0, 0.05, 0.1])
    path = coil(start, end)
    np.testing.assert_allclose(path[[0, -1]], [start, end], atol=1e-15)


def test_a_cone_opens_by_the_friction_angle():
    rim = cone(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.6, palette.INK).vertices[1:]
    np.testing.assert_allclose(np.hypot(rim[:, 0], rim[:, 1]) / rim[:, 2], 0.6)


def test_the_tips_of_the_shown_hand_are_where_the_plan_has_them(grasps):
    shown = scene(grasps, ALLEGRO, None, np.zeros((0, 3)))
    placed = np.concatenate([s.vertices for s in png.placed(shown, 0, 0) if s.layer == "hand"])
    for tip in grasps.tips_pregrasp[0]:
        assert np.linalg.norm(placed - tip, axis=1).min() < 0.02
    assert {shape.layer for shape in shown.views[0].shapes} >= {CONES}
    assert SURFACE not in {shape.layer for shape in shown.shapes}


def test_another_cloud_is_left_out_with_a_note(grasps, tmp_path, capfd):
    np.savez(tmp_path / "box.npz", points=np.random.default_rng(1).random((90, 3)) / 10, table_height=0.0)
    assert run(["view", str(tmp_path / "made"), "--html", str(tmp_path / "page.html")]) == 0
    assert "Without cloud and surface" in capfd.readouterr().out
    assert "has changed" in (tmp_path / "page.html").read_text(encoding="utf-8")[-6_000_000:]


@pytest.mark.parametrize(
    ("command", "flags", "said"),
    [
        ("view", ("--html", "page.png"), "--html must end in .html; found 'page.png'"),
        ("view", ("--png", "page.jpg"), "--png must end in .png; found 'page.jpg'"),
        ("check-hand", ("--png", "hand"), "--png must end in .png; found 'hand'"),
    ],
)
def test_a_file_whose_name_is_of_another_kind_is_refused_before_any_work(
    tmp_path, monkeypatch, capfd, command, flags, said
):
    monkeypatch.chdir(tmp_path)
    assert run([command, "nowhere", *flags]) == 3
    assert capfd.readouterr() == ("", f"error: {said}\n")
    assert not list(tmp_path.iterdir())


# Where it is seen from -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shown(tmp_path_factory) -> Scene:
    """The whole scene, with cloud and surface."""
    tmp_path = tmp_path_factory.mktemp("shown")
    made_in(tmp_path)
    result = reopen.reopen(tmp_path / "made")
    return scene(result.grasps, result.hand, result.problem, result.cloud.points)


def outside(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Whether places (m, 2) are outside the convex hull of points (N, 2)."""
    return Delaunay(points).find_simplex(places) < 0


def test_the_page_opens_on_the_middle_of_hand_and_object_from_above(shown):
    points = scene_camera.seen(scene_camera.placed(shown, 0, 0))
    told = web_page.plain(shown)
    view, towards = told["views"][0], np.array(told["camera"]["towards"])
    assert (np.abs(view["centre"] - (points.min(axis=0) + points.max(axis=0)) / 2) < 1e-9).all()
    assert np.linalg.norm(points - view["centre"], axis=1).max() == pytest.approx(view["radius"])
    assert 0.3 < towards[2] < 0.7  # not from the zenith
    assert np.linalg.norm(towards) == pytest.approx(1)


def test_labels_stand_beside_hand_and_object_in_order_and_apart(shown):
    view, shapes = shown.views[0], scene_camera.placed(shown, 0, 0)
    points, away = scene_camera.seen(shapes), [label for label in view.labels if not label.here]
    places = np.array([label.place for label in away])
    for azimuth in png.AZIMUTHS:
        camera = scene_camera.axes_of_view(azimuth, png.ELEVATION)
        flat, anchors = points @ camera[:2].T, places @ camera[:2].T
        texts = scene_camera.beside(flat, anchors)
        assert outside(flat, texts).all()
        order = np.argsort(texts[:, 0])
        np.testing.assert_array_equal(order, np.argsort(anchors[:, 0]))
        assert (texts[:, 1] < flat[:, 1].min()).all()
        assert (np.diff(texts[order, 0]) > 0.03).all()


# Colours and legend ---------------------------------------------------------------------------------------------------


def test_every_symbol_has_a_line_in_the_legend_and_every_layer_its_box(shown):
    assert {entry.layer for entry in LEGEND} == set(LAYERS)
    others = (
        FRAMES,
        STARTS,
        OBJECT,
        FORCES,
        ARM,
        OBSTACLES,
        AVOID,
        TOUCH,
    )  # of check-hand, simulations, arms, surroundings
    there = tuple(entry for entry in LEGEND if entry.layer not in others)
    assert shown.layers == tuple(layer for layer in LAYERS if layer not in others)
    assert shown.legend == there
    assert shown.fingers == tuple(finger.name for finger in ALLEGRO.fingers)
    told = web_page.plain(shown)
    assert [entry["text"] for entry in told["legend"]] == [entry.text for entry in there]
    assert [finger["colour"] for finger in told["fingers"]] == [palette.css(palette.finger(i)) for i in range(4)]


def test_a_finger_has_its_colour_in_all_that_is_its_own(shown):
    view = shown.views[0]
    own = {
        s.colour for s in (*view.shapes, *view.stages[0].shapes) if s.layer in (SPRINGS, CONES, "contacts", "normals")
    }
    assert own == {palette.finger(i) for i in range(4)}
    assert [label.colour for label in view.labels if not label.here] == [palette.finger(i) for i in range(4)]
    assert own < {link.colour for link in shown.links}


def test_the_hand_is_light_and_seen_through(shown):
    for link in shown.links:
        assert link.opacity < 0.5
    greys = [link.colour for link in shown.links if link.colour not in palette.FINGERS]
    assert min(sum(w * c for w, c in zip(palette.LUMA, grey, strict=True)) for grey in greys) > 0.69
    assert palette.lightened((0.9, 0.9, 0.9)) == (0.9, 0.9, 0.9)
    assert palette.lightened((1.0, 1.0, 1.0)) == (1.0, 1.0, 1.0)


def test_the_axes_are_five_centimetres_of_the_world_with_their_letters(shown):
    lines = [shape.vertices for shape in shown.views[0].shapes if shape.layer == AXES]
    np.testing.assert_allclose([line[1] - line[0] for line in lines], 0.05 * np.eye(3), atol=1e-12)
    assert [label.text for label in shown.views[0].labels if label.here] == ["x", "y", "z"]


def test_the_surface_faces_outward(shown):
    (found,) = [shape for shape in shown.shapes if shape.layer == SURFACE]
    assert Mesh(found.vertices, found.cells).volume > 0


def test_a_picture_has_three_views_and_a_legend_of_one_size_below_its_title(shown):
    image = pytest.importorskip("PIL.Image")
    made = png.cells(shown)
    sizes = {image.open(io.BytesIO(cell)).size for cell in made.cells}
    assert (len(made.cells), len(sizes)) == (4, 1)
    assert made.title == "box, grasp 0: start 0, not feasible: , first contact"
    width, height = image.open(io.BytesIO(png.joined(made))).size
    ((wide, high),) = sizes
    assert width == 2 * wide
    assert height > 2 * high


def test_the_page_is_as_wide_as_a_phone(shown):
    head = web_page.page(shown)[:1000]
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in head


def test_a_browser_is_served_the_page_and_a_taken_port_is_refused(shown):
    content = web_page.page(shown)
    with web_page.server(content, 0) as server:
        threading.Thread(target=server.handle_request).start()
        with urlopen(f"http://localhost:{server.server_port}", timeout=10) as answer:
            assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
            assert answer.read().decode() == content
        with pytest.raises(InputError, match="--port"):
            web_page.server(content, server.server_port)


def test_wrist_and_joints_are_told_with_unit_and_limits(grasps):
    _, position, quaternion, turned = sheets.wrist(grasps, 0, ALLEGRO).rows
    np.testing.assert_allclose([float(v) for v in position[1:4]], grasps.wrist[0, :3], atol=5e-5)
    np.testing.assert_allclose([float(v) for v in quaternion[1:]], grasps.wrist[0, 3:], atol=5e-6)
    roll, pitch, yaw = np.radians([float(v) for v in turned[1:4]])
    turn = Rotation.from_rotvec([0, 0, yaw]) * Rotation.from_rotvec([0, pitch, 0]) * Rotation.from_rotvec([roll, 0, 0])
    np.testing.assert_allclose(turn.as_matrix(), Rotation.from_quat(grasps.wrist[0, 3:]).as_matrix(), atol=5e-4)
    _, *rows = sheets.joints(grasps, 0, ALLEGRO).rows
    assert [row[0] for row in rows] == list(ALLEGRO.joint_names)
    for row, q, low, high in zip(rows, grasps.joints[0], ALLEGRO.lower, ALLEGRO.upper, strict=True):
        assert row[2] == "rad"
        np.testing.assert_allclose([float(row[i]) for i in (1, 4, 5)], [q, low, high], atol=5e-5)
        assert float(row[3]) == pytest.approx(np.degrees(q), abs=0.05)


PHONE, SCREEN = "--window-size=600,1200", "--window-size=1000,600"
"""On a phone the scene stands above the tables, on a screen beside them."""


@pytest.fixture(scope="module")
def on_a_screen(tmp_path_factory) -> tuple[set[str], str]:
    """What the command's page draws there, and its elements."""
    folder = tmp_path_factory.mktemp("viewed")
    made_in(folder)
    page, picture = folder / "page.html", folder / "it.png"
    assert run(["view", str(folder / "made"), "--html", str(page), "--png", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    return drawn(page, folder / "profile", SCREEN)


@needs_a_browser
def test_the_page_draws_hand_object_and_springs_without_an_error(on_a_screen):
    layers, _ = on_a_screen
    assert {"hand", "surface", "cloud", "springs", "contacts", "normals", "friction cones", "table"} <= layers


def sparse(whole: Scene) -> Scene:
    """The scene with all of its corners but a twentieth of its triangles: as large, and drawn sooner."""
    thin = {name: tuple(replace(s, cells=s.cells[::20]) for s in getattr(whole, name)) for name in ("links", "shapes")}
    return replace(whole, **thin)


@needs_a_browser
@pytest.mark.parametrize("size", [PHONE, SCREEN])
def test_hand_and_object_fill_most_of_the_page_s_view_and_none_of_it_is_cut_off(shown, request, tmp_path, size):
    if size == SCREEN:
        _, text = request.getfixturevalue("on_a_screen")
    else:
        (tmp_path / "page.html").write_text(web_page.page(sparse(shown)), encoding="utf-8")
        _, text = drawn(tmp_path / "page.html", tmp_path / "profile", size)
    place, width, height = json.loads(unescape(text.rpartition('data-view="')[2].partition('"')[0]))
    assert (width > height) == (size == SCREEN)
    view = web_page.plain(shown)["views"][0]
    eye = (
        2 * view["reach"] * np.array([place["x"], place["y"], place["z"]])
    )  # from the centre; Plotly's unit is the cube
    away = np.linalg.norm(eye)
    axes = scene_camera.axes_of_view()
    np.testing.assert_allclose(eye / away, axes[2], atol=1e-6)
    points = (scene_camera.seen(scene_camera.placed(shown, 0, 0)) - view["centre"]) @ axes.T
    tangents = np.abs(points[:, :2]) / (away - points[:, 2:])
    half = np.tan(np.radians(scene_camera.FIELD) / 2) * np.array([width / height, 1.0])
    assert (tangents < half).all()
    assert 0.5 < (tangents / half.min()).max() < 0.9


def test_a_missing_result_is_refused(capfd):
    assert run(["view", "nothing"]) == 3
    assert "no result at 'nothing'" in capfd.readouterr().err
