"""A hand's file drafted from a description: on made-up hands with known answers, and on the package's own."""

import itertools
from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from described import DISTAL, PROXIMAL, RADIUS, finger, radial, row
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from sgnlp.base.errors import InputError
from sgnlp.cli import draft_hand, run
from sgnlp.hand import geometry
from sgnlp.hand.check import examine
from sgnlp.hand.draft import pairs as pairs_module
from sgnlp.hand.draft.body import Body, body
from sgnlp.hand.draft.chains import chains
from sgnlp.hand.draft.closing import ends, sense
from sgnlp.hand.draft.covers import OUTSIDE, cover
from sgnlp.hand.draft.draft import Draft, _bones, draft
from sgnlp.hand.draft.order import enough, ordered
from sgnlp.hand.draft.pads import Pad, pad
from sgnlp.hand.draft.palm import candidates
from sgnlp.hand.draft.reference import Reference, finger_length, reference
from sgnlp.hand.draft.set_cover import cheapest
from sgnlp.hand.draft.skeleton import Skeleton, skin_points
from sgnlp.hand.draft.solids import CELL, Solid
from sgnlp.hand.draft.strength import FORCE
from sgnlp.hand.draft.text import text
from sgnlp.hand.draft.wrist import STARTS, euler_deg
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.hand.hand_file import euler_rotation
from sgnlp.hand.kinematics import tips
from sgnlp.hand.model import mimics
from sgnlp.perception.synthetic.meshes import box, cylinder, unit_sphere
from sgnlp.perception.synthetic.truth import surface_samples

TIPS = ("f2_distal", "f0_distal", "f3_distal")
FEW = settings(derandomize=True, deadline=None, max_examples=12)


def skeleton(file: Path) -> Skeleton:
    from sgnlp.hand.description import description
    from sgnlp.hand.model import joint_model

    told = description(file)
    return Skeleton(file, told, joint_model(told))


def written(drafted: Draft, folder: Path) -> Hand:
    """The hand of a draft, through its file."""
    folder.mkdir(exist_ok=True)
    (folder / "hand.yaml").write_text(text(drafted, folder), encoding="utf-8")
    return load_hand(folder)


def bare(file: Path) -> Path:
    """A description without its meshes."""
    first, *parts = file.read_text(encoding="utf-8").split("<visual>")
    file.write_text("".join([first, *(part.split("</visual>")[1] for part in parts)]), encoding="utf-8")
    return file


def undrawable() -> None:
    raise InputError("nothing draws")


def angle_deg(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other / np.linalg.norm(one) / np.linalg.norm(other), -1, 1))))


@pytest.fixture(scope="module")
def radial_draft(tmp_path_factory: pytest.TempPathFactory) -> Draft:
    return draft(radial(tmp_path_factory.mktemp("radial")))


@pytest.fixture(scope="module")
def mounted_draft(tmp_path_factory: pytest.TempPathFactory) -> Draft:
    """Of a hand on an arm, with a joint without end and tips that the user gives."""
    file = radial(tmp_path_factory.mktemp("mounted"), count=4, mounted=True)
    told = file.read_text(encoding="utf-8")
    endless = told.replace('name="f0_flex" type="revolute"', 'name="f0_flex" type="continuous"')
    assert endless != told
    file.write_text(endless, encoding="utf-8")
    return draft(file, tips=TIPS)


@pytest.fixture(scope="module")
def row_draft(tmp_path_factory: pytest.TempPathFactory) -> Draft:
    return draft(row(tmp_path_factory.mktemp("row")))


@pytest.fixture(scope="module")
def allegro() -> Draft:
    return draft(load_hand("allegro_left").urdf)


# --- palm and fingers ---


def test_the_palm_is_the_deepest_link_with_three_chains_also_on_an_arm(tmp_path: Path):
    assert candidates(skeleton(radial(tmp_path, mounted=True))) == ["palm"]


