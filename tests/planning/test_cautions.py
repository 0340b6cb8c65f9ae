"""Cautions: each is said where its threshold is passed, and none of one body that stands on its table."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scenes import SMALL, ellipsoid, hand

import sgnlp
from sgnlp import InputError, observe, solve
from sgnlp.hand.hand import load_hand
from sgnlp.planning.additions import Additions
from sgnlp.planning.cautions import OF_CLOUDS, REMARKS, cautions, clouds, joined, plans, remarks
from sgnlp.planning.cautions.planned import Planned
from sgnlp.planning.starts import starts

PROBLEMS = Path(__file__).parents[2] / "problems"


@pytest.fixture(scope="module")
def plan():
    """A small plan of an ellipsoid that two cameras saw."""
    view = (ellipsoid()[:, 0] > 0).astype(int)
    cameras = np.array([[-0.5, 0.0, 0.4], [0.5, 0.0, 0.4]])
    cloud = observe(ellipsoid(), view=view, camera_positions=cameras, table_height=0.0, name="egg")
    settings = replace(SMALL, solver=replace(SMALL.solver, formulation="constrained"))
    return solve(cloud, hand(), settings, count=2, jobs=1)


@pytest.fixture(scope="module")
def result(plan) -> Planned:
    return Planned(plan.arrays(), plan.problem.hand, plan.observation, plan.problem)


# Clouds ---------------------------------------------------------------------------------------------------------------


def can(radius=0.033, height=0.1, eyes=((0.35, -0.1, 0.4), (0.0, 0.42, 0.45)), count=3000, seed=0):
    """What cameras see of a can that stands at the origin (n, 3), with the noise of a depth camera."""
    rng, seen = np.random.default_rng(seed), []
    for eye in np.array(eyes):
        a, z = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.0, height, count)
        side, out = np.c_[radius * np.cos(a), radius * np.sin(a), z], np.c_[np.cos(a), np.sin(a), 0 * a]
        q = radius * np.sqrt(rng.random(count // 3))[:, None]
        top = np.c_[q * np.c_[np.cos(a), np.sin(a)][: count // 3], np.full(count // 3, height)]
        p, n = np.vstack([side, top]), np.vstack([out, np.tile([0, 0, 1.0], (count // 3, 1))])
        seen.append(p[((eye - p) * n).sum(axis=1) > 0.1])
    points = np.vstack(seen)
    return points + rng.normal(0, 5e-4, points.shape)


CAN, UP = can(), np.array([0.0, 0.0, 1.0])


def moved(points, *by):
    return points + np.array(by)


def said(result, points, table: float | None = 0.0, **options):
    """The names of the cautions that a cloud gives."""
    return said_of(replace(result, cloud=observe(points, table_height=table, **options)))


def said_of(case: Planned) -> set[str]:
    return {caution.__name__ for caution in OF_CLOUDS if caution(case.cloud, case)}


def patch(x, y, z, count=2000):
    """A level or upright rectangle of noisy points, by ranges of x, y and z."""
    rng = np.random.default_rng(1)
    return np.c_[rng.uniform(*x, count), rng.uniform(*y, count), rng.uniform(*z, count)] + rng.normal(
        0, 1e-3, (count, 3)
    )


def frame(eye=(0.35, -0.1, 0.4), target=(0.0, 0.0, 0.05)):
    """Axes (3, 3) of a camera that looks at a target: x right, y down, z ahead."""
    z = np.array(target) - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def test_what_takes_the_place_of_something_built_in_is_told(result):
    ours = sgnlp.Constraint("contact", lambda g, op: g.contacts[:, 2], lower=0.0, unit="m")
    looser = replace(sgnlp.constraints()["force"], upper=20.0)

    def with_(*constraints):
        problem = replace(result.problem, additions=Additions(constraints=constraints))
        return plans.replaced(replace(result, problem=problem))

    assert with_() == with_(looser) == with_(replace(ours, name="heights")) == ""
    assert "the place of the built-in contact, which is neither" in with_(ours, looser)


def test_a_hand_for_which_the_arm_has_no_mount_of_its_own_is_told(result):
    robot = load_hand("allegro_left", arm="panda")
    assert plans.foreign_mount(replace(result, hand=robot)) == ""
    another = replace(robot, name="another")
    told = plans.foreign_mount(replace(result, hand=another))
    assert "no mount for the hand 'another'" in told
    one = replace(robot.arm, mounts={"default": robot.arm.mount})
    assert plans.foreign_mount(replace(result, hand=replace(another, arm=one))) == ""
    assert plans.foreign_mount(result) == ""


def test_two_objects_that_touch_are_told_by_the_neck_between_them(result):
    dense = can(count=6000)
    assert "touching" in said(result, np.vstack([dense, moved(dense, 0.066, 0, 0)]))
    assert said(result, dense) == set()
    square = patch((-0.03, 0.03), (-0.03, 0.03), (0.0, 0.08), 8000)
    assert "touching" in said(result, np.vstack([square, moved(square, 0.06, 0.035, 0)]))
    assert "touching" not in said(result, np.vstack([square, moved(square, 0.06, 0, 0)]))  # no neck: one long box
    handle = patch((0.03, 0.06), (-0.005, 0.005), (0.03, 0.05), 800)
    assert "touching" not in said(result, np.vstack([square, handle]))
    assert "touching" not in said(result, np.vstack([CAN[::8], moved(CAN[::8], 0.066, 0, 0)]))  # too sparse to say


def test_an_object_on_a_plate_is_told(result):
    rim = [patch((x, x), (-0.1, 0.1), (0.0, 0.02), 900) for x in (-0.1, 0.1)]
    plate = np.vstack([patch((-0.1, 0.1), (-0.1, 0.1), (0.02, 0.02), 9000), *rim])
    told = joined.stand(observe(np.vstack([plate, moved(CAN, 0, 0, 0.02)]), table_height=0.0), result)
    assert "20 mm above the table" in told
    assert "--table-height 0.020" in told
    low = patch((-0.04, 0.04), (-0.04, 0.04), (0.02, 0.02), 3000)
    assert joined.stand(observe(np.vstack([low, moved(CAN, 0, 0, 0.02)]), table_height=0.0), result) == ""


@pytest.mark.parametrize("table", [0.0, None])
def test_a_patch_of_the_table_beside_the_object_is_counted_once_and_its_foot_is_not(result, table):
    rng = np.random.default_rng(4)
    x, y, z = rng.uniform(0.035, 0.055, 300), rng.uniform(-0.015, 0.015, 300), rng.normal(1e-3, 3e-4, 300)
    cloud = observe(np.vstack([CAN, np.c_[x, y, z]]), table_height=table)
    assert said_of(replace(result, cloud=cloud)) == {"table_around"}
    least, most = ((cloud.points[:, 0] > edge).sum() for edge in (0.046, 0.043))
    assert least <= int(clouds.table_around(cloud, result).split()[0]) <= most
    near = np.c_[x, y, z][x < 0.042]  # within 9 mm of the can
    assert said(result, np.vstack([CAN, near]), table) == set()
    wide = patch((-0.08, 0.08), (-0.08, 0.08), (0.001, 0.002))
    assert said(result, np.vstack([CAN, wide]), table) == {"plane"}  # told once


def test_a_view_that_is_shifted_against_another_is_told_and_views_that_fit_are_not(result):
    cloud = sgnlp.load(PROBLEMS / "can_1.npz", views=["0", "1"])
    assert clouds.views_apart(cloud, result) == ""
    for number in (0, 1):
        shifted = cloud.points + np.where(cloud.view[:, None] == number, [0.0, 0.0, 0.02], 0.0)
        told = clouds.views_apart(replace(cloud, points=shifted), result)
        assert "of one view's points lie more than 12 mm before what another view measured" in told
    assert clouds.views_apart(replace(cloud, points=shifted, camera_positions=None), result) == ""


def test_one_body_on_its_table_gives_no_caution(result):
    assert said(result, CAN) == set()
    assert said(result, CAN, table=None) == set()
    assert said(result, moved(CAN, 0.5, -0.3, 0.7), table=0.7) == set()
    assert said(result, moved(CAN, 0.02, 0.03, 0.75), table=None) == set()  # on a high table before the robot


@pytest.mark.parametrize("apart", [(0.12, 0, 0), (0.1, 0.1, 0), (0, 0, 0.15)])
def test_two_bodies_are_told(result, apart):
    points = np.vstack([CAN, CAN + apart])
    assert "bodies" in said(result, points)
    told = clouds.bodies(observe(points, table_height=0.0), result)
    assert told.startswith("The cloud has 2 clusters more than 20 mm apart")


def test_a_few_stray_points_are_no_second_body(result):
    stray = np.array([0.1, 0.1, 0.05]) + 0.002 * np.random.default_rng(2).normal(size=(25, 3))
    assert "bodies" not in said(result, np.vstack([CAN, stray]))


@pytest.mark.parametrize("table", [None, 0.0])
def test_a_table_in_the_cloud_is_told_by_its_height(result, table):
    points = np.vstack([CAN, patch((-0.12, 0.12), (-0.12, 0.12), (0, 1e-9))])
    case = replace(result, cloud=observe(points, table_height=table))
    assert clouds.plane(case.cloud, case).startswith("A plane at the table's height holds")
    assert not clouds.underside(case.cloud, case)  # the plane has been told


def test_a_wall_behind_the_body_is_told(result):
    points = np.vstack([CAN, patch((-0.15, 0.15), (-0.036, -0.036 + 1e-9), (0.0, 0.25))])
    assert "plane" in said(result, points)


def test_a_box_is_no_wall(result):
    faces = [((-0.03, 0.03), (0.1, 0.1 + 1e-9), (0, 0.2)), ((0.03, 0.03 + 1e-9), (-0.1, 0.1), (0, 0.2)),
             ((-0.03, 0.03), (-0.1, 0.1), (0.2, 0.2 + 1e-9))]  # fmt: skip
    assert said(result, np.vstack([patch(*face) for face in faces])) == set()


@pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, -1)])
def test_a_camera_s_own_frame_is_told_whether_z_is_ahead_or_back(result, signs):
    eye = np.array([0.35, -0.1, 0.4])
    own = (can(eyes=[eye]) - eye) @ frame() * signs
    assert "camera_frame" in said(result, own, table=None)
    turned = observe(own * signs, pose=np.vstack([np.c_[frame(), eye], [0, 0, 0, 1]]), table_height=0.0)
    assert not clouds.camera_frame(turned, result)


def test_a_body_whose_underside_was_seen_is_told_unless_the_axis_is(result):
    lying = can(eyes=((0.35, 0.0, 0.4), (0.0, 0.42, 0.45)))[:, [0, 2, 1]] * [1, 1, -1]  # y up
    assert "underside" in said(result, lying, table=None)
    up = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    assert "underside" not in said(result, lying, table=None, pose=up)


def test_a_body_in_the_air_is_told(result):
    assert said(result, CAN, table=-0.025) == set()
    assert said(result, CAN, table=-0.04) == {"in_the_air"}


def test_rounded_coordinates_are_told(result):
    assert "rounded" in said(result, np.round(CAN / 0.005) * 0.005)
    assert "rounded" in said(result, moved(CAN, 1e5, 0, 0).astype(np.float32))
    assert "rounded" not in said(result, np.round(CAN, 3))


def test_a_body_that_ends_below_the_pads_is_told(result):
    card = patch((-0.04, 0.04), (-0.03, 0.03), (0.004, 0.004 + 1e-9))
    case = replace(result, cloud=observe(card[card[:, 2] > 0], table_height=0.0))
    assert "below the pads' radius of 12 mm" in clouds.thin(case.cloud, case)
    assert "thin" not in said(result, CAN)


def test_real_clouds_and_their_views_give_no_caution_of_clouds(result, real_clouds):
    from sgnlp import load

    for file in real_clouds:
        for views in (["415"], ["435", "455"], None):
            case = replace(result, cloud=load(file, views=views))
            assert said_of(case) <= {"thin_walls"}


def test_no_problem_gives_a_caution_of_a_scene(result):
    """None is several bodies, a table or wall, a camera's own frame, or in the air."""
    from sgnlp import load

    for file in sorted(PROBLEMS.glob("*.npz")):
        cloud = load(file)
        for caution in (clouds.bodies, clouds.plane, clouds.camera_frame, clouds.in_the_air):
            assert caution(cloud, result) == "", file.stem


