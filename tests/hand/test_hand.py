"""The hand descriptions: their geometry against the meshes, their poses, and what is refused."""

import pickle
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from descriptions import mjcf
from hands import BENT, MULTIPLIER, OFFSET, THREE, changed, coupled

from sgnlp.base.errors import InputError, NotInstalledError
from sgnlp.base.yaml_nodes import unknown_name
from sgnlp.hand import listing as listing_module
from sgnlp.hand.description.xml_file import content
from sgnlp.hand.hand import Hand, available_hands, load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.hand.listing import Listing, listed_hands

ORIGIN = np.array([0, 0, 0, 0, 0, 0, 1.0])
MIRROR = np.diag([1.0, -1.0, 1.0])
MM = 1e-3


@pytest.fixture(scope="module", params=["allegro_left", "allegro_right"])
def hand(request: pytest.FixtureRequest) -> Hand:
    return load_hand(request.param)


def read_stl(file: Path) -> np.ndarray:
    """The triangles (T, 3, 3) [m] of a binary STL."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return np.frombuffer(file.read_bytes(), record, offset=84)["corners"].astype(float)


def surface(triangles: np.ndarray, count: int) -> np.ndarray:
    """All corners of the triangles and `count` points drawn evenly from their area."""
    rng = np.random.default_rng(0)
    a, b, c = triangles.transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    pick = rng.choice(len(triangles), count, p=area / area.sum())
    u = rng.dirichlet(np.ones(3), count)
    drawn = u[:, :1] * a[pick] + u[:, 1:2] * b[pick] + u[:, 2:] * c[pick]
    return np.vstack([triangles.reshape(-1, 3), drawn])


def meshes(hand: Hand) -> dict[str, np.ndarray]:
    """Points of every link's visual mesh, in the link's frame."""
    folder, points = hand.urdf.parents[1] / "meshes", {}
    for link in ElementTree.parse(hand.urdf).iter("link"):
        visual = link.find("visual")
        origin = visual.find("origin")
        values = [[0.0] * 3, [0.0] * 3]
        if origin is not None:
            values = [[float(x) for x in origin.get(key).split()] for key in ("rpy", "xyz")]
        triangles = read_stl(folder / Path(visual.find("geometry/mesh").get("filename")).name)
        points[link.get("name")] = surface(triangles, 1000) @ pin.rpy.rpyToMatrix(*values[0]).T + values[1]
    return points


def boxes(hand: Hand) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Lower and upper corner of every collision box that the URDF gives, in the link's frame."""
    found = {}
    for link in ElementTree.parse(hand.urdf).iter("link"):
        box = link.find("collision/geometry/box")
        if box is not None:
            centre = np.array(link.find("collision/origin").get("xyz").split(), float)
            half = np.array(box.get("size").split(), float) / 2
            found[link.get("name")] = (centre - half, centre + half)
    return found


def placements(hand: Hand, joints: np.ndarray) -> dict[str, pin.SE3]:
    data = hand.model.createData()
    pin.framesForwardKinematics(hand.model, data, joints)
    bodies = [(i, f.name) for i, f in enumerate(hand.model.frames) if f.type == pin.FrameType.BODY]
    return {name: data.oMf[i].copy() for i, name in bodies}


def outside(hand: Hand, joints: np.ndarray, points: np.ndarray) -> float:
    """The largest distance [m] of the points (P, 3), in the root's frame, outside the union of the spheres."""
    centres, radii = frames(hand, ORIGIN, joints)[1], np.array([s.radius for s in hand.spheres])
    distances = np.linalg.norm(points[:, None] - centres, axis=2) - radii
    return float(distances.min(axis=1).max())