@pytest.mark.parametrize(
    "other",
    [
        '<link name="a"><visual><geometry><mesh filename="none.stl"/></geometry></visual></link>',
        '<link name="a"><visual><geometry><sphere radius="0"/></geometry></visual></link>',
        '<link name="a"/><joint name="wheel" type="revolute"><parent link="lower"/><child link="b"/>'
        '<limit lower="0" upper="0"/></joint><link name="b"/>',
    ],
)
def test_the_palm_is_found_on_a_robot_with_a_part_that_is_no_use(tmp_path: Path, other: str):
    file = radial(tmp_path, mounted=True)
    joint = '<joint name="on" type="floating"><parent link="lower"/><child link="a"/></joint></robot>'
    file.write_text(file.read_text(encoding="utf-8").replace("</robot>", other + joint), encoding="utf-8")
    assert candidates(_bones(file)) == ["palm"]


def test_chains_as_long_as_arms_are_no_fingers(tmp_path: Path):
    file = radial(tmp_path)
    told = file.read_text(encoding="utf-8").replace('<origin xyz="0 0 0.05"/><axis', '<origin xyz="0 0 0.5"/><axis')
    file.write_text(told, encoding="utf-8")
    with pytest.raises(InputError, match=r"below 'palm' are 0.50 m long: these are no fingers .* by --palm"):
        chains(skeleton(file))


def test_where_two_links_can_be_the_palm_both_are_named_with_the_flag(tmp_path: Path):
    with pytest.raises(InputError, match=r"'palm', 'palm_1'; choose one by --palm"):
        draft(radial(tmp_path, mounted=True, hands=2))


def test_a_description_with_two_chains_is_refused_with_where_they_end(tmp_path: Path):
    with pytest.raises(InputError, match="'f0_bend', 'f1_bend'"):
        draft(radial(tmp_path, count=2))


def test_a_palm_below_which_there_is_one_finger_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="--tips"):
        draft(radial(tmp_path), root="f0_proximal")


def test_joints_above_the_palm_are_cut_off(mounted_draft: Draft):
    assert mounted_draft.body.skeleton.root == "palm"
    assert mounted_draft.searched
    assert not {"wrist", "elbow"} & set(mounted_draft.body.skeleton.model.names)


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("rh_FFJ1", "index"),
        ("mf_ds", "middle"),
        ("rfmiddle", "ring"),
        ("right_thumb_1", "thumb"),
        ("pinky_tip", "little"),
        ("index_middle", "index"),
        ("lower_strut", None),
        ("diff_1", None),
    ],
)
def test_fingers_are_named_by_the_words_and_codes_of_their_links(name: str, word: str | None):
    from sgnlp.hand.draft.chains import _finger

    assert _finger(name.lower()) == word


def test_tips_of_the_user_keep_their_order_and_name_the_fingers(mounted_draft: Draft, tmp_path: Path):
    assert [chain.tip for chain in mounted_draft.body.chains] == list(TIPS)
    assert written(mounted_draft, tmp_path / "hand").fingers[1].name == "f0_distal"


def test_two_tips_on_one_link_are_refused(tmp_path: Path):
    with pytest.raises(InputError, match="3 tips or more are needed"):
        draft(radial(tmp_path), tips=("f0_distal", "f1_distal", "f1_distal"))


def in_order(file: Path) -> tuple[Body, Reference]:
    """All fingers of a description in their order."""
    tree = skeleton(file)
    fingers = body(tree, chains(tree), {})
    return ordered(fingers, reference(fingers))


def test_a_row_of_fingers_begins_beside_the_thumb_and_ends_with_it(row_draft: Draft):
    fingers, _ = in_order(row_draft.file)
    assert [chain.name for chain in fingers.chains] == ["index", "middle", "ring", "little", "thumb"]


@pytest.mark.parametrize("count", [3, 6])
def test_fingers_of_two_joints_are_as_many_as_half_the_freedoms_of_the_wrist(tmp_path: Path, count: int):
    tree = skeleton(radial(tmp_path, count))
    assert enough(Body(tree, tuple(chains(tree)), (), {})) == [0, 1, count - 1]