def test_a_scene_is_told_by_which_command_one_object_is_taken_out_of_it(result):
    two = observe(np.vstack([CAN, moved(CAN, 0.12, 0, 0)]), table_height=0.0)
    assert clouds.bodies(two, result).endswith("take one object out of it by `sgnlp cloud FILE`.")
    named = clouds.bodies(replace(two, source="shelf.ply"), result)
    assert named.endswith("take one object out of it by `sgnlp cloud shelf.ply`.")
    on_table = observe(np.vstack([CAN, patch((-0.12, 0.12), (-0.12, 0.12), (0, 1e-9))]))
    assert clouds.plane(on_table, result).endswith("take one object out of it by `sgnlp cloud FILE`.")
    with pytest.raises(InputError, match=r"is it a whole scene. `sgnlp cloud FILE` takes one object out of a scene"):
        observe(np.vstack([CAN, moved(CAN, 0.6, 0, 0)]))


# Plans ----------------------------------------------------------------------------------------------------------------


def with_meta(result: Planned, **sections: dict) -> Planned:
    """The result with other settings told in its meta."""
    settings = {name: value | sections.get(name, {}) for name, value in result.grasps.meta["settings"].items()
                if isinstance(value, dict)}  # fmt: skip
    meta = result.grasps.meta | {"settings": result.grasps.meta["settings"] | settings}
    return replace(result, grasps=replace(result.grasps, meta=meta))


