"""Arms: what their files say, what is refused, and how their spheres fit their meshes."""

import pickle
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from arms import RAIL_MJCF, changed_arm, rail
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from sgnlp.base.errors import InputError
from sgnlp.hand.arm import Arm, available_arms, load_arm, with_base
from sgnlp.hand.arm_kinematics import arm_spheres, wrist_pose
from sgnlp.hand.geometry import surface_points
from sgnlp.hand.hand import available_hands, load_hand, on_arm
from sgnlp.hand.meshes import link_meshes, link_poses, mesh_links

MM = 1e-3
BULGES = {
    "panda": (55, {"arm_link0_1": 90, "arm_link0_2": 90}),
    "ur5": (50, {"arm_base": 85}),
    "ur10": (55, {"arm_base": 90, "arm_upper_arm_7": 90}),
}
"""How far a sphere may bulge [mm], and those that bulge further; the arms' files say the same."""
PALM_BACK = 0.095
"""How far [m] the mesh of the Allegro's palm reaches behind its root link."""


@pytest.fixture(scope="module", params=available_arms())
def arm(request: pytest.FixtureRequest) -> Arm:
    return load_arm(request.param)


def skin(arm: Arm, q: np.ndarray, count: int) -> np.ndarray:
    """Points of all meshes (P, 3) [m] in the world."""
    meshes = zip(link_meshes(arm)[0], link_poses(arm, arm.base, q), strict=True)
    return np.vstack([surface_points(mesh, count) @ T[:3, :3].T + T[:3, 3] for mesh, T in meshes])


def test_arms_and_hands_are_listed_apart():
    assert available_arms() == ("panda", "ur10", "ur5")
    assert not set(available_arms()) & set(available_hands())