def poses(hand: Hand, count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [hand.reference, *rng.uniform(hand.lower, hand.upper, (count, len(hand.joint_names)))]


def test_the_spheres_cover_every_link_mesh(hand: Hand):
    cloud = meshes(hand)
    for joints in poses(hand, 4):
        places = placements(hand, joints)
        gaps = {
            link: outside(hand, joints, points @ places[link].rotation.T + places[link].translation)
            for link, points in cloud.items()
        }
        assert gaps.pop("palm_link") < 12.5 * MM
        assert max(gaps.values()) < 6 * MM, gaps


def test_the_spheres_cover_the_corners_of_the_palms_box(hand: Hand):
    corners = np.array(np.meshgrid(*np.transpose(boxes(hand)["palm_link"]))).reshape(3, -1).T
    assert outside(hand, hand.reference, corners) < 2.5 * MM


def test_no_sphere_bulges_far_out_of_the_links(hand: Hand):
    places, covers = placements(hand, hand.reference), boxes(hand)
    bounds = [(link, p.min(axis=0), p.max(axis=0)) for link, p in meshes(hand).items()]
    bounds += [(link, low, high) for link, (low, high) in covers.items()]
    directions = np.random.default_rng(2).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for sphere, centre in zip(hand.spheres, frames(hand, ORIGIN, hand.reference)[1], strict=True):
        shell = centre + sphere.radius * directions
        gaps = []
        for link, low, high in bounds:
            local = (shell - places[link].translation) @ places[link].rotation
            gaps.append(np.linalg.norm(np.maximum(0, np.maximum(low - local, local - high)), axis=1))
        assert np.min(gaps, axis=0).max() < 5.5 * MM, sphere.name


def test_the_pad_is_the_fingertip_mesh(hand: Hand):
    cloud = meshes(hand)
    for finger, sphere in zip(hand.fingers, hand.tip_spheres, strict=True):
        ball = hand.spheres[sphere]
        assert (ball.link, ball.radius) == (finger.frame, finger.radius)
        np.testing.assert_array_equal(ball.centre, finger.offset)
        points = cloud[finger.frame]
        dome = np.linalg.norm(points[points[:, 2] > 0] - finger.offset, axis=1)
        assert abs(dome.max() - finger.radius) < 0.1 * MM


@pytest.mark.parametrize("preset", ["cover", "paper"])
def test_no_checked_pair_touches_in_the_reference_pose(hand: Hand, preset: str):
    hand = load_hand(hand.name, preset)
    centres, radii = frames(hand, ORIGIN, hand.reference)[1], [s.radius for s in hand.spheres]
    for i, j in hand.pairs:
        assert np.linalg.norm(centres[i] - centres[j]) > radii[i] + radii[j] + 5 * MM, (i, j)


def test_the_presets_have_the_documented_sizes(hand: Hand):
    assert (len(hand.spheres), len(hand.pairs)) == (45, 24)
    paper = load_hand(hand.name, "paper")
    assert (len(paper.spheres), len(paper.pairs)) == (16, 8)
    assert [s.radius for s in paper.spheres] == [0.01] * 12 + [0.02] * 4


def test_fingers_stand_side_by_side_and_the_thumb_opposes_them(hand: Hand):
    side = {"allegro_left": 1, "allegro_right": -1}[hand.name]
    tips = frames(hand, ORIGIN, hand.reference)[0]
    assert [finger.name for finger in hand.fingers] == ["index", "middle", "ring", "thumb"]
    assert (np.diff(side * tips[:3, 1]) > 0).all()  # the index is on the thumb's side
    assert (tips[:3, 2] > 0).all()
    assert tips[3, 2] < 0
    assert (tips[:, 0] > 0.05).all()  # all in front of the palm, which looks along +x
    for finger, first in zip(hand.fingers, (0, 4, 8, 12), strict=True):
        assert [hand.joint_names[j] for j in finger.joints] == [f"joint_{first + k}.0" for k in range(4)]


def test_the_right_hand_mirrors_the_left_one():
    left, right = load_hand("allegro_left"), load_hand("allegro_right")
    for ours, theirs in zip(frames(left, ORIGIN, left.reference), frames(right, ORIGIN, right.reference), strict=True):
        np.testing.assert_allclose(theirs, ours @ MIRROR, atol=1e-8)  # the URDFs round pi to ten digits
    for start, other in zip(left.wrist_starts, right.wrist_starts, strict=True):
        rotation, mirrored = (pin.Quaternion(np.array(s.quaternion)).toRotationMatrix() for s in (start, other))
        np.testing.assert_allclose(mirrored, MIRROR @ rotation @ MIRROR, atol=1e-12)
        np.testing.assert_allclose(other.position, MIRROR @ start.position)


def test_the_first_wrist_start_looks_down_on_the_object_with_its_fingers_along_x(hand: Hand):
    box = np.array([0.1, 0.2, 0.03]), np.array([0.06, 0.06, 0.06])
    pose = pin.XYZQUATToSE3(hand.wrist_starts[0].pose(*box))
    np.testing.assert_allclose(pose.rotation @ [1, 0, 0], [0, 0, -1], atol=1e-12)  # palm normal
    np.testing.assert_allclose(pose.rotation @ [0, 0, 1], [1, 0, 0], atol=1e-12)  # fingers
    np.testing.assert_allclose(pose.translation, [0.05, 0.2, 0.12])
    assert len(hand.wrist_starts) == 7


def test_euler_angles_are_intrinsic_xyz():
    from scipy.spatial.transform import Rotation

    for start, angles in zip(load_hand("allegro_left").wrist_starts[3:5], ([-90, 90, 0], [-90, 0, 0]), strict=True):
        turn = Rotation.from_euler("XYZ", angles, degrees=True) * Rotation.from_euler("y", 90, degrees=True)
        assert (Rotation.from_quat(start.quaternion) * turn.inv()).magnitude() < 1e-12


def test_limits_hold_the_reference_and_arrays_cannot_be_written(hand: Hand):
    assert (hand.lower < hand.upper).all()
    assert ((hand.lower <= hand.reference) & (hand.reference <= hand.upper)).all()
    assert (hand.effort == 0.7).all()
    np.testing.assert_array_equal(hand.gain_initial, [80, 80, 80, 160])
    for array in (hand.lower, hand.reference, hand.gain_upper, hand.spheres[0].centre, hand.wrist_starts[0].position):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_hand_survives_pickling(hand: Hand):
    copy = pickle.loads(pickle.dumps(hand))
    for ours, theirs in zip(frames(hand, ORIGIN, hand.reference), frames(copy, ORIGIN, copy.reference), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_a_folder_with_other_names_and_three_fingers_is_a_hand():
    hand = load_hand(THREE)
    assert [finger.name for finger in hand.fingers] == ["a", "b", "c"]
    assert hand.joint_names[:3] == ("a_slide", "a_bend", "a_curl")
    np.testing.assert_array_equal(hand.gain_initial, [100, 100, 100])
    assert "three_fingers" not in available_hands()


def test_a_mimic_joint_has_no_coordinate_and_narrows_the_limits_of_the_one_it_follows(tmp_path: Path):
    hand = load_hand(coupled(tmp_path))
    assert "b_curl" not in hand.joint_names
    assert hand.moving_joints == (*hand.joint_names, "b_curl")
    (mimic,) = hand.mimics
    assert (hand.joint_names[mimic.joint], mimic.multiplier, mimic.offset) == ("a_bend", MULTIPLIER, OFFSET)
    assert [hand.joint_names[j] for j in hand.fingers[1].joints] == ["b_slide", "b_bend", "a_bend"]
    highest = (-0.5 - OFFSET) / MULTIPLIER  # where b_curl is at its lower limit; a_bend itself goes to 1.5
    assert hand.upper[mimic.joint] == pytest.approx(highest)
    assert hand.lower[mimic.joint] == -0.5
    assert hand.moving_angles(hand.upper)[-1] == pytest.approx(-0.5)


def test_a_mimic_of_a_mimic_follows_the_joint_at_the_end(tmp_path: Path):
    coupled(tmp_path)
    axis = '<axis xyz="0 0 -1"/>'
    changed(tmp_path, "hand.urdf", (axis, f'{axis}<mimic joint="b_curl" multiplier="2" offset="0.1"/>'))
    hand = load_hand(changed(tmp_path, "hand.yaml", (", c_bend: 0.2", "")))
    chained = next(mimic for mimic in hand.mimics if mimic.name == "c_bend")
    assert hand.joint_names[chained.joint] == "a_bend"
    assert chained.multiplier == pytest.approx(2 * MULTIPLIER)
    assert chained.offset == pytest.approx(2 * OFFSET + 0.1)


def test_the_five_fingered_hand_has_fifteen_joints_and_five_that_follow():
    hand = load_hand("dlr_hit_right")
    assert [finger.name for finger in hand.fingers] == ["index", "middle", "ring", "little", "thumb"]
    assert (len(hand.joint_names), len(hand.mimics)) == (15, 5)
    for finger, mimic in zip(sorted(hand.fingers, key=lambda f: f.name), hand.mimics, strict=True):
        assert [hand.joint_names[j] for j in finger.joints] == [
            f"{finger.name}_{j}" for j in ("spread", "flex", "bend")
        ]
        assert (mimic.name, hand.joint_names[mimic.joint]) == (f"{finger.name}_bend_distal", f"{finger.name}_bend")
    straight = np.zeros(15)
    tips = frames(hand, ORIGIN, straight)[0]
    base = placements(hand, straight)["middle_base"].translation
    assert np.linalg.norm(tips[1] - base) == pytest.approx(0.055 + 0.025 + 0.016)  # phalanges to the pad's centre


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("root: base", "root: bass", "hand.urdf: unknown root 'bass'; valid: a_link"),
        ("effort: 1.0", "effort: strong", "effort must be 9 finite numbers, not strong"),
        ("effort: 1.0", "effort: 0", "effort of joint 'a_slide' must be positive, not 0"),
        ("effort: 1.0", "efort: 1.0", "unknown key in the file 'efort'; valid: couplings, effort, fingers"),
        ("effort: 1.0\n", "", "the key 'effort' is missing"),
        ("effort: 1.0", "effort: yes", "effort must be 9 finite numbers, not True"),
        ("effort: 1.0", "effort: 1.0\neffort: 2.0", "the key 'effort' is there twice"),
        (
            "offset: [0.01, 0, 0.03], radius: 0.008",
            "offset: [0.01, 0, 0.03], radius: 12",
            "radius of finger 'a' must be at most 0.1 m, not 12; is it in metres?",
        ),
        (
            "palm: {link: base, centre: [0, 0, 0], radius: 0.03}",
            "palm: {link: base, centre: [0, 0, 0], radius: 30}",
            "radius of sphere 'palm' must be at most 0.5 m, not 30; is it in metres?",
        ),
        (
            "centre: [0, 0, 0.02], radius: 0.01",
            "centre: [0, 0, 20], radius: 0.01",
            "sphere 'a_bone' is 20 m off its link 'a_link', more than the 0.25 m that links are apart; is it",
        ),
        (
            "centre: [0, 0, 0.02], radius: 0.01",
            "centre: [0, 0.3, 0], radius: 0.01",
            "sphere 'a_bone' is 0.3 m off its link 'a_link'",
        ),
        ("offset: [0, 0.002, 0.03]", "offset: [0, 2, 30]", "the pad of finger 'b' is 30.0666 m off its link 'b_tip'"),
        (
            "position: [0, 0, 0.1]",
            "position: [0, 0, 100]",
            "position of wrist start 1 must be at most 1 m from 0, not 100; is it in metres?",
        ),
        ("effort: 1.0", "effort: 700", "effort of joint 'a_bend' must be at most 100 N m, not 700; is it in N m?"),
        ("effort: 1.0", "effort: 2e5", "effort of joint 'a_slide' must be at most 10000 N, not 200000; is it in N?"),
        (
            "lower: 20, upper: 300, initial: 100",
            "lower: 0.02, upper: 0.3, initial: 0.1",
            "gain lower of finger 'a' must be 1 to 100000 N/m, not 0.02; is it in N/m?",
        ),
        (
            "lower: 20, upper: 300",
            "lower: 20, upper: 3e8",
            "gain upper of finger 'a' must be 1 to 100000 N/m, not 3e+08",
        ),
        ("effort: 1.0", "\teffort: 1.0", "has a tab; YAML is indented by spaces"),
        ("name: three_fingers", "name: [a, b]", "name must be a text"),
        ("tip: b_tip", "tip: a_tip", "fingers 'a' and 'b' have one tip, 'a_tip'; each has its own"),
        ("b: b_pad", "b: a_pad", "the sphere 'a_pad' is the pad of two fingers"),
        ("tip: a_tip", "tip: a_nail", "tip of finger 'a' 'a_nail'; valid: a_link, a_slide, a_tip, b_link"),
        ("tip: a_tip", "tip: base", "finger 'a': no movable joint between the root and 'base'"),
        ("name: b,", "name: a,", "3 fingers given; at least 3 of different names"),
        ("  - {name: b, tip: b_tip, offset: [0, 0.002, 0.03], radius: 0.008}\n", "", "2 fingers given; at least 3"),
        ("offset: [0, 0.002, 0.03]", "offset: [0, 0.002]", "offset of finger 'b' must be 3 finite numbers"),
        ("offset: [0, 0.002, 0.03]", "offset: [0, .nan, 0]", "offset of finger 'b' must be 3 finite numbers"),
        ("radius: 0.03}", "radius: -1}", "radius of sphere 'palm' must be positive, not -1"),
        ("{a_slide: 0, ", "{a_slid: 0, ", "unknown key in reference 'a_slid'; valid: a_bend, a_curl, a_slide"),
        ("{a_slide: 0, ", "{", "reference: the key 'a_slide' is missing"),
        ("a_bend: 0.2", "a_bend: 2", "reference angle 2 of 'a_bend' is outside [-0.5, 1.5]"),
        ("lower: 20", "lower: 0", "gains lower must be positive, not 0"),
        ("initial: 100", "initial: 10", "gain 10 of 'a' is outside [20, 300]"),
        ("link: base,", "link: bass,", "link of sphere 'palm' 'bass'; valid: a_link"),
        ("pads: {a: a_pad", "pads: {a: a_pat", "sphere of the pad of finger 'a' 'a_pat'; valid: a_bone, a_pad"),
        ("[a_bone, c_pad]", "[a_bon, c_pad]", "unknown sphere in a pair 'a_bon'; valid: a_bone"),
        ("[a_bone, c_pad]", "[a_bone, a_bone]", "a pair must be two different spheres"),
        ("[a_bone, c_pad]", "[a_bone]", "a pair must be two different spheres"),
        ("[a_bone, c_pad]", "a_bone", "a pair must be a list"),
        ("fingers:\n", "fingers: {}\n#", "is not YAML"),
        ("name: three_fingers", "name: 2001-99-99", "is not YAML"),
        (
            "    - {position: [0, 0, 0.1], euler_deg: [180, 0, 30]}",
            "    []",
            "wrist starts must be a list of one at least",
        ),
        (
            "euler_deg: [180, 0, 30]",
            "euler_deg: [3.1416, 0, 30]",
            "euler_deg of wrist start 1 must be degrees, not 3.1416, which is a part of π: 180?",
        ),
        ("urdf: hand.urdf", "urdf: foot.urdf", "the URDF foot.urdf is not there"),
        ("urdf: hand.urdf", "urdf: hand.yaml", "hand.yaml is no URDF that can be read"),
        ("urdf: hand.urdf", "urdf: {package: nothing-here, path: a.urdf}", "is its package installed?"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path: Path, old: str, new: str, message: str):
    assert message in refusal(changed(tmp_path, "hand.yaml", (old, new)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            '<limit lower="-0.01" upper="0.02"',
            '<limit lower="0.02" upper="0.02"',
            "'a_slide' has the limits [0.02, 0.02]",
        ),
        ('name="a_bend" type="revolute"', 'name="a_bend" type="continuous"', "'a_bend' is continuous, without an end"),
        ('name="a_bend" type="revolute"', 'name="a_bend" type="floating"', "hand.urdf: joint 'a_bend' is floating"),
        ('lower="-0.01" upper="0.02"', 'lower="0.02" upper="-0.01"', "lower must be below upper: swap them"),
        ('lower="-0.01" upper="0.02"', 'lower="-0,01" upper="0.02"', "lower of <limit> must be a finite number"),
        ('<limit lower="-0.01" upper="0.02" effort="1" velocity="1"/>', "", "joint 'a_slide' has no <limit>"),
        (BENT, f'{BENT}<mimic joint="b_curl"/>', "joint 'b_curl' mimics itself; remove its <mimic>"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "xyz of <axis> must not be 0"),
        ('<parent link="base"/>', '<parent link="bass"/>', "unknown parent of joint 'a_slide' 'bass'; valid: a_link"),
        ('<link name="base"/>', '<link name="base"/><link name="more"/>', "has 2 root links, 'base', 'more'"),
        ('<link name="base"/>', '<link name="base"/><link name="base"/>', "two links have the name 'base'"),
        (
            "</robot>",
            '<xacro:include filename="x"/></robot>',
            "hand.urdf is xacro; expand it (pip install xacro; xacro",
        ),
        ('xyz="0.04 0 0"', 'xyz="${far} 0 0"', "hand.urdf is xacro, it has '${far} 0 0'; expand it"),
        (
            '<robot name="three_fingers">',
            '<robot name="three_fingers">ä'.replace("ä", "<a>"),
            "no URDF that can be read",
        ),
        (BENT, f'{BENT}<mimic joint="a_bend" multiplier="0"/>', "'b_curl' mimics with the multiplier 0"),
        (
            BENT,
            f'{BENT}<mimic joint="a_bend" offset="9"/>',
            "the limits of 'b_curl' leave nothing of those of 'a_bend'",
        ),
        (BENT, f'{BENT}<mimic joint="nobody"/>', "unknown joint that 'b_curl' mimics 'nobody'; valid: a_bend"),
    ],
)
def test_a_urdf_that_cannot_be_planned_with_is_refused(tmp_path: Path, old: str, new: str, message: str):
    assert message in refusal(changed(tmp_path, "hand.urdf", (old, new)))


def keyed(target: Path, text: str) -> Path:
    """The made-up hand with more in its file."""
    return changed(target, "hand.yaml", ("gains:", f"{text}\ngains:"))


def test_a_hands_file_changes_limits_and_couplings_of_its_description(tmp_path: Path):
    changed(tmp_path, "hand.yaml", (", c_curl: 0.3", ""))
    law = "{c_curl: {joint: c_bend, multiplier: 0.5, offset: 0.1}}"
    hand = load_hand(keyed(tmp_path, f"limits: {{a_bend: [-0.1, 0.9]}}\ncouplings: {law}"))
    bend = hand.joint_names.index("a_bend")
    assert (hand.lower[bend], hand.upper[bend]) == (-0.1, 0.9)
    (mimic,) = hand.mimics
    assert (mimic.name, hand.joint_names[mimic.joint], mimic.multiplier, mimic.offset) == ("c_curl", "c_bend", 0.5, 0.1)


def test_a_mirrored_hand_has_its_tips_in_the_mirror(tmp_path: Path):
    changed(tmp_path, "hand.yaml", ("offset: [0, 0.002, 0.03]", "offset: [0, -0.002, 0.03]"))
    mirrored = load_hand(keyed(tmp_path, "mirror: true"))
    ours, theirs = (frames(hand, ORIGIN, hand.reference)[0] for hand in (mirrored, load_hand(THREE)))
    np.testing.assert_allclose(ours, theirs @ MIRROR, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("limits: {a_bend: [0]}", "limits of joint 'a_bend' must be two numbers, [lower, upper], not [0]"),
        ("limits: {a_bend: [0, far]}", "limits of joint 'a_bend' must be 2 finite numbers"),
        ("limits: {a_band: [0, 1]}", "hand.urdf: unknown joint in limits 'a_band'"),
        ("limits: []", "limits must be a mapping"),
        ("couplings: {a_bend: {joint: a_curl}}", "coupling of joint 'a_bend': the key 'multiplier' is missing"),
        ("mirror: left", "mirror must be true or false, not left"),
        ("miror: true", "unknown key in the file 'miror'"),
    ],
)
def test_wrong_changes_are_refused_in_one_line(tmp_path: Path, text: str, message: str):
    assert message in refusal(keyed(tmp_path, text))


