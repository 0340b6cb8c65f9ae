"""`sgnlp simulate` on a result made by hand."""

import json
import shutil
from dataclasses import asdict, fields, replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")

from grips import box, faces, grip
from motions import motion
from plans import SMALL_FLAGS
from scenes import ellipsoid

from sgnlp.base.presets import ROBUST
from sgnlp.cli import run
from sgnlp.hand.hand import load_hand
from sgnlp.hand.meshes import link_meshes, link_poses
from sgnlp.perception.observation import load
from sgnlp.perception.shape import Shape
from sgnlp.planning import results
from sgnlp.planning.grasps import PER_HAND, Grasps, stack
from sgnlp.planning.surroundings import Surroundings
from sgnlp.program.terms import preset_terms
from sgnlp.show.camera import placed
from sgnlp.show.scene_parts import NEWTON
from sgnlp.show.simulation_pictures import ends, scene
from sgnlp.simulation import SimulationSettings, execute
from sgnlp.simulation.prepared import Prepared, prepared

HAND = load_hand("allegro_left")
SHORT = ("--hold-time", "0.3", "--push-time", "0.2")


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> Path:
    """A folder with a result of two grasps, a sound one and one that misses, and the object."""
    place = tmp_path_factory.mktemp("saved")
    thing = box()
    arrays = {"points": thing.vertices.repeat(8, axis=0), "table_height": 0.0, "name": "box"}
    rng = np.random.default_rng(0)
    arrays["points"] = arrays["points"] + 1e-3 * rng.uniform(size=arrays["points"].shape)
    np.savez(place / "box.npz", **arrays, mesh_vertices=thing.vertices, mesh_faces=thing.faces)
    np.savez(place / "cloud.npz", **arrays)
    good = grip(HAND, *faces(0.06, 0.045))
    rows = [good, replace(good, targets=good.targets + 0.08 * faces(0.06, 0.045)[1])]
    meta = {"hand": "allegro_left", "settings": asdict(ROBUST), "source": "box.npz"}
    empty = stack(HAND, preset_terms(ROBUST), [], meta)
    values = {
        f.name: np.zeros((2, *getattr(empty, f.name).shape[1:]), getattr(empty, f.name).dtype)
        for f in fields(Grasps)
        if f.name not in (*PER_HAND, "meta")
    }
    for name, value in asdict(good).items():
        if name in values and value is not None:
            values[name] = np.array([getattr(row, name) for row in rows])
    values["tips_pregrasp"] = np.array([row.tips for row in rows])
    values["joints_contact"] = values["joints_squeeze"] = values["joints"]  # under position control they do not press
    values["feasible"] = np.array([True, False])
    results.save(replace(empty, **values), {}, place / "made")
    return place


@pytest.fixture
def folder(saved, tmp_path, monkeypatch) -> Path:
    """The result in a copy of its folder, which is the current one."""
    monkeypatch.chdir(shutil.copytree(saved, tmp_path, dirs_exist_ok=True))
    return tmp_path / "made"


def simulate(*arguments: object) -> int:
    return run(["simulate", *map(str, arguments), *SHORT])


def test_the_best_grasp_is_carried_out_shown_and_written(folder, capfd):
    assert simulate(folder) == 0
    shown = capfd.readouterr().out
    assert "held" in shown
    assert "score of the first choice: 1\n" in shown
    made = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))
    assert made["object"] == "box.npz"
    assert (made["settings"]["mass"], made["settings"]["friction"]) == (0.3, 0.6)
    assert "carried out with 0.3 kg (as planned for), friction 0.6 (as planned for)" in shown
    assert "No link but the pads touched the object while closing." in shown
    assert "4 of 4 pads carry load." in shown
    closing = made["grasps"][0]["closing"]
    assert (closing["links"], closing["pads_loaded"], len(closing["tip_errors"])) == ([], 4, 4)
    (grasp,) = made["grasps"]
    assert (grasp["rank"], grasp["ending"], grasp["score"], len(grasp["pushes"])) == (0, "held", 1.0, 6)
    assert "trace" not in grasp