def test_an_arm_ends_at_its_flange_and_has_the_limits_of_its_urdf():
    panda = load_arm("panda")
    assert panda.joint_names == tuple(f"panda_joint{i}" for i in range(1, 8))
    np.testing.assert_array_equal(panda.effort, [87, 87, 87, 87, 12, 12, 12])
    np.testing.assert_array_equal(panda.velocity, [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
    assert not panda.model.existFrame("panda_hand")
    assert panda.model.inertias[7].mass == pytest.approx(0.735522)  # that of link 7 alone
    assert load_arm("ur5").upper[2] == pytest.approx(np.pi)


def test_the_file_may_say_velocity_and_effort_itself(tmp_path: Path):
    said = "velocity: {a_rail: 1, b_turn: 2.5, c_bend: 3}\neffort: {a_rail: 9, b_turn: 8, c_bend: 7}\nbase:"
    arm = load_arm(rail(tmp_path, ("base:", said)))
    np.testing.assert_array_equal(arm.velocity, [1, 2.5, 3])
    np.testing.assert_array_equal(arm.effort, [9, 8, 7])


def test_an_arm_may_be_an_mjcf(tmp_path: Path):
    """The rail written for MuJoCo: the same places of the wrist and spheres, with the velocities of the file."""
    pytest.importorskip("mujoco")
    folder = rail(tmp_path)
    urdf = load_arm(folder)
    (folder / "arm.xml").write_text(RAIL_MJCF, encoding="utf-8")
    said = "velocity: {a_rail: 2, b_turn: 2, c_bend: 2}\nurdf: arm.xml"
    text = (folder / "arm.yaml").read_text(encoding="utf-8").replace("urdf: arm.urdf", said)
    (folder / "arm.yaml").write_text(text, encoding="utf-8")
    arm, q = load_arm(folder), np.array([0.2, -0.5, 1.0])
    assert arm.joint_names == urdf.joint_names
    np.testing.assert_allclose(arm.effort, urdf.effort)
    np.testing.assert_allclose(arm.lower, urdf.lower)
    np.testing.assert_allclose(wrist_pose(arm, q), wrist_pose(urdf, q), atol=1e-9)
    np.testing.assert_allclose(arm_spheres(arm, q), arm_spheres(urdf, q), atol=1e-9)


def test_what_is_fixed_to_the_arm_stays_and_what_else_moves_or_hangs_on_the_flange_goes(tmp_path: Path):
    arm = load_arm(rail(tmp_path))
    links = {frame.name for frame in arm.model.frames if frame.type == pin.FrameType.BODY}
    assert links == {"post", "cart", "upper", "lower", "plate", "camera"}
    assert arm.joint_names == ("a_rail", "b_turn", "c_bend")


def test_the_spheres_cover_every_mesh_at_any_posture(arm: Arm):
    rng, radii = np.random.default_rng(0), np.array([sphere.radius for sphere in arm.spheres])
    assert len(arm.spheres) <= 18
    for q in (arm.home, rng.uniform(arm.lower, arm.upper)):
        centres = arm_spheres(arm, q)
        outside = [(cdist(part, centres) - radii).min(axis=1).max() for part in np.array_split(skin(arm, q, 1500), 20)]
        assert max(outside) < 2.0 * MM
    assert {sphere.link for sphere in arm.spheres} == set(mesh_links(arm)) - {"ee_link"}  # its box lies in the flange


def test_no_sphere_bulges_further_than_the_arms_file_says(arm: Arm):
    directions = np.random.default_rng(1).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    tree = cKDTree(skin(arm, arm.home, 2000))
    most, others = BULGES[arm.name]
    for sphere, centre in zip(arm.spheres, arm_spheres(arm, arm.home), strict=True):
        bulge = tree.query(centre + sphere.radius * directions)[0].max()
        assert bulge < others.get(sphere.name, most) * MM, sphere.name


def test_a_sphere_counts_for_the_table_if_two_joints_move_it(arm: Arm):
    low = arm_spheres(arm, arm.home)[:, 2] - [sphere.radius for sphere in arm.spheres]
    assert low[list(arm.free_spheres)].min() > 0.02
    fixed = set(range(len(arm.spheres))) - set(arm.free_spheres)
    turned = arm.home + np.eye(len(arm.home))[0]
    heights = arm_spheres(arm, arm.home)[:, 2] - arm_spheres(arm, turned)[:, 2]
    assert fixed
    assert np.abs(heights[list(fixed)]).max() < 1e-12


def test_the_palm_begins_at_the_flange_and_its_fingers_continue_the_flanges_axis(arm: Arm):
    allegro, dlr = on_arm(load_hand("allegro_right"), arm), on_arm(load_hand("dlr_hit_right"), arm)
    np.testing.assert_array_equal(allegro.arm.mount[:3], [0, 0, PALM_BACK])
    np.testing.assert_array_equal(dlr.arm.mount[:3], [0, 0, 0])
    for hand in (allegro, dlr):
        meshes = zip(link_meshes(hand)[0], mesh_links(hand), strict=True)
        poses = link_poses(hand, np.array([0, 0, 0, 0, 0, 0, 1.0]), hand.reference)
        back = min(
            (mesh.vertices @ T[:3, :3].T + T[:3, 3])[:, 2].min() for (mesh, _), T in zip(meshes, poses, strict=True)
        )
        np.testing.assert_allclose(pin.XYZQUATToSE3(hand.arm.mount).rotation[:, 2], [0, 0, 1], atol=1e-12)
        assert hand.arm.mount[2] + back == pytest.approx(0, abs=1e-6)


def test_on_an_arm_a_hand_has_another_digest_for_each_arm_and_hand_but_none_for_a_base():
    hand, panda = load_hand("allegro_right"), load_arm("panda")
    moved = with_base(panda, [0.1, 0, 0, 0, 0, 0, 1])
    hands = [hand, on_arm(hand, panda), on_arm(hand, load_arm("ur5")), on_arm(hand, moved)]
    assert len({one.digest for one in [*hands, on_arm(load_hand("allegro_left"), panda)]}) == 4
    assert hands[3].digest == hands[1].digest
    assert pickle.loads(pickle.dumps(hands[1])).arm.digest == hands[1].arm.digest
    with pytest.raises(InputError, match=r"'allegro_right' is on the arm 'panda' already"):
        on_arm(hands[1], panda)


@pytest.mark.parametrize(
    ("base", "pose"),
    [
        ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3, 0, 0, 0, 1]),
        ([0.1, 0.2, 0.3, 0, 0, 90], [0.1, 0.2, 0.3, 0, 0, np.sqrt(0.5), np.sqrt(0.5)]),
        ([0.1, 0.2, 0.3, 0, 1, 0, 0], [0.1, 0.2, 0.3, 0, 1, 0, 0]),
    ],
)
def test_a_hand_is_loaded_on_an_arm_that_stands_where_it_is_told(base, pose):
    np.testing.assert_allclose(load_hand("allegro_left", arm="panda", arm_base=base).arm.base, pose, atol=1e-12)
    assert load_hand("allegro_left", arm="panda", arm_base=base) is load_hand("allegro_left", "cover", "panda", base)


