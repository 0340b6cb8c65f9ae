"""Scenes of planned grasps, and the backends that draw them."""

import shutil
import subprocess
from dataclasses import asdict, fields, replace

import numpy as np
import pytest

pytest.importorskip("skimage")
pytest.importorskip("plotly")

from grips import box, faces, grip

from sgnlp import results, scene_png
from sgnlp.cli import run
from sgnlp.grasps import PER_HAND, Grasps, stack
from sgnlp.hand import load_hand
from sgnlp.kinematics import frames
from sgnlp.observation import load
from sgnlp.presets import ROBUST
from sgnlp.scene3d import CONES, SURFACE, coil, cone, scene, stages

HAND = load_hand("allegro_left")
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
FLAGS = "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --enable-logging=stderr"


@pytest.fixture
def grasps(tmp_path) -> Grasps:
    """One grasp of a box, whose cloud is read from a file."""
    thing = box()
    rng = np.random.default_rng(0)
    low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    points = rng.uniform(low, high, (400, 3))
    side = rng.integers(3, size=400)
    points[np.arange(400), side] = np.where(rng.random(400) < 0.5, low[side], high[side])
    np.savez(tmp_path / "box.npz", points=points, table_height=0.0, name="box")
    cloud = load(tmp_path / "box.npz")
    meta = {"hand": "allegro_left", "settings": asdict(ROBUST), "source": cloud.source, "object": "box", "seed": 0}
    meta |= {"input_digest": cloud.digest, "reading": cloud.reading, "table_height": 0.0}
    empty = stack(HAND, [], meta)
    values = {f.name: getattr(empty, f.name) for f in fields(Grasps) if f.name not in (*PER_HAND, "meta")}
    values = {name: np.zeros((1, *value.shape[1:]), value.dtype) for name, value in values.items()}
    good = asdict(grip(HAND, *faces(0.06, 0.045)))
    values |= {name: np.array([value]) for name, value in good.items() if name in values and value is not None}
    values["tips_pregrasp"] = frames(HAND, values["wrist"][0], values["joints"][0])[0][None]
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
    rim = cone(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.6).vertices[1:]
    np.testing.assert_allclose(np.hypot(rim[:, 0], rim[:, 1]) / rim[:, 2], 0.6)


def test_the_tips_of_the_shown_hand_are_where_the_plan_has_them(grasps):
    shown = scene(grasps, HAND, None, np.zeros((0, 3)))
    placed = np.concatenate([s.vertices for s in scene_png.placed(shown, 0, 0) if s.layer == "hand"])
    for tip in grasps.tips_pregrasp[0]:
        assert np.linalg.norm(placed - tip, axis=1).min() < 0.02
    assert {shape.layer for shape in shown.views[0].shapes} >= {CONES}
    assert SURFACE not in {shape.layer for shape in shown.shapes}


def test_another_cloud_is_left_out_with_a_note(grasps, tmp_path, capfd):
    np.savez(tmp_path / "box.npz", points=np.random.default_rng(1).random((90, 3)) / 10, table_height=0.0)
    assert run(["view", str(tmp_path / "made"), "--html", str(tmp_path / "page.html")]) == 0
    assert "Without cloud and surface" in capfd.readouterr().out
    assert "has changed" in (tmp_path / "page.html").read_text(encoding="utf-8")[-6_000_000:]


@pytest.mark.skipif(BROWSER is None, reason="needs chromium")
def test_the_page_draws_hand_object_and_springs_without_an_error(grasps, tmp_path):
    page = tmp_path / "page.html"
    assert run(["view", str(tmp_path / "made"), "--html", str(page), "--png", str(tmp_path / "it.png")]) == 0
    assert (tmp_path / "it.png").read_bytes().startswith(b"\x89PNG")
    command = [str(BROWSER), *FLAGS.split(), "--virtual-time-budget=5000", "--dump-dom", page.as_uri()]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=400)
    drawn = done.stdout.rpartition('data-drawn="')[2].partition('"')[0].split(",")
    assert {"hand", "surface", "cloud", "springs", "contacts", "normals", "friction cones", "table"} <= set(drawn)
    told = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert not [line for line in told if "Uncaught" in line or "ERROR:CONSOLE" in line or "Failed" in line]


def test_a_missing_result_is_refused(capfd):
    assert run(["view", "nothing"]) == 3
    assert "no result at 'nothing'" in capfd.readouterr().err