def test_the_finger_with_the_fewest_joints_of_its_own_is_left_out_first(tmp_path: Path):
    tree = skeleton(radial(tmp_path, 4))
    first, second, third, thumb = chains(tree)
    one = replace(first, joints=first.joints[:1])
    assert enough(Body(tree, (one, second, third, thumb), (), {})) == [1, 2, 3]
    shared = replace(second, joints=(*first.joints[:1], *second.joints[:1]))  # first and second have one each
    assert enough(Body(tree, (first, shared, third, thumb), (), {})) == [0, 2, 3]
    long = replace(third, joints=(*third.joints, *second.joints[:1], *first.joints[:1]))
    assert enough(Body(tree, (one, long, second, thumb), (), {})) == [1, 2, 3]


def test_a_joint_that_two_fingers_share_counts_once(tmp_path: Path):
    tree = skeleton(radial(tmp_path, 5))
    a, b, c, d, thumb = chains(tree)
    three = [replace(a, joints=(*a.joints, joint)) for joint in b.joints]  # the two share two of three joints
    row, short = (*three, replace(c, joints=(*c.joints, d.joints[0]))), replace(thumb, joints=thumb.joints[:1])
    assert enough(Body(tree, (*row, short), (), {})) == [0, 2, 3]


def test_the_efforts_of_a_hand_do_not_depend_on_the_fingers_that_are_left_out(tmp_path: Path):
    file = bare(radial(tmp_path, 5))
    first, *fingers = file.read_text(encoding="utf-8").replace('effort="0.5"', 'effort="0"').split(f'"0 0 {PROXIMAL}"')
    bones = [2 * PROXIMAL, PROXIMAL, 2 * PROXIMAL, 2 * PROXIMAL, PROXIMAL]
    text = "".join(f'"0 0 {bone}"{finger}' for bone, finger in zip(bones, fingers, strict=True))
    file.write_text(first + text, encoding="utf-8")
    made = draft(file)
    assert len(made.left) == 2
    whole = body(made.body.skeleton, chains(made.body.skeleton), {})
    assert made.strength.length == finger_length(whole) > finger_length(made.body) + PROXIMAL / 2
    assert made.strength.effort == pytest.approx(FORCE * made.strength.length)


def test_the_fingers_that_are_left_out_are_told_and_keep_their_spheres(tmp_path: Path):
    drafted = draft(radial(tmp_path, 6))
    assert len(drafted.body.chains) == 3
    assert len(drafted.left) == 3
    hand = written(drafted, tmp_path / "hand")
    assert f"{drafted.left[0]}, {drafted.left[1]} and {drafted.left[2]} have too few joints" in " ".join(
        (tmp_path / "hand" / "hand.yaml").read_text("utf-8").split()
    )
    assert any(sphere.link == drafted.left[0] for sphere in hand.spheres)
    tips = [f"f{i}_distal" for i in range(7)]
    assert len(draft(bare(radial(tmp_path, 7)), tips=tips).body.chains) == 7


def test_a_thumb_that_nothing_names_is_the_finger_that_opposes_the_others(tmp_path: Path):
    fingers, reference = in_order(row(tmp_path, words=("a", "b", "c", "d", "e")))
    assert fingers.chains[reference.thumb].tip == "e_distal"
    assert [chain.name for chain in fingers.chains] == ["index", "middle", "ring", "little", "thumb"]


# --- closing and pads ---


def test_a_joint_closes_to_its_larger_limit(tmp_path: Path):
    for limits, way in (("-0.1 1.5", 1), ("-1.5 0.1", -1), ("-0.4 0.4", 0)):
        parts = [finger(f"f{i}", "palm", (0.1 * i, 0, 0), (0, 0, 0), limits) for i in range(3)]
        file = tmp_path / "hand.urdf"
        file.write_text(f'<robot name="h"><link name="palm"/>{"".join(parts)}</robot>', encoding="utf-8")
        assert sense(skeleton(file), 1) == way