def with_grasps(result: Planned, **arrays: object) -> Planned:
    return replace(result, grasps=replace(result.grasps, **arrays))


def cup(thickness: float) -> np.ndarray:
    """Points of two walls that face two cameras."""
    rng = np.random.default_rng(0)
    front, back = rng.uniform(-0.04, 0.04, (2, 1500, 3))
    front[:, 0], back[:, 0] = thickness / 2, -thickness / 2
    points = np.concatenate([front, back])
    return points + np.array([0, 0, 0.05])


def walls(thickness: float):
    cameras = [[0.5, 0, 0.1], [-0.5, 0, 0.1]]
    return observe(cup(thickness), view=np.repeat([0, 1], 1500), camera_positions=cameras, table_height=0.0)


def test_a_sound_result_gives_no_reason_but_the_ones_it_has(plan, result):
    quiet = (plans.no_feasible, plans.stopped, plans.unsolved, plans.beside)
    assert not said_of(result) | {caution.__name__ for caution in quiet if caution(result)}
    assert not [remark.__name__ for remark in REMARKS if remark(result.cloud, result)]
    assert all(said.endswith(".") for said in cautions(result))
    assert plan.summary()["cautions"] == cautions(result)


def test_a_plan_without_grasps_has_the_cautions_of_its_cloud(result):
    nothing = replace(result, grasps=with_grasps(result, energy=np.zeros(0)).grasps)
    assert cautions(replace(nothing, cloud=observe(CAN, table_height=-0.1)))[0].startswith(
        "The cloud begins 100 mm above the table"
    )


