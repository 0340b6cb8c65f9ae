"""What is read from the simulator: touches and their forces, overlaps, sliding, and the samples that are kept."""

from types import SimpleNamespace

import numpy as np
import pytest
from readings import turn

from sgnlp.simulation import recorder
from sgnlp.simulation.contacts import Touch, penetrations, touches
from sgnlp.simulation.recorder import TRACE_EVERY, Recorder

pytest.importorskip("mujoco")

import mujoco

# --- contacts --------------------------------------------------------------------------------------------------------

SCENE = """<mujoco><option cone="elliptic"/><worldbody>
  <geom name="table" type="plane" size="1 1 1"/>
  <body name="{first}" pos="0 0 {height}"><freejoint/><geom name="{first}" type="box" size="0.03 0.03 0.03" mass="0.2"/>
  </body>
  <body name="{second}" pos="0 0 {above}"><freejoint/><geom name="{second}" type="sphere" size="0.01" mass="0.05"/>
  </body>
</worldbody></mujoco>"""


def stacked(first: str, second: str, overlap: float = 0.0):
    """A ball on a box on the table: a `World` and its data, one of the two the object, the other a finger's pad."""
    height, above = 0.03 - overlap, 0.07 - 3 * overlap
    model = mujoco.MjModel.from_xml_string(SCENE.format(first=first, second=second, height=height, above=above))
    data, named = mujoco.MjData(model), {name: model.geom(name).id for name in ("table", "object", "pad")}
    world = SimpleNamespace(
        model=model,
        object_geoms=frozenset({named["object"]}),
        hand_geoms=frozenset({named["pad"]}),
        arm_geoms=frozenset(),
        obstacles={},
        table=named["table"],
    )
    return world, data, named


@pytest.mark.parametrize("order", [("object", "pad"), ("pad", "object")], ids=["pad above", "pad below"])
def test_the_forces_of_contacts_are_those_on_the_object_whichever_geom_comes_first(order):
    world, data, named = stacked(*order)
    mujoco.mj_step(world.model, data, 2000)
    mujoco.mj_forward(world.model, data)
    found = {}
    for touch in touches(world, data):
        found[touch.geom] = found.get(touch.geom, 0.0) + touch.force
        outwards = touch.normal @ (touch.point - data.xpos[world.model.body("object").id])
        assert outwards > 0
        assert touch.force @ touch.normal < 0  # contacts press
    weight = 9.81 * np.array([0.2, 0.05])
    if order[0] == "object":
        np.testing.assert_allclose(found[named["pad"]], [0, 0, -weight[1]], atol=1e-3)
        np.testing.assert_allclose(found[named["table"]], [0, 0, weight.sum()], atol=1e-3)
    else:
        np.testing.assert_allclose(found[named["pad"]], [0, 0, weight[1]], atol=1e-3)
        assert named["table"] not in found


@pytest.mark.parametrize("order", [("object", "pad"), ("pad", "object")], ids=["pad above", "pad below"])
def test_overlaps_are_told_of_the_hand_alone_and_by_what_it_overlaps(order):
    world, data, _ = stacked(*order, overlap=2e-3)
    mujoco.mj_forward(world.model, data)
    depth = penetrations(world, data)
    assert depth["object"] == pytest.approx(4e-3, abs=1e-9)
    assert depth["table"] == pytest.approx(2e-3 if order[0] == "pad" else 0.0, abs=1e-9)
    assert depth["self"] == 0.0
    others = {"table": world.table, "arm_geoms": frozenset(), "obstacles": {}}
    both = SimpleNamespace(hand_geoms=frozenset({0, 1, 2} - {world.table}), **others)
    assert penetrations(both, data)["self"] == pytest.approx(4e-3, abs=1e-9)


def test_what_does_not_overlap_has_no_depth():
    world, data, _ = stacked("object", "pad", overlap=-1e-3)
    mujoco.mj_forward(world.model, data)
    assert penetrations(world, data) == {"object": 0.0, "table": 0.0, "self": 0.0, "obstacles": 0.0}


# --- readings --------------------------------------------------------------------------------------------------------

OBJECT, PADS, LINK, TABLE = 1, [2, 3], 4, 0
"""Bodies. The geoms have the same numbers, and the second pad another geom, 5."""
HULL = np.array([(x, y, z) for x in (-0.01, 0.03) for y in (-0.03, 0.02) for z in (0.0, 0.05)])


class Scene:
    """MuJoCo's data made by hand, and a recorder of it."""

    def __init__(self, monkeypatch):
        bodies = np.array([TABLE, OBJECT, *PADS, LINK, PADS[1]])
        world = SimpleNamespace(
            model=SimpleNamespace(geom_bodyid=bodies),
            object_body=OBJECT,
            pad_links=np.array(PADS),
            tips=np.array([1, 0]),
            table=TABLE,
            hand_geoms=frozenset({2, 3, LINK, 5}),
            arm=None,
            arm_geoms=frozenset(),
            obstacles={},
            wrist=lambda data: data.xpos[LINK],
            link={LINK: "palm"}.get,
            hand_speeds=np.array([3, 1]),
            effort=np.array([0.7, 0.35]),
        )
        self.recorder = Recorder(world, HULL)
        self.touches = []
        monkeypatch.setattr(recorder, "touches", lambda world, data: iter(self.touches))
        self.data = SimpleNamespace(
            time=0.0,
            xmat=np.tile(np.eye(3).ravel(), (5, 1)),
            xpos=np.zeros((5, 3)),
            xipos=np.arange(15.0).reshape(5, 3),
            site_xpos=np.array([[1.0, 0, 0], [2.0, 0, 0]]),
            qpos=np.zeros(3),
            xquat=np.tile([1.0, 0, 0, 0], (5, 1)),
            qfrc_actuator=np.array([0.0, -0.35, 0.0, 0.07]),
        )

    def read(self, *touching, phase="close"):
        self.touches = list(touching)
        return self.recorder.read(self.data, phase)