def test_the_end_of_a_finger_points_along_its_link_and_closes_to_the_palm_s_axis(tmp_path: Path):
    described = skeleton(radial(tmp_path))
    for end in ends(described, chains(described)):
        np.testing.assert_allclose(end.along, [0, 0, 1], atol=0.02)
        np.testing.assert_allclose(end.closing, [1, 0, 0], atol=0.02)


def test_an_end_whose_range_tells_nothing_closes_towards_the_other_tips(tmp_path: Path):
    file = radial(tmp_path)
    file.write_text(file.read_text(encoding="utf-8").replace('lower="-0.1"', 'lower="-1.5"'), encoding="utf-8")
    described = skeleton(file)
    for end in ends(described, chains(described)):
        np.testing.assert_allclose(end.closing, [1, 0, 0], atol=0.02)


def test_the_pad_of_a_finger_that_ends_in_a_ball_is_that_ball(tmp_path: Path):
    described = skeleton(radial(tmp_path))
    lines = chains(described)
    for chain, end in zip(lines, ends(described, lines), strict=True):
        found = pad(described, chain, end)
        np.testing.assert_allclose(found.centre, [0, 0, DISTAL], atol=5e-4)
        assert found.radius == pytest.approx(RADIUS, abs=4e-4)
        assert found.rms is not None
        assert found.worst is not None
        assert found.rms < 2e-4
        assert found.worst < 1e-3


def test_without_meshes_the_pad_is_at_the_tip_s_link(tmp_path: Path):
    described = skeleton(bare(radial(tmp_path)))
    lines = chains(described)
    found = pad(described, lines[0], ends(described, lines)[0])
    assert found.rms is None
    np.testing.assert_array_equal(found.centre, 0)


# --- spheres ---


@FEW
@given(st.floats(0.004, 0.02), st.floats(0.01, 0.08), st.booleans())
def test_spheres_leave_no_point_of_a_solid_more_than_3_mm_outside(radius: float, length: float, boxy: bool):
    mesh = box([2 * radius, 1.5 * radius, length]) if boxy else cylinder(radius, length, 24)
    skin = skin_points(mesh)
    found = cover(skin)
    again = surface_samples(mesh, 3000, np.random.default_rng(2))[0]
    centres, radii = np.array([b.centre for b in found.balls]), np.array([b.radius for b in found.balls])
    assert (cdist(skin, centres) - radii).min(axis=1).max() == pytest.approx(found.outside)
    assert found.outside <= OUTSIDE
    assert (cdist(again, centres) - radii).min(axis=1).max() <= OUTSIDE + 5e-4


def test_the_excess_is_how_far_spheres_bulge_out_of_the_link():
    mesh = box([0.02, 0.02, 0.06])
    found = cover(skin_points(mesh), 0.006)
    bulge = max(ball.radius - (0.01 - np.abs(ball.centre[:2]).max()) for ball in found.balls)
    assert found.excess == pytest.approx(bulge, abs=2 * CELL)
    assert found.excess <= 0.006 + 2 * CELL


def test_the_spheres_of_a_straight_finger_are_on_its_axis_and_few():
    mesh = cylinder(0.01, 0.06, 24)
    found = cover(skin_points(mesh), 0.006)
    assert len(found.balls) <= 4
    for ball in found.balls:
        np.testing.assert_allclose(ball.centre[:2], 0, atol=1e-12)


def test_what_a_pad_covers_needs_no_other_sphere():
    skin = 0.01 * unit_sphere(500).vertices
    assert cover(skin, 0.005, Pad(np.zeros(3), 0.01, np.array([0, 0, 1.0]), None, None)).balls == ()


