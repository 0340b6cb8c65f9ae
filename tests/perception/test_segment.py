"""A whole scene becomes a table and clusters: each is one body, numbered, with all else near it as obstacles."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from archives import unpacked
from scipy.spatial.transform import Rotation
from tabletops import CAMERA, SMALL, TABLE, Tabletop, random_bodies, seen, shares, slab

import sgnlp
from sgnlp import InputError, segment
from sgnlp.perception.scene import NO_CLUSTER
from sgnlp.perception.synthetic.cameras import DepthCamera
from sgnlp.perception.synthetic.meshes import Mesh, box

BODIES = 4


@lru_cache
def four(camera: DepthCamera = SMALL) -> Tabletop:
    """Four bodies on a table without end."""
    rng = np.random.default_rng(0)
    return seen(random_bodies(BODIES, rng), rng, camera=camera)


def named(scene: sgnlp.Scene, labels: np.ndarray, measured: np.ndarray | None = None) -> list[int]:
    """The body of each cluster that may be an object; each must be one body's alone, and nearly all of it."""
    found = []
    for cluster in scene.choices:
        mask = scene.pixels(cluster.number)[0]
        body = int(np.bincount(labels[mask]).argmax())
        right, whole = shares(mask, (labels == body) & (scene.views[0].measured if measured is None else measured))
        assert right > 0.99
        assert whole > 0.9
        found.append(body)
    return found


def is_all(scene: sgnlp.Scene, top: Tabletop) -> bool:
    return sorted(named(scene, top.labels)) == list(range(1, len(top.bodies) + 1))


def turned(scene: sgnlp.Scene, top: Tabletop) -> np.ndarray:
    """The scene's up in the true world."""
    return top.pose[:3, :3] @ scene.transform[:3, :3].T @ scene.table.normal


def test_four_bodies_before_a_camera_with_a_pose():
    top = four()
    scene = segment(top.image())
    assert is_all(scene, top)
    assert np.array_equal(scene.transform, np.eye(4))
    assert scene.table.tilt_deg < 0.1
    for cluster in scene.clusters:
        body = top.bodies[named(scene, top.labels)[cluster.number - 1] - 1]
        low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
        assert (cluster.points > low - 0.01).all()
        assert (cluster.points < high + 0.01).all()
    numbers = [len(cluster.points) for cluster in scene.clusters]
    assert numbers == sorted(numbers, reverse=True)


def test_without_a_pose_the_table_becomes_level_below_the_camera_with_x_ahead():
    top = four()
    scene = segment(top.image(posed=False))
    assert is_all(scene, top)
    np.testing.assert_allclose(turned(scene, top), [0, 0, 1], atol=1e-3)
    np.testing.assert_allclose(scene.views[0].camera, [0, 0, 0.5], atol=2e-3)
    assert scene.table.offset == pytest.approx(0.0, abs=1e-9)
    ahead = scene.transform[:3, 2]
    assert ahead[0] > 0.5
    assert ahead[1] == pytest.approx(0.0, abs=1e-9)
    assert any(note.startswith("No pose is given: turned the world") for note in scene.notes)
    np.testing.assert_allclose(scene.views[0].image.pose, scene.transform, atol=1e-12)


@pytest.mark.parametrize("posed", [False, True])
def test_depths_along_the_rays_are_told_with_a_pose_and_without(posed):
    image = four().image(posed=posed)
    along = np.linalg.norm(SMALL.rays(), axis=-1)
    bent, plain = segment(replace(image, depth=image.depth * along)), segment(image)
    told = [any("the depths were measured along the rays" in note for note in scene.notes) for scene in (bent, plain)]
    assert told == [True, False]


def test_an_organised_cloud_in_the_camera_s_frame_is_recognised():
    top = four()
    scene = segment(top.own)
    assert is_all(scene, top)
    np.testing.assert_allclose(turned(scene, top), [0, 0, 1], atol=1e-3)
    np.testing.assert_allclose(scene.views[0].camera, [0, 0, 0.5], atol=2e-3)
    assert scene.at_pixel(*place_of(scene, 1)).number == 1