def test_the_objects_own_mass_and_friction_are_taken_if_asked_for(folder, capfd):
    arguments = (folder, "--true-load", "--push-weights", 0)
    assert simulate(*arguments) == 3
    assert "--true-load needs the mass and friction of 'box' in its file" in capfd.readouterr().err
    with np.load("box.npz") as known:
        np.savez("box.npz", **known, mass=5.0, friction=0.4)
    assert simulate(*arguments) == 1
    settings = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["settings"]
    assert (settings["mass"], settings["friction"]) == (5.0, 0.4)


def test_mass_and_friction_that_are_given_are_taken_before_the_plans(folder, capfd):
    assert simulate(folder, "--mass", 0.1, "--push-weights", 0) == 0
    assert "carried out with 0.1 kg (as given), friction 0.6 (as planned for)" in capfd.readouterr().out
    settings = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["settings"]
    assert (settings["mass"], settings["friction"]) == (0.1, 0.6)


def test_a_plan_without_gravity_is_carried_out_with_the_mass_of_the_default(folder, capfd):
    grasps = results.load_grasps(folder)
    grasps.meta["settings"]["contact"] |= {"mass": 0.0, "friction": 0.8}
    results.save(grasps, {}, folder)
    assert simulate(folder, "--push-weights", 0) == 0
    said = "carried out with 0.1 kg (the plan has no mass), friction 0.8 (as planned for)"
    assert said in capfd.readouterr().out


def test_the_hand_can_stand_beside_its_place(folder):
    assert simulate(folder, "--push-weights", 0, "--place-error", 0.04, "--seed", 3) == 1
    made = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))
    assert (made["settings"]["place_error"], made["settings"]["seed"]) == (0.04, 3)


def test_position_control_goes_to_the_joints_that_squeeze_which_here_touch_nothing(folder, capfd):
    assert simulate(folder, "--control", "position", "--push-weights", 0) == 1
    assert "0 of 4 pads carry load." in capfd.readouterr().out


def test_as_many_grasps_as_asked_for_are_carried_out(folder, capfd):
    assert simulate(folder / "grasps.npz", "--grasps", 2, "--push-weights", 0) == 0
    assert "score of the first choice: 1; mean of 2 grasps: 0.50\n" in capfd.readouterr().out
    assert [g["score"] for g in json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["grasps"]] == [
        1.0,
        0.0,
    ]


def test_all_are_the_feasible_ones(folder, capfd):
    assert simulate(folder, "--grasps", "all", "--push-weights", 0) == 0
    assert "score of the first choice: 1\n" in capfd.readouterr().out


def test_it_ends_with_1_where_nothing_holds(folder, capfd):
    assert simulate(folder, "--mass", 5) == 1
    assert "not lifted" in capfd.readouterr().out


def around(folder: Path, *obstacles: Shape) -> None:
    """Put obstacles into the result."""
    grasps = results.load_grasps(folder)
    grasps.meta["surroundings"] = Surroundings(obstacles).plain()
    results.save(grasps, {}, folder)


def test_the_obstacles_of_the_plan_are_there_and_what_touches_them_is_told(folder, capfd):
    around(folder, Shape.box([0.0, 0.0, 0.3], [0.4, 0.4, 0.3], name="roof"))
    assert simulate(folder, "--push-weights", 0) == 1
    (grasp,) = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["grasps"]
    assert grasp["ending"] == "in collision"
    assert {knock["hit"] for knock in grasp["knocks"]} == {"roof"}
    shown = capfd.readouterr().out
    assert "touched roof: " in shown
    assert next(line for line in shown.splitlines() if line.startswith("0 ")).endswith("roof")


def test_an_object_that_took_the_place_of_the_solved_one_is_told(folder, capfd):
    grasps = results.load_grasps(folder)
    for digest, told in ((load("box.npz").digest, False), ("0", True)):
        grasps.meta["input_digest"] = digest
        results.save(grasps, {}, folder)
        assert simulate(folder) == 0
        shown = capfd.readouterr().out
        assert ("'box.npz' has changed, or was read with other options, since it was solved" in shown) == told
    assert simulate(folder, "--object", "box.npz") == 3  # which obstacles there were is not known then
    capfd.readouterr()