def test_spheres_beside_a_pad_stay_behind_it_where_it_looks():
    looks = np.array([1.0, 0, 1]) / np.sqrt(2)

    def ahead(size: list[float]) -> float:
        """How far [m] spheres are before the pad at the end of a box."""
        one = Pad(np.array([0, 0, 0.015]), 0.01, looks, None, None)
        balls = cover(skin_points(box(size)), 0.008, one).balls
        return float(max((ball.centre - one.centre) @ looks + ball.radius for ball in balls) - one.radius)

    assert ahead([0.014, 0.016, 0.05]) <= 0
    assert ahead([0.02, 0.03, 0.05]) <= 0.002 + 1e-9  # its corners are 4 mm before the pad, and covered to 3 mm


def test_a_shell_that_is_open_on_one_side_is_full_and_a_corner_is_not():
    sheets = []
    for axis, side in ((0, -1), (0, 1), (1, -1), (1, 1), (2, -1)):
        points = np.random.default_rng(axis).uniform(-0.03, 0.03, (4000, 3))
        points[:, axis] = side * 0.03
        sheets.append(points)
    assert Solid(np.vstack(sheets)).depth(np.zeros((1, 3)))[0] > 0.015
    assert Solid(np.vstack([sheets[0], sheets[4]])).depth(np.array([[0.015, 0, 0.015]]))[0] < 0


def test_the_cheapest_cover_is_found_where_the_greedy_one_is_dearer():
    rng = np.random.default_rng(3)
    choices = np.array(list(itertools.product([False, True], repeat=10)))[1:]
    for _ in range(20):
        covered, costs = rng.random((40, 10)) < 0.3, rng.choice([1.0, 1.1], 10)
        covered = covered[covered.any(axis=1)]
        whole = (covered.astype(int) @ choices.T > 0).all(axis=0)
        found = cheapest(covered, costs)
        assert covered[:, found].any(axis=1).all()
        assert costs[found].sum() == pytest.approx((choices[whole] @ costs).min())


# --- pairs ---


def test_pairs_find_postures_in_which_fingers_overlap_and_none_overlaps_at_the_reference(row_draft: Draft):
    body, reference = row_draft.body, row_draft.reference
    centres = body.centres(reference.joints)
    for i, j in row_draft.pairs.pairs:
        assert np.linalg.norm(centres[i] - centres[j]) > body.radii[i] + body.radii[j]
        assert body.owners[i] != body.owners[j]
    assert row_draft.pairs.share >= 0.9
    assert 0 < len(row_draft.pairs.pairs) <= pairs_module.MOST


def test_pairs_chosen_one_by_one_find_most_first():
    overlaps = np.array([[1, 0, 0], [1, 0, 1], [0, 1, 1], [0, 1, 0], [0, 1, 0], [0, 0, 0]], bool)
    assert pairs_module._greedy(overlaps) == ([1, 0], 1.0)


# --- reference, wrist and strength ---


def test_pads_stand_around_the_ball_and_the_thumb_opposes_the_others(row_draft: Draft):
    body, found = row_draft.body, row_draft.reference
    pads = body.centres(found.joints)[: len(body.chains)]
    away = pads - found.ball
    gaps = np.linalg.norm(away, axis=1) - found.radius - [one.radius for one in body.pads]
    assert gaps.min() > 0
    assert angle_deg(away[found.thumb], -np.delete(away, found.thumb, axis=0).sum(axis=0)) < 20


def test_the_reference_stays_away_from_the_limits(row_draft: Draft):
    model, joints = row_draft.body.skeleton.model, row_draft.reference.joints
    room = np.minimum(joints - model.lowerPositionLimit, model.upperPositionLimit - joints)
    assert (room >= 0.09 * (model.upperPositionLimit - model.lowerPositionLimit)).all()


def test_the_palm_of_fingers_around_an_axis_looks_along_it(radial_draft: Draft):
    assert angle_deg(radial_draft.wrist.palm, np.array([0, 0, 1.0])) < 3