def test_each_caution_is_told_where_its_threshold_is_passed(result):
    g, cloud = result.grasps, result.cloud
    far = g.contact_points + np.array([0.0, 0.0, 1.0])
    assert "No start ended feasible" in plans.no_feasible(with_grasps(result, feasible=np.zeros(len(g), bool)))
    assert "Only 2 of 9" in plans.no_feasible(with_grasps(result, meta=g.meta | {"tried": 9}))
    failing = with_grasps(result, feasible=np.zeros(len(g), bool), violated=np.array(["contact; way", "contact"]))
    named = "distance of the pads to the surface at first contact (contact, 2); links clear on the way to the contacts"
    assert f"{named} (way, 1)." in plans.no_feasible(failing)
    assert "7 of the starts gave no solution" in plans.stopped(with_grasps(result, meta=g.meta | {"tried": 9}))
    assert "not an optimum" in plans.unsolved(with_grasps(result, kkt=g.kkt + 2e-5))
    assert "fewer than the 5000" in clouds.few_points(cloud, with_meta(result, free_space={"surface_points": 5000}))
    assert "One view has" in clouds.one_view(replace(cloud, view_names=("0",)), result)
    assert "index 9" in plans.unseen_contacts(with_grasps(result, contact_points=far))
    assert not plans.unseen_contacts(with_grasps(result, contact_points=g.contact_points * 0 + cloud.points[0]))
    assert "left out: it is gone." in remarks(replace(result, missing="it is gone", cloud=None))[0]


@pytest.mark.parametrize("kernel", sorted(plans.CALIBRATION))
def test_uncertain_contacts_are_told_by_the_factor_of_their_kernel(result, kernel):
    deviation = np.full_like(result.grasps.contact_deviation, 0.012 / plans.CALIBRATION[kernel])
    case = with_grasps(result, meta=result.grasps.meta | {"kernel": kernel, "free_space": False})
    assert not plans.uncertain_contacts(with_grasps(case, contact_deviation=0.99 * deviation))
    assert "thumb 12 mm" in plans.uncertain_contacts(with_grasps(case, contact_deviation=1.01 * deviation))
    case = with_grasps(result, meta=result.grasps.meta | {"kernel": kernel, "free_space": True})  # calibrated already
    assert not plans.uncertain_contacts(with_grasps(case, contact_deviation=0 * deviation + 0.0119))
    assert "thumb 12 mm" in plans.uncertain_contacts(with_grasps(case, contact_deviation=0 * deviation + 0.0121))