def test_the_solved_file_is_read_in_its_unit(folder):
    with np.load("box.npz") as known:
        arrays = dict(known)
    np.savez("box.npz", **arrays | {name: 1e3 * arrays[name] for name in ("points", "mesh_vertices", "table_height")})
    assert simulate(folder) == 3
    grasps = results.load_grasps(folder)
    grasps.meta["reading"] = {"scale": 0.001}
    results.save(grasps, {}, folder)
    assert simulate(folder) == 0
    assert simulate(folder, "--scale", 1) == 3
    assert simulate(folder, "--object", "box.npz", "--scale", 0.001) == 0


def test_what_the_camera_saw_beside_the_object_is_there_even_where_the_true_object_is_in_another_file(folder):
    with np.load("box.npz") as known:
        arrays = dict(known)
    np.savez("true.npz", **arrays)
    beside = np.array([[x, 0.0, z] for x in np.linspace(0.05, 0.1, 8) for z in np.linspace(0.0, 0.1, 8)])
    np.savez("box.npz", **arrays, obstacle_points=beside, obstacle=np.ones(len(beside), int))
    grasps = results.load_grasps(folder)
    grasps.meta["input_digest"] = load("box.npz").digest
    results.save(grasps, {}, folder)
    for arguments in ((), ("--object", "true.npz")):
        assert simulate(folder, "--push-weights", 0, *arguments) == 1
        (grasp,) = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["grasps"]
        assert {knock["hit"] for knock in grasp["knocks"]} == {"obstacle 1"}


def test_a_hand_that_floats_carries_out_its_motion_if_asked_to(folder, capfd):
    assert simulate(folder, "--push-weights", 0) == 0
    assert "The wrist was off its path" not in capfd.readouterr().out
    assert simulate(folder, "--push-weights", 0, "--motion") == 0
    assert "The wrist was off its path by at most 0.0 mm on the approach" in capfd.readouterr().out
    (grasp,) = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["grasps"]
    assert grasp["carriage"]["torque_share"] == 0.0
    assert grasp["lift"]["rise"] == pytest.approx(0.1, abs=0.01)


def test_pictures_are_drawn_without_a_screen(folder):
    pytest.importorskip("matplotlib")
    (folder / "simulation-approach.png").write_bytes(b"of a run before")
    assert simulate(folder, "--pictures", "--push-weights", 0) == 0
    drawn = {file.name: file.read_bytes()[:4] for file in folder.glob("*.png")}
    assert drawn == {f"simulation-{phase}.png": b"\x89PNG" for phase in ("pregrasp", "close", "lift", "hold")}


def test_a_picture_shows_hand_object_and_forces_where_the_simulation_had_them():
    thing, settings = box(), SimulationSettings(hold_time=0.3, push_time=0.2, push_weights=0)
    asked = grip(HAND, *faces(0.06, 0.045))
    outcome = execute(asked, thing, HAND, settings)
    shown = scene(Prepared(asked, HAND, None), thing, settings, outcome, "box")
    assert [view.title.split(",")[0] for view in shown.views] == ["pregrasp", "close", "lift", "hold"]
    for rank, row in enumerate(ends(outcome.trace).values()):
        shapes, tips = placed(shown, rank, 0), outcome.trace.tips[row]
        hand = np.concatenate([shape.vertices for shape in shapes if shape.layer == "hand"])
        assert all(np.linalg.norm(hand - tip, axis=1).min() < 0.02 for tip in tips)
        forces = np.array([np.diff(shape.vertices, axis=0)[0] for shape in shapes if shape.layer == "forces"])
        np.testing.assert_allclose(forces, NEWTON * outcome.trace.forces[row], atol=1e-12)
    (first,), (last,) = ([s.vertices for s in placed(shown, rank, 0) if s.layer == "object"] for rank in (0, 3))
    assert outcome.lift is not None
    assert (last - first)[:, 2].mean() == pytest.approx(outcome.lift.rise, abs=0.005)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--object", "cloud.npz"), "'box' has no true surface"),
        (("--object", "box.npz", "--estimated"), "--estimated takes neither --object nor --true-load"),
        (("--estimated",), "--estimated needs the surface of the plan: 'box.npz' has changed"),
        (("--object", "gone.npz"), "error: 'gone.npz' is not there\n"),
        (("--grasps", "3"), "--grasps must be between 1 and 2"),
        (("--true-load", "--mass", "1"), "--true-load takes the mass in the object's file; leave out --mass"),
        (("--mass", "-1"), "--simulation.mass must be positive"),
        (("--rise", "0.05"), "--simulation.rise is above"),
    ],
)
def test_a_bad_input_is_refused_in_one_line(folder, capfd, arguments, message):
    assert simulate(folder, *arguments) == 3
    told = capfd.readouterr().err
    assert message in told
    assert told.count("\n") == 1
    assert not (folder / "simulation.json").exists()


