"""The motion of a grasp in a view, and what stands around the object."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("skimage")
pytest.importorskip("plotly")

from browser import DEEP, loaded, needs_a_browser
from plans import small_plan

from sgnlp.base import palette
from sgnlp.cli import run
from sgnlp.hand.arm import load_arm
from sgnlp.hand.hand import on_arm
from sgnlp.hand.meshes import link_poses
from sgnlp.perception.shape import FAR, Shape
from sgnlp.planning import results
from sgnlp.planning.motion.trajectory import APPROACH, CLOSE, LIFT, PHASES, SQUEEZE
from sgnlp.planning.surroundings import Surroundings
from sgnlp.show import png, web_page
from sgnlp.show.scene import scene
from sgnlp.show.scene_around import around
from sgnlp.show.scene_motion import MOST, carried, chosen, frames
from sgnlp.show.scene_parts import ARM, AVOID, OBSTACLES, TOUCH, Frame, Scene, Stage, View
from sgnlp.show.scene_parts import Shape as Drawn

MIDDLE = np.array([0.0, 0.0, 0.04])


def shown(surroundings: Surroundings | None = None) -> Scene:
    """The small plan's grasps with the motion of the best, without surface and cloud."""
    plan = small_plan()
    grasps = plan.arrays()
    if surroundings is not None:
        grasps = replace(grasps, meta=grasps.meta | {"surroundings": surroundings.plain()})
    return scene(grasps, plan.problem.hand, None, np.zeros((0, 3)), (), plan.motion)


def test_the_best_grasp_has_the_frames_of_its_motion_and_the_others_have_none():
    best, other = shown().views
    assert 0 < len(best.frames) <= MOST
    assert not other.frames
    assert list(dict.fromkeys(frame.stage.name for frame in best.frames)) == list(PHASES)
    assert (np.diff([frame.time for frame in best.frames]) > 0).all()


def test_the_links_are_where_the_samples_have_them_and_fingers_that_press_are_where_they_touch():
    plan = small_plan()
    made, grasps, hand = plan.motion, plan.arrays(), plan.problem.hand
    found = dict(zip(chosen(made).tolist(), frames(made, grasps, hand), strict=True))
    for phase, joints in zip(PHASES, (grasps.joints, *[grasps.joints_contact] * 3), strict=True):
        k = made.last(phase)
        np.testing.assert_allclose(found[k].links, link_poses(hand, made.wrist[k], joints[0]), atol=1e-12)
        for i, pull in enumerate(found[k].stage.shapes):
            np.testing.assert_array_equal(pull.vertices[1], made.setpoints[k, i])
            assert pull.colour == palette.finger(i)


def test_the_object_goes_to_its_equilibrium_in_the_squeeze_and_up_with_the_hand():
    plan = small_plan()
    made, g, points = plan.motion, plan.arrays(), np.random.default_rng(0).normal(size=(5, 3))

    def at(k: int) -> np.ndarray:
        R, t = carried(made, g, k)
        return points @ R.T + t

    settled = points @ g.rotation_eq[0].T + g.translation_eq[0]
    np.testing.assert_array_equal(at(made.last(APPROACH)), points)
    np.testing.assert_array_equal(at(made.last(CLOSE)), points)
    np.testing.assert_allclose(at(made.last(SQUEEZE)), settled, atol=1e-12)
    np.testing.assert_allclose(at(made.last(LIFT)), settled + np.array([0, 0, 0.1]), atol=1e-12)
    half = (made.last(CLOSE) + made.last(SQUEEZE)) // 2
    assert 0 < np.abs(at(half) - points).max() < np.abs(settled - points).max()


def test_an_arm_is_drawn_where_its_joints_have_it_and_carries_the_hand():
    plan = small_plan()
    hand = on_arm(plan.problem.hand, load_arm("panda"))
    q, g = hand.arm.home, plan.arrays()
    grasps = replace(g, arm=np.tile(q, (len(g), 3, 1)), arm_joint_names=np.array(hand.arm.joint_names))
    motion = replace(plan.motion, arm=np.tile(q, (len(plan.motion), 1)))
    found = scene(grasps, hand, None, np.zeros((0, 3)), (), motion)
    expected = link_poses(hand.arm, hand.arm.base, q)
    for links in (found.views[0].links, found.views[0].frames[3].links):
        assert len(links) == len(found.links)
        np.testing.assert_array_equal(links[-len(expected) :], expected)
    assert [link.layer for link in found.links].count(ARM) == len(expected)
    assert ARM in found.layers