def place_of(scene: sgnlp.Scene, number: int) -> tuple[int, int]:
    """A pixel, column and row, in the middle of a cluster's pixels."""
    v, u = np.argwhere(scene.pixels(number)[0])[scene.pixels(number)[0].sum() // 2]
    return int(u), int(v)


def test_plain_clouds_in_a_world_and_in_a_camera_s_frame():
    top = four(CAMERA)
    measured = np.isfinite(top.own[..., 2])
    labels = top.labels[measured][:, None]
    own = segment(top.own[measured])
    assert sorted(named(own, labels)) == [1, 2, 3, 4]
    assert own.views[0].camera is not None
    R, t = top.pose[:3, :3], top.pose[:3, 3]
    world = segment(top.own[measured] @ R.T + t)
    assert sorted(named(world, labels)) == [1, 2, 3, 4]
    assert world.views[0].camera is None
    assert np.array_equal(world.transform, np.eye(4))
    posed = segment(top.own[measured], pose=top.pose)
    np.testing.assert_allclose(posed.views[0].camera, t)
    np.testing.assert_array_equal(posed.labels[0], world.labels[0])


def test_a_wall_behind_the_table_and_one_larger_than_it_is_not_the_table():
    rng = np.random.default_rng(1)
    wall = slab((0.02, 3.0, 2.0), (0.4, 0.0, 0.8))
    top = seen(random_bodies(BODIES, rng), rng, [wall], eye=(-0.5, 0.0, 0.22), target=(0.0, 0.0, 0.12), camera=SMALL)
    on_wall = (top.own @ top.pose[:3, :3].T + top.pose[:3, 3])[..., 0] > 0.38
    assert on_wall.sum() > 1.2 * (~on_wall & (top.labels == TABLE)).sum()
    for given in (top.image(), top.image(posed=False)):
        scene = segment(given)
        np.testing.assert_allclose(
            turned(scene, top) if given.pose is None else scene.table.normal, [0, 0, 1], atol=5e-3
        )
        assert not [n for n in named_bodies(scene, top) if n == TABLE]
        assert (scene.labels[0][on_wall] == NO_CLUSTER).all()
        assert scene.above[0][on_wall & scene.views[0].measured].mean() > 0.95


def named_bodies(scene: sgnlp.Scene, top: Tabletop) -> list[int]:
    return [int(np.bincount(top.labels[scene.pixels(c.number)[0]]).argmax()) for c in scene.choices]


def test_of_a_floor_and_a_table_on_it_the_table_is_meant():
    rng, height = np.random.default_rng(2), 0.7
    table = slab((0.6, 0.6, 0.03), (0.0, 0.0, height - 0.015))
    legs = [slab((0.04, 0.04, 0.67), (x, y, 0.335)) for x in (-0.27, 0.27) for y in (-0.27, 0.27)]
    crates = [slab((0.2, 0.2, 0.2), (x, y, 0.1)) for x in (0.5, 0.9, 1.3) for y in (-0.6, 0.6)]
    bodies = [Mesh(body.vertices + np.array([0, 0, height]), body.faces) for body in random_bodies(2, rng)]
    top = seen(bodies, rng, [table, *legs, *crates], eye=(-0.85, -0.2, 0.7), height=height, camera=SMALL)
    z = (top.own @ top.pose[:3, :3].T + top.pose[:3, 3])[..., 2]
    assert (z < 0.1).sum() > (np.abs(z - height) < 0.02).sum()  # more of the floor is seen than of the table
    for given in (top.image(), top.image(posed=False)):
        scene = segment(given)
        assert sorted(named_bodies(scene, top)) == [1, 2]
        assert scene.table.heights(scene.views[0].camera) == pytest.approx(0.7, abs=0.005)


@pytest.mark.parametrize("seed", [0, 3, 6])
def test_two_bodies_12_mm_apart_are_two(seed):
    rng = np.random.default_rng(seed)
    turn = Rotation.from_euler("z", rng.uniform(0, 360), degrees=True)
    offset = turn.apply([0.036, 0, 0])[:2]
    pair = [box([0.06, 0.08, high]).turned(turn.as_quat()) for high in (0.1, 0.07)]
    top = seen([pair[0].standing(-offset), pair[1].standing(offset)], rng)
    assert sorted(named(segment(top.image()), top.labels)) == [1, 2]


def test_a_body_2_cm_high_is_found():
    rng = np.random.default_rng(0)
    top = seen([box([0.1, 0.06, 0.02]).standing()], rng, camera=SMALL)
    (body,) = named(segment(top.image()), top.labels)
    assert body == 1


def test_what_is_no_measurement_is_dropped_and_counted():
    top = four()
    depth = top.depth.copy()
    depth[:20], depth[20:40, :50] = 0.0, np.nan
    edge = np.abs(np.diff(top.labels, axis=1, prepend=0)) > 0
    flown = edge & np.isfinite(depth)
    behind = np.where(flown, depth + 0.05, depth)  # a curtain of single pixels behind every edge
    scene = segment(replace(top.image(), depth=behind))
    lost = int((~np.isfinite(behind) | (behind == 0)).sum())
    assert f"Dropped {lost} of {depth.size} pixels that have no depth." in scene.notes
    assert any(note.endswith("fly between two surfaces.") for note in scene.notes)
    kept = scene.views[0].measured[flown & (top.depth > 0)].mean()
    assert kept < 0.2
    assert sorted(named_bodies(scene, top)) == [1, 2, 3, 4]
    marks = top.own.copy()
    marks[::7, ::7] = 0.0
    assert any("are (0, 0, 0), which stands for no return" in note for note in segment(marks).notes)


def test_two_images_of_one_world_are_two_views():
    rng = np.random.default_rng(3)
    bodies = random_bodies(2, rng)
    tops = [seen(bodies, rng, eye=eye, camera=SMALL) for eye in ((-0.5, -0.1, 0.45), (0.4, 0.35, 0.45))]
    scene = segment([top.image() for top in tops])
    assert len(scene.choices) == 2
    for cluster in scene.choices:
        masks = scene.pixels(cluster.number)
        assert len({int(np.bincount(t.labels[m]).argmax()) for t, m in zip(tops, masks, strict=True)}) == 1
    observation = scene.observation(1)
    assert observation.view_names == ("0", "1")
    np.testing.assert_allclose(observation.camera_positions, [top.pose[:3, 3] for top in tops])


def test_what_is_cut_off_or_hangs_or_reaches_in_is_listed_and_marked():
    rng = np.random.default_rng(4)
    whole = box([0.06, 0.06, 0.08]).standing((0.05, 0.12))
    cut = box([0.08, 0.08, 0.1]).standing((-0.28, 0.05))
    hanging = slab((0.05, 0.05, 0.05), (0.0, -0.14, 0.14))
    top = seen([whole, cut, hanging], rng, camera=SMALL)
    scene = segment(top.image())
    faults = {int(np.bincount(top.labels[scene.pixels(c.number)[0]]).argmax()): c.fault for c in scene.clusters}
    assert faults[1] == ""
    assert faults[2] == "is cut off by the image's edge"
    assert faults[3] == "hangs 12 cm above the table"
    assert [cluster.number for cluster in scene.choices] == [1]
    assert "hangs" in scene.arrays(next(c.number for c in scene.clusters if "hangs" in c.fault))["notes"][-1]


def test_an_observation_has_the_table_the_camera_and_all_else_near_it_as_obstacles():
    top = four()
    scene = segment(top.image())
    cluster = scene.cluster(2)
    observation = scene.observation(2, name="egg")
    assert observation.name == "egg"
    assert observation.table_height == pytest.approx(0.0, abs=1e-3)
    np.testing.assert_allclose(observation.camera_positions, top.pose[None, :3, 3])
    others = set(np.unique(observation.obstacle)) - {NO_CLUSTER}
    assert others == {1, 3, 4}
    for number in others:
        own = observation.obstacle_points[observation.obstacle == number]
        assert len(own) <= 2000
        away = np.linalg.norm(own[:, None] - scene.cluster(number).points[None], axis=2).min(axis=1)
        assert away.max() < 0.005
    low, high = cluster.points.min(axis=0) - 0.3, cluster.points.max(axis=0) + 0.3
    assert ((observation.obstacle_points > low) & (observation.obstacle_points < high)).all()
    assert observation.obstacle_points[:, 2].min() > 0.003  # no table
    assert (observation.background_view == 0).all()
    assert np.abs(observation.background[:, 2]).min() < 1e-3  # but here
    apart = np.linalg.norm(observation.background[::50, None] - cluster.points[None], axis=2).min(axis=1)
    assert apart.min() > 1e-6  # nothing of the object itself
    assert scene.nearest(cluster.centre).number == 2
    for place in ([5.0, 5.0, 5.0], [np.nan, 0.0, 0.0]):
        with pytest.raises(InputError, match=r"the nearest cluster is .* m from the place; at most 0.2 m are near"):
            scene.nearest(place)
    with pytest.raises(InputError, match="no cluster is chosen; give numbers from 1 to"):
        scene.observation()
    with pytest.raises(InputError, match=r"the number of a cluster must be 1 to .*; found '2'"):
        scene.observation("2")


def test_the_same_scene_gives_the_same_bits():
    top = four()
    one, two = segment(top.image()), segment(top.image())
    assert all(np.array_equal(a, b) for a, b in zip(one.labels, two.labels, strict=True))
    assert one.observation(1).digest == two.observation(1).digest


def test_real_clouds_are_one_object_each_on_a_table_known_or_assumed(real_clouds):
    for file in real_clouds:
        data = unpacked(file)
        views = [data[key].astype(float) for key in sorted(data) if key.startswith("points_")]
        for table in (0.0, None):
            for given in (views, views[0]):
                scene = segment(given, table_height=table)
                share = len(scene.cluster(1).points) / sum(
                    len(v) for v in (given if isinstance(given, list) else [given])
                )
                assert share > 0.85, (file.name, table)
                assert len(scene.choices) == 1 or share > 0.95
                assert not scene.cluster(1).fault


def wall_alone() -> tuple[np.ndarray, np.ndarray]:
    """Points of a wall that a level camera sees, in the world and in the camera's frame."""
    rng = np.random.default_rng(0)
    y, z = rng.uniform(-1, 1, (2, 5000))
    wall = np.column_stack([np.full(5000, 1.5), y, z + 1.0]) + rng.normal(0, 1e-3, (5000, 3))
    return wall, np.column_stack([-y, -z, np.full(5000, 1.5)]) + rng.normal(0, 1e-3, (5000, 3))


def test_a_scene_without_a_table_or_anything_on_it_is_refused():
    top, rng = four(), np.random.default_rng(0)
    empty = seen(
        [Mesh(box([0.01, 0.01, 0.01]).vertices - [0, 0, 1.0], box([0.01, 0.01, 0.01]).faces)], rng, camera=SMALL
    )
    with pytest.raises(InputError, match="nothing stands on the table that was found, a plane of"):
        segment(empty.image())
    with pytest.raises(InputError, match="nothing was measured"):
        segment(replace(top.image(), depth=np.full(top.depth.shape, np.nan)))
    with pytest.raises(InputError, match="99 points were measured, at least 100 are needed"):
        segment(rng.normal(size=(99, 3)))
    with pytest.raises(InputError, match="no table was found"):
        segment(rng.uniform(-0.5, 0.5, (5000, 3)))
    world, own = wall_alone()
    with pytest.raises(InputError, match="nothing stands on the table that was found"):
        segment(own)
    with pytest.raises(InputError, match=r"the table is tilted by 90.* deg, but it is level"):
        segment(world, pose=np.eye(4))


def test_two_images_with_one_pose_are_refused():
    top = four()
    other = replace(top.image(), depth=top.depth + 0.1)
    with pytest.raises(InputError, match="have one pose, but 100% of their pixels differ"):
        segment([top.image(), other])


def test_a_table_given_below_the_one_that_things_stand_on_is_told():
    top = four()
    for given, told in ((-0.3, True), (-0.05, True), (0.0, False), (0.04, False)):
        notes = segment(top.image(), table_height=given).notes
        assert any(f"taken to be at {given:.3f} m, but most things stand" in note for note in notes) == told


def test_a_wrong_unit_or_pose_is_told():
    top = four()
    with pytest.raises(InputError, match=r"the scene is 732 m from the camera, .* --unit 0.001 would make it 0.73 m"):
        segment(replace(top.image(), depth=1000 * top.depth))
    with pytest.raises(InputError, match=r"the scene is \d\d\d m wide, not 0.03 to 20 m; see --unit; --unit 0.001"):
        segment(1000 * top.own[np.isfinite(top.own[..., 2])])
    for wrong, cause in ((top.pose @ np.diag([1, -1, -1, 1]), "OpenGL"), (np.linalg.inv(top.pose), "an inverse")):
        with pytest.raises(InputError, match=f"of the points of the table lie on a plane that .*{cause}"):
            segment(replace(top.image(), pose=wrong))
    with pytest.raises(InputError, match="the table's height is the world's"):
        segment(top.image(posed=False), table_height=0.0)
    with pytest.raises(InputError, match="has a pose already"):
        segment(top.image(), pose=np.eye(4))
    with pytest.raises(InputError, match="each of several depth images needs a pose"):
        segment([top.image(posed=False), top.image(posed=False)])
    with pytest.raises(InputError, match="not both"):
        segment([top.image(), top.own])


def test_pixels_and_numbers_that_are_none_are_refused():
    scene = segment(four().image())
    with pytest.raises(InputError, match="must be 1 to 4; found 9"):
        scene.observation(9)
    with pytest.raises(InputError, match=r"the pixel \(320, 0\) is outside of the 320 x 240 pixels"):
        scene.at_pixel(320, 0)
    v, u = np.argwhere(scene.views[0].measured & ~scene.above[0])[0]
    with pytest.raises(InputError, match="is the table"):
        scene.at_pixel(int(u), int(v))
    v, u = np.argwhere(~scene.views[0].measured)[0]
    with pytest.raises(InputError, match="is nothing that was measured"):
        scene.at_pixel(int(u), int(v))


def test_a_depth_image_without_mask_or_pose_is_no_cloud_of_an_object():
    top = four()
    with pytest.raises(InputError, match="the image '0' has no mask"):
        sgnlp.from_depth(top.image())
    with pytest.raises(InputError, match="the image '0' has no pose"):
        sgnlp.from_depth(replace(top.image(posed=False), mask=top.labels > 0))