def test_a_hand_whose_package_is_missing_is_refused_with_the_command_that_brings_it(tmp_path: Path):
    source = "urdf: {package: nothing-here, path: a.urdf, install: pip install nothing-here}"
    folder = changed(tmp_path, "hand.yaml", ("urdf: hand.urdf", source))
    with pytest.raises(NotInstalledError, match="not there; install its package: pip install nothing-here") as caught:
        load_hand(folder)
    assert caught.value.command == "pip install nothing-here"


def test_hands_are_listed_whether_their_package_is_there_or_not(monkeypatch: pytest.MonkeyPatch):
    listed = {listing.name: listing for listing in listed_hands()}
    assert tuple(listed) == available_hands()
    assert listed["dlr_hit_right"] == Listing("dlr_hit_right", 5, 15, 5, "", None)

    def missing(name: str) -> Hand:
        raise NotInstalledError("gone", "pip install it")

    monkeypatch.setattr(listing_module, "load_hand", missing)
    (here,) = (listing for listing in listed_hands() if listing.name == "allegro_left")
    assert here == Listing("allegro_left", 4, 16, None, "example-robot-data", "pip install it")


def test_what_an_mjcf_includes_counts_for_the_digest(tmp_path: Path):
    file = mjcf(tmp_path)
    before = content(file)
    assert before.startswith(file.read_bytes())
    (tmp_path / "parts.xml").write_text("<mujoco/>", encoding="utf-8")
    assert content(file) != before