def test_cameras_that_stood_elsewhere_are_told(result):
    cloud = result.cloud
    assert not clouds.cameras(cloud, result)
    assert not clouds.cameras(replace(cloud, camera_positions=None), result)
    swapped = replace(cloud, camera_positions=cloud.camera_positions[::-1])
    alone = with_grasps(result, meta=result.grasps.meta | {"free_space": False})
    assert not clouds.cameras(cloud, alone)
    assert "camera positions are wrong: " in clouds.cameras(swapped, alone)


def test_contacts_and_targets_beside_the_object_are_told(result):
    g = result.grasps
    middle = result.cloud.points.mean(axis=0)
    inside = with_grasps(result, contact_points=0 * g.contact_points + middle, targets=0 * g.targets + middle)
    assert not plans.beside(inside)
    away = inside.grasps.targets.copy()
    away[0, 3, 2] = result.cloud.points[:, 2].max() + 0.005
    assert "Targets lie outside the hull of the cloud and its table: thumb 5 mm" in plans.beside(
        with_grasps(inside, targets=away)
    )
    away[0, 3, 2] += 0.02
    assert "Contacts" not in plans.beside(with_grasps(inside, contact_points=away))
    away[0, 3, 2] += 0.01
    assert "Contacts lie more than 30 mm outside" in plans.beside(with_grasps(inside, contact_points=away))


def test_torques_above_the_effort_are_told(result):
    strong = replace(result.problem.hand, effort=1e3 * result.problem.hand.effort)
    assert not plans.torques(replace(result, problem=replace(result.problem, hand=strong)))
    weak = replace(result.problem.hand, effort=1e-3 * result.problem.hand.effort)
    said = plans.torques(replace(result, problem=replace(result.problem, hand=weak)))
    assert "times the hand's effort: --limits.effort 1" in said


def test_an_assumed_table_is_told(result):
    guessed = observe(ellipsoid(), name="egg")
    assert "cropped" in clouds.table_assumed(guessed, result)


@pytest.mark.parametrize(("travel", "said"), [(0.0, ""), (0.2, "went 20 cm"), (0.3, "stops the wrist")])
def test_a_wrist_far_from_its_start_is_told(result, travel, said):
    begin = starts(result.problem, 2, 0)[int(result.grasps.start[0])].wrist
    turn = pin.XYZQUATToSE3(begin).rotation
    wrist = result.grasps.wrist.copy()
    wrist[0] = begin
    wrist[0, :3] += turn @ [0, travel, 0]
    told = plans.far_start(with_grasps(result, wrist=wrist))
    assert said in told
    assert bool(said) == bool(told)


@pytest.mark.parametrize(("margin", "shift", "told"), [(0.005, 0.02, True), (0.02, 0.02, False), (0.005, 1e-3, False)])
def test_a_runner_up_is_close_if_it_is_as_good_and_another_grasp(result, margin, shift, told):
    two = np.array([0, 0])
    g = result.grasps
    chosen = {name: getattr(g, name)[two] for name in ("contacts", "margins_initial", "margins_equilibrium", "energy")}
    chosen["contacts"] = chosen["contacts"] + np.array([0, shift])[:, None, None]
    for name in ("margins_initial", "margins_equilibrium"):
        chosen[name] = np.full_like(chosen[name], 0.1) - np.array([0, margin])[:, None]
    both = with_grasps(result, feasible=np.array([True, True]), start=np.array([4, 5]), **chosen)
    assert ("start 5 is as good" in plans.close_runner_up(both)) is told


def test_walls_that_noise_hides_are_told_and_thick_ones_are_not(result):
    assert clouds.wall_share(walls(0.004), 0.01) > 0.5
    assert clouds.wall_share(walls(0.03), 0.01) == 0
    assert "walls thinner than 5 mm" in clouds.thin_walls(walls(0.004), result)
    assert not clouds.thin_walls(walls(0.03), result)


def test_grasps_with_the_same_contacts_count_once():
    contacts = np.zeros((4, 4, 3))
    contacts[1] += 0.5e-3
    contacts[2, 3] = 0.01
    contacts[3, 3] = 0.011
    assert plans.alike(contacts) == [0, 0, 2, 2]