def test_the_palm_of_a_row_looks_to_where_its_fingers_close_square_to_the_way_to_the_thumb(row_draft: Draft):
    assert abs(row_draft.wrist.palm @ row_draft.wrist.fingers) < 1e-12
    assert angle_deg(row_draft.wrist.fingers, np.array([-1.0, 0, 0])) < 25


def test_the_root_s_turn_lets_the_palm_look_down_and_the_fingers_point_along_x(row_draft: Draft):
    turn = euler_rotation(list(row_draft.wrist.euler_deg), "root")
    np.testing.assert_allclose(turn @ row_draft.wrist.palm, [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(turn @ row_draft.wrist.fingers, [1, 0, 0], atol=1e-12)


@FEW
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_euler_angles_give_their_rotation_back(q: list[float]):
    rotation = pin.Quaternion(np.array(q) / np.linalg.norm(q)).matrix()
    np.testing.assert_allclose(euler_rotation(list(euler_deg(rotation)), "it"), rotation, atol=1e-7)


def test_euler_angles_give_their_rotation_back_in_gimbal_lock_too():
    rotation = euler_rotation([20, 90, 30], "it")
    np.testing.assert_allclose(euler_rotation(list(euler_deg(rotation)), "it"), rotation, atol=1e-7)


def test_starts_bring_the_middle_between_thumb_and_fingers_to_its_place(row_draft: Draft, tmp_path: Path):
    hand = written(row_draft, tmp_path / "hand")
    for start, (place, _) in zip(hand.wrist_starts, STARTS, strict=True):
        found = tips(hand, start.pose(np.zeros(3), np.zeros(3)), hand.reference)
        middle = (found[-1] + found[:-1].mean(axis=0)) / 2
        np.testing.assert_allclose(middle, place, atol=2e-3)


def test_efforts_of_the_description_are_taken_where_they_are_plausible(row_draft: Draft, allegro: Draft):
    assert row_draft.strength.told.all()
    np.testing.assert_array_equal(row_draft.strength.effort, 0.5)
    assert not allegro.strength.told.any()  # its 15 N m are a placeholder
    assert "joint_15.0" in text(allegro, Path()).split("effort:")[0]


# --- the file ---


def test_a_draft_of_the_allegro_is_near_the_file_made_by_hand(allegro: Draft, tmp_path: Path):
    made, drafted = load_hand("allegro_left"), written(allegro, tmp_path / "hand")
    assert [(f.name, f.frame) for f in drafted.fingers] == [(f.name, f.frame) for f in made.fingers]
    for one, other in zip(drafted.fingers, made.fingers, strict=True):
        np.testing.assert_allclose(one.offset, other.offset, atol=5e-4)
        assert one.radius == pytest.approx(other.radius, abs=5e-4)
    assert angle_deg(drafted.palm, made.palm) < 25
    np.testing.assert_allclose(drafted.effort, made.effort, atol=0.05)
    np.testing.assert_allclose(drafted.gain_initial, made.gain_initial)
    here, there = geometry.tips(drafted), geometry.tips(made)
    assert np.linalg.norm(here - there, axis=1).max() < 0.05


def test_nothing_is_wrong_about_a_draft(allegro: Draft, tmp_path: Path):
    written(allegro, tmp_path / "hand")
    done = examine(tmp_path / "hand")
    assert {f.verdict for f in done.findings} == {"ok"}
    assert done.hand is not None
    assert max(geometry.protrusions(done.hand).values()) < OUTSIDE + 5e-4


def test_the_description_of_an_installed_package_is_named_by_it_and_another_by_its_path(
    allegro: Draft, row_draft: Draft, tmp_path: Path
):
    assert "  package: example-robot-data\n" in text(allegro, tmp_path)
    assert f"urdf: {row_draft.file.name}\n" in text(row_draft, row_draft.file.parent)


def test_a_joint_without_end_gets_limits_that_the_file_tells(mounted_draft: Draft, tmp_path: Path):
    assert mounted_draft.changes.limits == {"f0_flex": (-1.5708, 1.5708)}
    assert "limits:\n  f0_flex: [-1.571, 1.571]" in text(mounted_draft, tmp_path)


def test_the_mirror_image_of_a_hand_has_its_fingers_on_the_other_side(row_draft: Draft, tmp_path: Path):
    hand, other = (written(one, tmp_path / "hand") for one in (row_draft, draft(row_draft.file, mirror=True)))
    np.testing.assert_allclose(geometry.finger_bases(other), geometry.finger_bases(hand) * [1, -1, 1], atol=2e-3)
    np.testing.assert_allclose(other.palm, hand.palm * [1, -1, 1], atol=0.05)


def test_joints_that_mimic_others_have_no_angle_of_their_own(tmp_path: Path):
    file = radial(tmp_path)
    told = file.read_text(encoding="utf-8")
    for i in range(3):
        head, tail = told.split(f'<link name="f{i}_distal">')
        told = (
            head.removesuffix("</joint>\n    ") + f'<mimic joint="f{i}_flex"/></joint><link name="f{i}_distal">{tail}'
        )
    file.write_text(told, encoding="utf-8")
    hand = written(draft(file), tmp_path)
    assert hand.joint_names == ("f0_flex", "f1_flex", "f2_flex")


def test_joints_that_one_motor_moves_and_guessed_radians_stand_in_the_file(tmp_path: Path):
    couple = [(f"f{i}_bend", f"f{i}_flex", 0.5) for i in range(3)]
    drafted = draft(bare(radial(tmp_path)), couple=couple)
    assert "radians" not in text(drafted, tmp_path)
    assert "Guessed: its angles are radians" in text(replace(drafted, radians=True), tmp_path)
    hand = written(drafted, tmp_path)
    assert hand.joint_names == ("f0_flex", "f1_flex", "f2_flex")
    assert {(mimic.name, mimic.multiplier) for mimic in mimics(hand.model)} == {(one[0], 0.5) for one in couple}
    with pytest.raises(InputError, match="unknown joint in couplings 'f9_bend'"):
        draft(tmp_path / "radial.urdf", couple=[("f9_bend", "f0_flex", 1.0)])
    with pytest.raises(InputError, match="twice"):
        draft(tmp_path / "radial.urdf", couple=[*couple, ("f0_bend", "f1_flex", 1.0)])
    with pytest.raises(InputError, match="finite factor for 'f0_bend', not nan"):
        draft(tmp_path / "radial.urdf", couple=[("f0_bend", "f0_flex", nan)])


def test_the_same_description_gives_the_same_draft(radial_draft: Draft, tmp_path: Path):
    assert text(draft(radial_draft.file), tmp_path) == text(radial_draft, tmp_path)


def test_the_command_writes_a_folder_draws_it_and_does_not_write_over_another(
    radial_draft: Draft, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    pytest.importorskip("matplotlib")
    pytest.importorskip("skimage")
    arguments = ["draft-hand", str(radial(tmp_path)), "--out", str(tmp_path / "hand")]
    assert run(arguments) == 0
    assert (tmp_path / "hand" / "draft.png").stat().st_size > 10_000
    assert " 0 wrong" in capsys.readouterr().out
    assert run(arguments) == 3
    assert "--force" in capsys.readouterr().err
    (tmp_path / "hand" / "hand.yaml").write_text("another", encoding="utf-8")
    monkeypatch.setattr(draft_hand, "draft", lambda *given: radial_draft)
    monkeypatch.setattr(draft_hand, "drawable", undrawable)
    assert run([*arguments, "--force"]) == 0
    assert "no picture: nothing draws" in capsys.readouterr().out
    assert (tmp_path / "hand" / "hand.yaml").read_text("utf-8") == text(radial_draft, tmp_path / "hand")
    monkeypatch.setattr(draft_hand, "draft", lambda *given: replace(radial_draft, left=("ring", "little")))
    assert run([*arguments, "--force"]) == 0
    assert "together with the others: ring and little; --tips names" in capsys.readouterr().out