def test_a_result_that_does_not_fit_its_hand_is_refused(folder, capfd):
    grasps = results.load_grasps(folder)
    results.save(replace(grasps, joint_names=grasps.joint_names[::-1]), {}, folder)
    assert simulate(folder) == 3
    assert "grasps.npz': joint_names must be those of the hand 'allegro_left'" in capfd.readouterr().err
    grasps.meta["settings"]["contact"]["friction"] = "x"
    results.save(grasps, {}, folder)
    assert simulate(folder) == 3
    assert capfd.readouterr().err.endswith("grasps.npz' cannot be read; solve it again\n")


def test_a_result_without_grasps_is_refused(folder, capfd):
    meta = results.load_grasps(folder).meta
    results.save(stack(HAND, preset_terms(ROBUST), [], meta), {}, folder)
    for arguments in ((), ("--grasps", "all")):
        assert simulate(folder, *arguments) == 3
        assert capfd.readouterr().err == "error: the result has no grasps\n"


def test_a_missing_result_is_refused(folder, capfd):
    assert simulate("nothing") == 3
    assert "no result at 'nothing'" in capfd.readouterr().err


def test_a_picture_shows_the_arm_and_the_obstacles_where_they_are():
    hand = load_hand("allegro_left", arm="panda")
    asked, settings = grip(HAND, *faces(0.06, 0.045)), SimulationSettings(hold_time=0.1, push_weights=0)
    made, crate = motion(hand, asked.wrist), Shape.box([0.3, 0.1, 0.05], [0.1, 0.1, 0.1], name="crate")
    outcome = execute(asked, box(), hand, settings, (crate,), made)
    shown = scene(prepared(asked, hand, settings, made), box(), settings, outcome, "box", (crate,))
    assert [view.title.split(",")[0] for view in shown.views] == ["approach", "close", "lift", "hold"]
    shapes = placed(shown, 0, 0)
    (box_,) = (shape.vertices for shape in shapes if shape.layer == "obstacles")
    np.testing.assert_allclose([box_.min(axis=0), box_.max(axis=0)], [[0.25, 0.05, 0], [0.35, 0.15, 0.1]], atol=1e-12)
    arm = [shape.vertices for shape in shapes if shape.layer == "arm"]
    joints = outcome.trace.qpos[ends(outcome.trace)["approach"]][:7]
    places = link_poses(hand.arm, hand.arm.base, joints)
    for vertices, mesh, place in zip(arm, link_meshes(hand.arm)[0], places, strict=True):
        np.testing.assert_allclose(vertices, mesh.vertices @ place[:3, :3].T + place[:3, 3], atol=1e-9)
    fingers = np.concatenate([shape.vertices for shape in shapes if shape.layer == "hand"])
    assert all(np.linalg.norm(fingers - tip, axis=1).min() < 0.02 for tip in asked.tips)


def test_the_estimated_surface_is_carried_out_on_where_nobody_knows_the_true_one(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    np.savez("egg.npz", points=ellipsoid(), table_height=0.0)
    assert run(["solve", "egg.npz", "--starts", "1", "--quiet", *SMALL_FLAGS]) == 0
    assert simulate("results/egg") == 3
    assert "--estimated takes the surface of the plan" in capfd.readouterr().err
    short = ("--push-weights", 0, "--close-time", 0.1, "--piece-error", 0.01)
    assert simulate("results/egg", "--estimated", *short) in (0, 1)
    assert "on the estimated surface, not the true one" in capfd.readouterr().out
    assert json.loads(Path("results/egg/simulation.json").read_text(encoding="utf-8"))["estimated"]