@pytest.fixture
def scene(monkeypatch) -> Scene:
    return Scene(monkeypatch)


def touch(geom: int, force=(1.0, 0.0, 0.0), point=(0.0, 0.0, 0.0), normal=(-1.0, 0.0, 0.0)) -> Touch:
    return Touch(geom, np.array(point), np.array(normal), np.array(force))


def test_forces_of_a_pad_are_summed_and_those_of_other_links_are_named_without_the_table(scene):
    palm = [touch(LINK, force=(0.0, 0.0, -3.0), normal=(0.0, 0.6, 0.8)), touch(LINK, force=(1.0, 7.0, 0.0))]
    reading = scene.read(touch(3), touch(5, force=(0.0, 2.0, 0.5)), touch(TABLE, force=(0.0, 0.0, 9.0)), *palm)
    np.testing.assert_allclose(reading.forces, [[0, 0, 0], [1.0, 2.0, 0.5]])
    assert reading.links == pytest.approx({"palm": 0.8 * 3 + 1.0})
    np.testing.assert_array_equal(reading.touching, [False, True])


def test_tips_centre_and_motion_are_those_of_their_sites_and_bodies(scene):
    scene.data.xmat[OBJECT], scene.data.xpos[OBJECT] = turn(0.0, 0.3, 0.0).ravel(), [0.1, 0.2, 0.4]
    scene.data.time = 0.7
    reading = scene.read(phase="hold")
    np.testing.assert_array_equal(reading.tips, [[2.0, 0, 0], [1.0, 0, 0]])
    np.testing.assert_array_equal(reading.centre, [3.0, 4.0, 5.0])
    np.testing.assert_allclose(reading.rotation, turn(0.0, 0.3, 0.0))
    np.testing.assert_array_equal(reading.translation, [0.1, 0.2, 0.4])
    assert (reading.time, reading.phase) == (0.7, "hold")


def test_torques_are_told_as_shares_of_the_effort_of_each_joint_whichever_way_they_turn(scene):
    np.testing.assert_allclose(scene.read().torques, [0.1, 1.0])


def test_the_lowest_point_is_that_of_the_hull_where_the_object_is(scene):
    scene.data.xmat[OBJECT], scene.data.xpos[OBJECT] = turn(0.0, 0.3, 0.0).ravel(), [0.1, 0.2, 0.4]
    corners = HULL @ turn(0.0, 0.3, 0.0).T + [0.1, 0.2, 0.4]
    assert scene.read().lowest == pytest.approx(corners[:, 2].min())
    assert corners[:, 2].min() < 0.4


def test_a_pad_slides_from_its_firmest_contact_of_the_reading_before_along_the_surface(scene):
    scene.data.xmat[PADS[0]] = turn(0.0, 0.0, 0.0).ravel()
    firm, weak = touch(2, force=(5.0, 0.0, 0.0), point=(0.0, 0.0, 0.1)), touch(2, point=(0.0, 0.3, 0.0))
    assert not scene.read(weak, firm, weak).slide.any()
    scene.data.xmat[PADS[0]] = turn(0.2, 0.0, 0.0).ravel()  # the weak one would part by three times as much
    scene.data.xpos[PADS[0]] = [0.05, 0.0, 0.0]  # along the normal it may part
    reading = scene.read()
    assert reading.slide[0] == pytest.approx(2 * np.sin(0.1) * 0.1)
    assert reading.slide[1] == 0.0
    assert not reading.touching.any()


def test_what_does_not_touch_any_more_does_not_slide(scene):
    scene.read(touch(2))
    scene.read()
    scene.data.xpos[PADS[0]] = [0.0, 0.1, 0.0]
    assert not scene.read(touch(2)).slide.any()


def test_after_the_state_was_set_back_nothing_has_slid(scene):
    scene.read(touch(2))
    scene.recorder.forget()
    scene.data.xpos[PADS[0]] = [0.0, 0.1, 0.0]
    assert not scene.read(touch(2)).slide.any()


def test_the_trace_keeps_every_fourth_reading(scene):
    scene.data.xquat[OBJECT] = [0.1, 0.2, 0.3, 0.4]
    scene.data.xpos[OBJECT] = [5.0, 6.0, 7.0]
    for i in range(9):
        scene.data.time = float(i)
        scene.read(phase="lift" if i > 4 else "close")
    trace = scene.recorder.trace()
    np.testing.assert_array_equal(trace.time, [0.0, 4.0, 8.0])
    assert TRACE_EVERY == 4
    assert list(trace.phase) == ["close", "close", "lift"]


@pytest.mark.parametrize("part", ["centre", "tips"])
def test_a_reading_with_a_number_that_is_none_has_diverged(scene, part):
    assert scene.read().finite
    (scene.data.xipos if part == "centre" else scene.data.site_xpos)[OBJECT, 1] = np.nan
    assert not scene.read().finite