@pytest.mark.parametrize(
    "written",
    [
        lambda text: b"\xef\xbb\xbf" + text.encode(),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("Three", "Drei für").encode(),
        lambda text: text.replace('<?xml version="1.0"?>', '<?xml version="1.0" encoding="UTF-16"?>').encode("utf-16"),
    ],
    ids=["byte order mark", "Windows line ends", "umlaut", "UTF-16"],
)
def test_a_urdf_in_any_encoding_is_the_same_hand(tmp_path: Path, written):
    folder = changed(tmp_path, "hand.urdf")
    text = (folder / "hand.urdf").read_text(encoding="utf-8")
    (folder / "hand.urdf").write_bytes(written(text))
    ours, theirs = (frames(h, ORIGIN, h.reference)[0] for h in (load_hand(folder), load_hand(THREE)))
    np.testing.assert_array_equal(ours, theirs)


def test_what_a_urdf_leaves_out_is_filled_in(tmp_path: Path):
    folder = changed(
        tmp_path,
        "hand.urdf",
        ('effort="1" velocity="1"', ""),
        ('<link name="base"/>', '<link name="base"><inertial><mass value="1"/></inertial></link>'),
        ("</robot>", '<transmission name="t"><joint name="a_bend"/></transmission></robot>'),
    )
    hand = load_hand(folder)
    assert hand.joint_names == load_hand(THREE).joint_names
    assert 'ixx="0"' in hand.description
    assert "transmission" not in hand.description


def test_of_many_names_the_nearest_are_listed(tmp_path: Path):
    with pytest.raises(InputError, match=r"unknown link 'ab9'; nearest of the 50 valid ones: ab(\d+, ab){5}\d+$"):
        raise unknown_name("link", "ab9", [f"ab{i}" for i in range(50)])


def test_unknown_hands_and_presets_list_the_valid_ones(tmp_path: Path):
    with pytest.raises(InputError, match=r"unknown hand 'shadow'; valid: .*allegro_left, allegro_right"):
        load_hand("shadow")
    with pytest.raises(InputError, match="unknown hand"):
        load_hand(tmp_path)
    with pytest.raises(InputError, match=r"unknown preset of spheres 'none'; valid: cover, paper"):
        load_hand("allegro_left", "none")


def refusal(folder: Path) -> str:
    """Why a hand is refused, in one line."""
    with pytest.raises(InputError) as caught:
        load_hand(folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)