def test_the_drawn_cube_holds_the_hand_at_every_frame():
    found = shown()
    view = web_page.plain(found)["views"][0]
    for frame in found.views[0].frames:
        for link, T in zip(found.links, frame.links, strict=True):
            placed = link.vertices @ T[:3, :3].T + T[:3, 3]
            assert np.abs(placed - view["centre"]).max() < view["reach"]


def test_obstacles_and_regions_are_drawn_in_their_colours_where_they_are():
    box = Shape.box([0.1, 0.2, 0.3], [0.02, 0.04, 0.06], name="box")
    ball, can = Shape.sphere([0.1, 0, 0], 0.03), Shape.cylinder([0, 0.2, 0], 0.02, 0.1)
    drawn = list(around(Surroundings((box, can), (ball,), (can,)), MIDDLE))
    assert [shape.layer for shape in drawn] == [OBSTACLES, OBSTACLES, AVOID, TOUCH]
    assert [shape.colour for shape in drawn] == [palette.STONE, palette.STONE, palette.RED, palette.GREEN]
    assert all(shape.opacity < 0.5 for shape in drawn)
    for shape, solid in zip(drawn, (box, can, ball, can), strict=True):
        assert np.abs(solid.distance(shape.vertices)).max() < 1e-12


def test_a_half_space_is_drawn_as_the_part_of_its_plane_beside_the_object():
    wall = Shape.half_space([0.0, 0.15, 0.0], [0.0, -1.0, 0.0])
    (drawn,) = around(Surroundings((wall,)), MIDDLE)
    np.testing.assert_allclose(drawn.vertices[:, 1], 0.15, atol=1e-9)
    assert np.abs(drawn.vertices).max() < 0.5
    assert FAR > 1  # else the wall were a box of its own


def test_a_view_has_a_layer_and_a_line_of_the_legend_for_obstacles_that_are_there_alone():
    assert OBSTACLES not in shown().layers
    found = shown(Surroundings((Shape.box([0.3, 0, 0.1], [0.1, 0.1, 0.2], name="wall"),)))
    assert OBSTACLES in found.layers
    assert AVOID not in found.layers
    assert [entry.text for entry in found.legend if entry.layer == OBSTACLES] == ["obstacle"]


def test_an_obstacle_far_away_does_not_make_the_picture_small():
    far = shown(Surroundings((Shape.box([0, 0, 3.0], [0.1, 0.1, 0.1]),)))
    alone, with_it = (png.cells(each).cells[0] for each in (shown(), far))
    assert OBSTACLES in far.layers
    assert alone == with_it  # it is outside


def test_the_command_shows_the_trajectory_that_lies_beside_the_grasps(tmp_path, capfd):
    small_plan().save(tmp_path / "made")
    page = tmp_path / "page.html"
    assert run(["view", str(tmp_path / "made"), "--html", str(page)]) == 0
    assert page.read_text(encoding="utf-8").count('"time": ') == len(chosen(small_plan().motion))
    (tmp_path / "made" / results.MOTION[0]).unlink()
    assert run(["view", str(tmp_path / "made"), "--html", str(page)]) == 0
    assert '"frames": []' in page.read_text(encoding="utf-8")
    capfd.readouterr()


def plain_scene() -> Scene:
    """One triangle that moves for six tenths of a second: quickly drawn."""
    corners, still = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.05]]), (np.eye(3), np.zeros(3))
    link = Drawn("hand", corners, np.array([[0, 1, 2]]), palette.STONE)
    poses = [np.eye(4)[None] for _ in range(4)]
    for k, pose in enumerate(poses):
        pose[0, 2, 3] = 0.05 * k
    moments = tuple(Frame(0.2 * k, pose, Stage(PHASES[k], *still, ())) for k, pose in enumerate(poses))
    view = View("0: one", poses[0], (), (Stage("pregrasp", *still, ()),), (), (), moments)
    return Scene("thing", (link,), (), (view,), ())


@needs_a_browser
def test_the_page_plays_the_motion_to_its_end(tmp_path):
    page = tmp_path / "page.html"
    click = '<script>setTimeout(() => document.getElementById("play").click(), 200)</script></body>'
    page.write_text(web_page.page(plain_scene()).replace("</body>", click), encoding="utf-8")
    elements, told = loaded(page.as_uri(), tmp_path / "profile", *DEEP, "--virtual-time-budget=5000")
    assert not [line for line in told if "Uncaught" in line or "ERROR:CONSOLE" in line]
    assert 'id="frame-name">lift, 0.6 s of 0.6 s<' in elements
    assert 'id="stage-name">as in the motion<' in elements
    assert 'aria-label="play"' in elements