def test_a_base_without_an_arm_and_one_of_no_known_length_are_refused():
    with pytest.raises(InputError, match="the base of an arm is given, but no arm"):
        load_hand("allegro_left", arm_base=[0, 0, 0])
    with pytest.raises(InputError, match="given by 3, 6 or 7 numbers"):
        load_hand("allegro_left", arm="panda", arm_base=[0, 0])


def test_an_arm_whose_names_are_the_hands_is_refused(tmp_path: Path):
    arm = load_arm(rail(tmp_path, ("  post: {", "  palm_upper: {"), ("[[post,", "[[palm_upper,")))
    with pytest.raises(InputError, match=r"both have a sphere 'palm_upper'"):
        on_arm(load_hand("allegro_left"), arm)


def test_the_base_moves_the_whole_arm(arm: Arm):
    turned = with_base(arm, [0.1, 0.2, 0.3, 0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    motion = pin.XYZQUATToSE3(turned.base) * pin.XYZQUATToSE3(arm.base).inverse()
    expected = arm_spheres(arm, arm.home) @ motion.rotation.T + motion.translation
    np.testing.assert_allclose(arm_spheres(turned, arm.home), expected, atol=1e-12)
    expected = motion * pin.XYZQUATToSE3(wrist_pose(arm, arm.home))
    np.testing.assert_allclose(pin.XYZQUATToSE3(wrist_pose(turned, arm.home)).homogeneous, expected, atol=1e-12)


@pytest.mark.parametrize("pose", [np.zeros(7), [0, 0, 0, 1], [0, 0, np.nan, 0, 0, 0, 1], "here"])
def test_a_base_that_is_no_pose_is_refused(pose):
    with pytest.raises(InputError, match="the base of an arm"):
        with_base(load_arm("ur5"), pose)


def test_a_base_whose_quaternion_has_four_digits_becomes_a_turn():
    half = [0.7071, 0, 0, 0.7071]
    base = with_base(load_arm("ur5"), [1, 2, 3, *half]).base
    np.testing.assert_allclose(base, [1, 2, 3, np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-12)
    assert with_base(load_arm("ur5"), base).base.tobytes() == base.tobytes()
    with pytest.raises(InputError, match=r"the base of an arm must be x y z \[m\] and a unit quaternion"):
        with_base(load_arm("ur5"), [1, 2, 3, 0.71, 0, 0, 0.71])


def refusal(folder: Path) -> str:
    with pytest.raises(InputError) as error:
        load_arm(folder)
    message = str(error.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("flange: panda_link8", "flange: panda_link9", "unknown flange 'panda_link9'"),
        ("flange: panda_link8", "flange: panda_link0", "no joint moves the flange 'panda_link0'"),
        ("root: panda_link0", "root: panda_link", "panda.urdf: unknown root 'panda_link'; nearest of the"),
        ("panda_joint4: -2.356194", "panda_joint4: 0", "home angle 0 of 'panda_joint4' is outside [-3.0718, -0.0698]"),
        ("panda_joint7: 0.785398", "panda_joint8: 0", "unknown key in home 'panda_joint8'"),
        ("  panda_joint1: 0\n", "", "home: the key 'panda_joint1' is missing"),
        ("link: panda_link7,", "link: panda_hand,", "unknown link of sphere 'arm_link7_1' 'panda_hand'"),
        ("[arm_link0_2, arm_link5_3]", "[arm_link0_2, arm_link1_1]", "'arm_link0_2' and 'arm_link1_1' overlap by"),
        ("[arm_link0_2, arm_link5_3]", "[arm_link0_2, nobody]", "unknown sphere in a pair 'nobody'"),
        ("  default:", "  all:", "mount: the key 'default' is missing"),
        ("base: {position: [-0.55, 0, 0]", "base: {position: [-0.55, 0]", "position of base must be 3 finite numbers"),
        (
            "default: {position: [0, 0, 0.095]",
            "default: {position: [0, 0, 95]",
            "position of mount of 'default' must be at most 1 m from 0, not 95; is it in metres?",
        ),
        ("radius: 0.0", "radius: 80.0", "must be at most 0.5 m, not 80"),
        (
            "pairs:",
            "velocity: {" + ", ".join(f"panda_joint{i}: 150" for i in range(1, 8)) + "}\npairs:",
            "velocity of joint 'panda_joint1' must be at most 40 rad/s, not 150; is it in rad/s? Degrees are π/180 rad",
        ),
        (
            "pairs:",
            "effort: {" + ", ".join(f"panda_joint{i}: 12000" for i in range(1, 8)) + "}\npairs:",
            "effort of joint 'panda_joint1' must be at most 5000 N m, not 12000; is it in N m?",
        ),
        ("base: {position", "base: {place", "unknown key in base 'place'"),
        ("name: panda", "title: panda", "unknown key in the file 'title'"),
        ("urdf/panda.urdf", "urdf/panda2.urdf", "is not there; is its package installed?"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path: Path, old: str, new: str, message: str):
    found = refusal(changed_arm(tmp_path, "panda", (old, new)))
    assert found.startswith("my_arm/arm.yaml: ")
    assert message in found


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'effort="20"',
            'effort="0"',
            "key 'effort' is missing; effort in the description of joint 'a_rail' must be positive, not 0",
        ),
        (
            'velocity="2"',
            "",
            "key 'velocity' is missing; velocity in the description of joint 'a_rail' must be positive, not 0",
        ),
        (
            '<axis xyz="0 1 0"/>',
            '<axis xyz="0 1 0"/><mimic joint="b_turn"/>',
            "joint 'c_bend' of the arm mimics another",
        ),
        ('<robot name="rail">', '<mujoco model="rail">', "arm.urdf is no URDF"),
        (
            "mount: {position: [0.01, 0.02, 0.05]",
            "mount: {position: [0.01, 0]",
            "position of mount must be 3 finite numbers",
        ),
    ],
)
def test_a_wrong_urdf_is_refused_in_one_line(tmp_path: Path, old: str, new: str, message: str):
    assert message in refusal(rail(tmp_path, (old, new)))


def test_an_mjcf_is_refused_for_want_of_velocities(tmp_path: Path):
    folder = rail(tmp_path)
    slide = '<joint name="a_rail" type="slide" range="0 1" actuatorfrcrange="-9 9"/><inertial pos="0 0 0" mass="1"'
    plate = f'<body name="plate">{slide} diaginertia="1 1 1"/></body>'
    text = f'<mujoco><worldbody><body name="post"><body name="lower">{plate}</body></body></worldbody></mujoco>'
    (folder / "arm.urdf").write_text(text, encoding="utf-8")
    assert (
        "key 'velocity' is missing; velocity in the description of joint 'a_rail' must be positive, not 0"
        in refusal(folder)
    )


def test_an_unknown_arm_is_refused_with_those_that_are_known():
    with pytest.raises(InputError, match=r"unknown arm 'allegro_left'; valid: .*arm.yaml, panda, ur10, ur5"):
        load_arm("allegro_left")
