"""Every constraint: its rows by an independent formula, and the side of its bound on which a bad grasp falls."""

import pickle
from dataclasses import replace
from math import inf

import numpy as np
import pinocchio as pin
import pytest
from scenes import (
    CROWD,
    SMALL,
    exact_grasp,
    hand,
    observation,
    oracle,
    posed,
    pregrasp,
    random_grasp,
    random_point,
    unbuilt,
)
from scipy.spatial.transform import Rotation

from sgnlp.base.errors import InputError
from sgnlp.base.presets import PRESETS
from sgnlp.base.settings import Limits
from sgnlp.hand.arm import load_arm
from sgnlp.hand.kinematics import frames
from sgnlp.perception.clutter import upright_box
from sgnlp.planning.recompute import recompute, rotation_angle
from sgnlp.planning.surroundings import NOWHERE
from sgnlp.program.constraint import Constraint
from sgnlp.program.constraints import CONSTRAINTS, preset_constraints
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.formulations import formulation
from sgnlp.program.formulations.lifted import EQUATIONS
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Exact

HEAVY = replace(SMALL, contact=replace(SMALL.contact, mass=0.2), limits=replace(SMALL.limits, effort=1.0))
MOVED = replace(
    HEAVY,
    contact=replace(HEAVY.contact, displacement=(0.0, 0.0, 0.01), rotation=(0.1, 0.2, -0.1)),
    weights=replace(HEAVY.weights, pose=1.0),
)
CLOSURE = replace(HEAVY, contact=replace(HEAVY.contact, metric="closure", heuristic=1.6))
PLANNED = replace(HEAVY, closing=replace(HEAVY.closing, planned=True))
ALL = {c.name: c for c in (*CONSTRAINTS, *EQUATIONS)}
NAMES = list(ALL)
PAD = 0.012
"""Radius of the pads [m]. The table is at 0."""


def rows(name: str, g: Grasp) -> np.ndarray:
    """The unscaled rows of a constraint."""
    return np.atleast_1d(ALL[name].value(g, Exact()))


def bound(name: str, *choices) -> Constraint:
    """A constraint with the bounds of the first settings that ask for it."""
    asked = [{c.name: c for c in (*preset_constraints(s, CROWD.around(s, True)), *EQUATIONS)} for s in choices]
    return next(constraints[name] for constraints in asked if name in constraints)


def violated(name: str, g: Grasp, *choices) -> bool:
    constraint = bound(name, *(choices or (PLANNED, CLOSURE)))
    return bool((rows(name, g) < constraint.lower).any() or (rows(name, g) > constraint.upper).any())


def names(settings, form: str) -> list[str]:
    """The names of the constraints of a program."""
    return [c.name for c in formulation(form).constraints(preset_constraints(settings))]


def margin(forces, normals, friction):
    cosines = [-f @ n / np.linalg.norm(f) for f, n in zip(forces, normals, strict=True)]
    return np.array(cosines) - np.cos(np.arctan(friction))


def distance(points) -> np.ndarray:
    """μ/|∇μ| at points, the slope rounded at 0."""
    gpis = posed(HEAVY).gpis
    return np.array([gpis.mean(z[None])[0] / np.sqrt((gpis.gradient(z[None]) ** 2).sum() + 1e-6) for z in points])


def spheres(centres) -> list[tuple[np.ndarray, float]]:
    """Centre and radius of every sphere that is no pad."""
    radii = [sphere.radius for sphere in hand().spheres]
    return [pair for i, pair in enumerate(zip(centres, radii, strict=True)) if i not in hand().tip_spheres]


def touching(g: Grasp) -> tuple[np.ndarray, np.ndarray]:
    """Tips and centres of the spheres at first contact, by numeric Pinocchio."""
    wrist = pin.SE3ToXYZQUAT(pin.SE3(g.wrist_rotation, g.wrist_position))
    return frames(hand(), wrist, g.joints_contact)


def gaps(g: Grasp) -> np.ndarray:
    """The distances of the pads' nearest points, a radius down the normal from their centres."""
    return distance(feet(g))


def turning_stiffness(g: Grasp) -> float:
    """ρ by a determinant: of λ I - S, S = Σ k (o - ō) (R (p - p̄))ᵀ and the load's part, λ = tr S, over λ²."""
    k, o, p, com = g.gains, g.targets, g.contacts, posed(HEAVY).com
    middle = (k @ p) / k.sum()
    S = sum(a * np.outer(b - (k @ o) / k.sum(), g.rotation @ (c - middle)) for a, b, c in zip(k, o, p, strict=True))
    S = S - 0.2 * GRAVITY * np.outer([0, 0, 1], g.rotation @ (com - middle))
    return float(np.linalg.det(np.trace(S) * np.eye(3) - S) / np.trace(S) ** 2)


def pair_clearances(centres) -> list[float]:
    balls = list(zip(centres, [sphere.radius for sphere in hand().spheres], strict=True))
    return [np.sqrt(((balls[i][0] - balls[j][0]) ** 2).sum()) - balls[i][1] - balls[j][1] for i, j in hand().pairs]


def feet(g: Grasp) -> np.ndarray:
    """The contact points, a radius down the normal from the pads' centres."""
    slopes = posed(HEAVY).gpis.gradient(g.contacts)
    return np.array([p - PAD * s / np.linalg.norm(s) for p, s in zip(g.contacts, slopes, strict=True)])


def union(points, shapes) -> np.ndarray:
    """The distance of each point to the nearest of the shapes."""
    return np.array([min(float(shape.distance(z[None])[0]) for shape in shapes) for z in points])


def apart(centres, table: bool = False) -> np.ndarray:
    """How far every sphere is from the obstacles, or from them and the table."""
    radii = np.array([sphere.radius for sphere in hand().spheres])
    gaps = union(centres, CROWD.obstacles)
    return (np.minimum(gaps, centres[:, 2]) if table else gaps) - radii


def retreated(g: Grasp, back: float) -> np.ndarray:
    """The spheres of a hand drawn back against the direction that its palm looks in, the root's +x."""
    return np.array([centre - back * g.wrist_rotation[:, 0] for centre in g.spheres])


ARM = load_arm("ur5")


def arm_frame(q, link: str) -> pin.SE3:
    """The pose of an arm's link in the world."""
    data = ARM.model.createData()
    pin.framesForwardKinematics(ARM.model, data, np.asarray(q, float))
    return pin.XYZQUATToSE3(ARM.base) * data.oMf[ARM.model.getFrameId(link)]


def arm_balls(q) -> list[tuple[str, np.ndarray, float]]:
    """Link, centre and radius of every sphere of the arm."""
    return [(s.link, arm_frame(q, s.link).act(np.array(s.centre)), s.radius) for s in ARM.spheres]


def arm_postures(g: Grasp) -> tuple:
    return g.arm.joints, g.arm.standoff, g.arm.lift


def arm_apart(q) -> np.ndarray:
    """How far the spheres of the links beyond the second joint are from obstacles, table and the object's box."""
    box = upright_box(observation().points, 0.0, "object")
    moving = [ball for ball in arm_balls(q) if ball[0] not in ("base_link", "shoulder_link")]
    return np.array([min(union([z], (*CROWD.obstacles, box))[0], z[2]) - radius for _, z, radius in moving])


def arm_pairs(g: Grasp) -> list[float]:
    balls = arm_balls(g.arm.joints)
    return [np.linalg.norm(balls[i][1] - balls[j][1]) - balls[i][2] - balls[j][2] for i, j in ARM.pairs]


def arm_palm(g: Grasp) -> list[float]:
    """The spheres of the upper arm, the forearm and the first link of its wrist from those of the palm."""
    far = [b for b in arm_balls(g.arm.joints) if b[0] in ("upper_arm_link", "forearm_link", "wrist_1_link")]
    palm = [(z, s.radius) for z, s in zip(g.spheres, hand().spheres, strict=True) if s.link == hand().root]
    return [np.linalg.norm(y - z) - r - radius for z, radius in palm for _, y, r in far]


def off_the_way(g: Grasp, q, by) -> np.ndarray:
    """Place and turn of the hand's root link on the arm, off the wrist moved; a turn of 1 rad counts as 10 cm."""
    found = arm_frame(q, ARM.flange) * pin.XYZQUATToSE3(ARM.mount)
    turn = Rotation.from_matrix(found.rotation @ g.wrist_rotation.T).as_rotvec()
    return np.concatenate([found.translation - g.wrist_position - by, 0.1 * turn])


def stretched(q) -> float:
    """The volume of the ellipsoid of twists, by differences of the pose."""
    mount = pin.XYZQUATToSE3(ARM.mount)
    here, columns = arm_frame(q, ARM.flange) * mount, []
    for e in np.eye(6):
        there = [arm_frame(q + sign * 1e-5 * e, ARM.flange) * mount for sign in (1, -1)]
        turns = [Rotation.from_matrix(pose.rotation @ here.rotation.T).as_rotvec() for pose in there]
        columns.append(np.concatenate([there[0].translation - there[1].translation, turns[0] - turns[1]]) / 2e-5)
    return float(abs(np.linalg.det(np.array(columns))))


def deviations(g: Grasp) -> np.ndarray:
    """σ/|∇μ| at the contacts."""
    gpis = posed(HEAVY).gpis
    return gpis.deviation(g.contacts) / np.sqrt((gpis.gradient(g.contacts) ** 2).sum(axis=1) + 1e-6)


def from_centre(g: Grasp) -> np.ndarray:
    """The contacts at equilibrium from the centre of mass there: the object turns rigidly."""
    return (g.contacts - posed(HEAVY).com) @ g.rotation.T


def centre_eq(g: Grasp) -> np.ndarray:
    """The centre of mass at equilibrium, by the balance of springs and weight: Σ k (o - p_eq) = M g e_z."""
    pulled = (g.gains[:, None] * (g.targets - from_centre(g))).sum(axis=0) - [0, 0, 0.2 * GRAVITY]
    return pulled / g.gains.sum()


FORMULAS = {
    "stiffness": turning_stiffness,
    "rotation": lambda g: np.trace(g.rotation),
    "workspace": lambda g: posed(HEAVY).gpis.radius - np.linalg.norm(g.tips - posed(HEAVY).gpis.centre, axis=1),
    "contact": gaps,
    "margin_initial": lambda g: margin(g.forces, g.normals, g.friction),
    "margin_equilibrium": lambda g: margin(g.forces_eq, g.normals @ g.rotation.T, g.friction),
    "force": lambda g: np.sqrt((g.forces_eq**2).sum(axis=1)),
    "shift": lambda g: np.linalg.norm(g.contacts_eq - g.contacts, axis=1),
    "object": lambda g: [distance([centre])[0] - radius for centre, radius in spheres(g.spheres)],
    "pads_object": lambda g: distance(g.tips) - PAD,
    "table": lambda g: [centre[2] - radius for centre, radius in spheres(g.spheres)],
    "pads_table": lambda g: g.tips[:, 2] - PAD,
    "self": lambda g: pair_clearances(g.spheres),
    "reach": lambda g: touching(g)[0] - g.contacts,
    "object_contact": lambda g: [distance([centre])[0] - radius for centre, radius in spheres(touching(g)[1])],
    "table_contact": lambda g: [centre[2] - radius for centre, radius in spheres(touching(g)[1])],
    "self_contact": lambda g: pair_clearances(touching(g)[1]),
    "contact_table": lambda g: g.contacts[:, 2] - PAD,
    "equilibrium_table": lambda g: (from_centre(g) + centre_eq(g))[:, 2] - PAD,
    "sag": lambda g: g.gains.sum(),
    "torque_initial": lambda g: g.torques / 0.7,
    "torque_equilibrium": lambda g: g.torques_eq / 0.7,
    "cone": lambda g: margin(g.forces, g.normals, g.friction),
    "press": lambda g: [-k * (o - p) @ n for k, o, p, n in zip(g.gains, g.targets, g.contacts, g.normals, strict=True)],
    "force_initial": lambda g: np.sqrt((g.forces**2).sum(axis=1)),
    "net_force": lambda g: (g.gains[:, None] * (g.targets - g.contacts)).sum(axis=0) - [0, 0, 0.2 * GRAVITY],
    "net_torque": lambda g: sum(np.cross(p - posed(HEAVY).com, f) for p, f in zip(g.contacts, g.forces, strict=True)),
    "tip": lambda g: np.zeros((4, 3)),
    "balance_force": lambda g: (g.gains[:, None] * (g.targets - g.contacts_eq)).sum(axis=0) - [0, 0, 0.2 * GRAVITY],
    "balance_torque": lambda g: sum(np.cross(p, f) for p, f in zip(from_centre(g), g.forces_eq, strict=True)),
    "gains": lambda g: g.gains * deviations(g),
    "obstacles": lambda g: np.min(
        [apart(g.spheres), *(apart(retreated(g, l), True) for l in (0.025, 0.05, 0.075, 0.1))], axis=0
    ),
    "obstacles_contact": lambda g: np.minimum(apart(touching(g)[1]), apart(touching(g)[1] + [0, 0, 0.1], True)),
    "arm": lambda g: np.min([arm_apart(q) for q in arm_postures(g)], axis=0),
    "arm_self": lambda g: arm_pairs(g),
    "arm_hand": lambda g: arm_palm(g),
    "wrist": lambda g: off_the_way(g, g.arm.joints, np.zeros(3)),
    "standoff": lambda g: off_the_way(g, g.arm.standoff, -0.1 * g.wrist_rotation[:, 0]),
    "lift": lambda g: off_the_way(g, g.arm.lift, np.array([0, 0, 0.1])),
    "arm_turn": lambda g: np.concatenate([g.arm.standoff - g.arm.joints, g.arm.lift - g.arm.joints]),
    "dexterity": lambda g: np.log(stretched(g.arm.joints) / stretched(ARM.home)),
    "avoid": lambda g: union(feet(g), CROWD.avoid),
    "touch": lambda g: union(feet(g), CROWD.touch),
}


@pytest.fixture
def g() -> Grasp:
    problem = posed(PLANNED, CROWD, "ur5")
    at = pregrasp(problem, *random_point(problem, unbuilt(problem), 0))
    bent = np.clip(at.joints + 0.2, hand().lower, hand().upper)
    arm = ARM.home + np.random.default_rng(1).uniform(-0.3, 0.3, (3, 6))
    return recompute(problem, replace(at, joints_contact=bent, arm=arm))[0]


@pytest.mark.parametrize("name", NAMES)
def test_the_rows_of_a_constraint_are_those_of_its_equation(g, name):
    rounding = 1e-11 if name.startswith("balance_") else 0.0  # [N, N m]: both sides are 0
    digits = 1e-6 if name == "dexterity" else 1e-10  # differences of poses
    np.testing.assert_allclose(rows(name, g), np.atleast_1d(FORMULAS[name](g)), rtol=digits, atol=rounding)


CENTIMETRES = (
    *("workspace", "contact", "shift", "object", "pads_object", "table", "pads_table", "self"),
    *("contact_table", "equilibrium_table", "reach", "object_contact", "table_contact", "self_contact"),
    *("obstacles", "obstacles_contact", "avoid", "touch", "arm", "arm_self", "arm_hand", "wrist", "standoff", "lift"),
)
ONES = {
    **dict.fromkeys(CENTIMETRES, 0.01),
    **dict.fromkeys(("dexterity", "arm_turn", "rotation", "margin_initial", "margin_equilibrium", "cone"), 1.0),
    **dict.fromkeys(("force", "press", "force_initial", "net_force", "gains"), 1.0),
    **dict.fromkeys(("torque_initial", "torque_equilibrium"), 1.0),
    "stiffness": 0.01,
    "sag": 100.0,
    "net_torque": 0.1,
}
"""What a row of 1 is: 1 cm, 1, 1 N, the effort, 0.01 N m of stiffness, 100 N/m of gain, 0.1 N m."""


@pytest.mark.parametrize(
    ("settings", "around"), [(HEAVY, CROWD), (CLOSURE, NOWHERE)], ids=["spring among obstacles", "closure"]
)
def test_the_solver_sees_every_row_in_its_unit(settings, around):
    functions, problem = oracle(settings, "constrained", around), posed(settings, around)
    start, x = random_point(problem, functions.nlp, 0)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    g = exact_grasp(problem, start, x)
    expected = [np.ravel(FORMULAS[c.name](g)) / ONES[c.name] for c in functions.nlp.constraints]
    found = np.split(functions.values(x, p), np.cumsum(functions.nlp.row_sizes)[:-1])
    for c, ours, theirs in zip(functions.nlp.constraints, expected, found, strict=True):
        rounding = 0.4 if c.over == "sphere" or c.name in ("avoid", "touch") else 1e-3  # [cm] of edges, [1] of norms
        np.testing.assert_allclose(theirs, ours, rtol=1e-3, atol=rounding, err_msg=c.name)
    assert {c.name for c in functions.nlp.constraints} <= set(ONES)


def turned(angle_deg: float) -> np.ndarray:
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def clear_by(pregrasp: float, approach: float) -> dict[str, np.ndarray]:
    """Clearances of 45 spheres from obstacles, one of them at the second posture of the approach so large."""
    way = np.full(180, 0.1)
    way[70] = approach
    return {"obstacle_clearances": np.full(45, pregrasp), "obstacle_clearances_approach": way}


BAD = {  # what makes a grasp violate each constraint, and what does not
    "stiffness": ({"stiffness": 1e-3}, {"stiffness": 0.1}),
    "rotation": ({"rotation": turned(SMALL.limits.rotation_deg + 1)}, {"rotation": turned(9)}),
    "workspace": ({"ball_clearances": np.array([0.1, -1e-3, 0.1, 0.1])}, {"ball_clearances": np.full(4, 1e-3)}),
    "contact": ({"gaps": np.array([0, 0, 1e-4, 0])}, {"gaps": np.zeros(4)}),
    "force": ({"forces_eq": np.full((4, 3), 1.0)}, {"forces_eq": np.full((4, 3), 3.0)}),
    "object": ({"object_clearances": np.array([0.1, -1e-4])}, {"object_clearances": np.array([0.1, 1e-4])}),
    "pads_object": ({"pad_clearances": np.array([0.1, -1e-4])}, {"pad_clearances": np.array([0.1, 1e-4])}),
    "table": ({"table_clearances": np.array([0.1, 0.0])}, {"table_clearances": np.array([0.1, 0.05])}),
    "pads_table": ({"pad_heights": np.array([0.1, -1e-3])}, {"pad_heights": np.array([0.1, 0.05])}),
    "self": ({"pair_clearances": np.array([0.1, -1e-4])}, {"pair_clearances": np.array([0.1, 1e-4])}),
    "contact_table": ({"contact_heights": np.array([-1e-4])}, {"contact_heights": np.array([1e-4])}),
    "equilibrium_table": ({"contact_heights_eq": np.array([-1e-4])}, {"contact_heights_eq": np.array([1e-4])}),
    "reach": ({"reach_errors": np.eye(4, 3) * 1e-4}, {"reach_errors": np.zeros((4, 3))}),
    "object_contact": (
        {"object_clearances_contact": np.array([0.1, 1.9e-3])},
        {"object_clearances_contact": np.array([0.1, 2.1e-3])},
    ),
    "table_contact": (
        {"table_clearances_contact": np.array([0.1, 1.9e-3])},
        {"table_clearances_contact": np.array([0.1, 2.1e-3])},
    ),
    "self_contact": (
        {"pair_clearances_contact": np.array([0.1, -1e-4])},
        {"pair_clearances_contact": np.array([0.1, 1e-4])},
    ),
    "obstacles": (clear_by(0.1, 11.9e-3), clear_by(0.1, 12.1e-3)),
    "obstacles_contact": (
        {"obstacle_clearances_contact": np.full(45, 0.1), "obstacle_clearances_lift": np.full(45, 11.9e-3)},
        {"obstacle_clearances_contact": np.full(45, 0.1), "obstacle_clearances_lift": np.full(45, 12.1e-3)},
    ),
    "avoid": ({"avoid_distances": np.array([0.1, 2.9e-3])}, {"avoid_distances": np.array([0.1, 3.1e-3])}),
    "touch": ({"touch_distances": np.array([-0.1, -2.9e-3])}, {"touch_distances": np.array([-0.1, -3.1e-3])}),
    "sag": ({"gains": np.full(4, 40.0)}, {"gains": np.full(4, 60.0)}),  # 0.2 kg over 1 cm: 196 N/m
    "tip": ({"tip_errors": np.eye(4, 3) * 1e-4}, {"tip_errors": np.zeros((4, 3))}),
    "balance_force": ({"wrench_eq": np.array([[0, 0, 1e-3], [0, 0, 0]])}, {"wrench_eq": np.zeros((2, 3))}),
    "balance_torque": ({"wrench_eq": np.array([[0, 0, 0], [0, -1e-3, 0]])}, {"wrench_eq": np.zeros((2, 3))}),
    "torque_initial": ({"torques": np.eye(16)[3] * -0.72}, {"torques": np.eye(16)[3] * -0.68}),
    "torque_equilibrium": ({"torques_eq": np.eye(16)[9] * 0.72}, {"torques_eq": np.eye(16)[9] * 0.68}),
    "force_initial": ({"forces": np.full((4, 3), 7.0)}, {"forces": np.full((4, 3), 3.0)}),
    "net_force": ({"wrench": np.array([[0, 1e-4, 0], [0, 0, 0]])}, {"wrench": np.zeros((2, 3))}),
    "net_torque": ({"wrench": np.array([[0, 0, 0], [0, 1e-4, 0]])}, {"wrench": np.zeros((2, 3))}),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_grasp_violates_its_bound_and_a_good_one_does_not(g, name):
    bad, good = BAD[name]
    assert violated(name, replace(g, **bad))
    assert not violated(name, replace(g, **good))


@pytest.mark.parametrize("state", ["initial", "equilibrium"])
def test_pulling_violates_the_margins_and_pressing_does_not(g, state):
    suffix = "" if state == "initial" else "_eq"
    normals = getattr(g, f"normals{suffix}")
    assert violated(f"margin_{state}", replace(g, **{f"forces{suffix}": 5 * normals}))
    assert not violated(f"margin_{state}", replace(g, **{f"forces{suffix}": -5 * normals}))


def test_too_much_force_and_too_much_shift_violate_their_upper_bounds(g):
    assert violated("force", replace(g, forces_eq=np.full((4, 3), 7.0)))
    assert violated("shift", replace(g, contacts_eq=g.contacts + np.array([0, 0, 0.011])))
    assert not violated("shift", replace(g, contacts_eq=g.contacts + np.array([0, 0, 0.009])))


def test_the_sag_bound_keeps_the_weight_from_moving_the_object_farther_than_the_shift():
    sag = bound("sag", HEAVY)
    assert 0.2 * GRAVITY / sag.lower == pytest.approx(HEAVY.limits.shift)
    assert bound("shift", HEAVY).upper == HEAVY.limits.shift
    assert sag.upper == inf
    assert bound("sag", SMALL).lower == 0.0


def test_a_heavy_object_may_move_farther_in_proportion_to_its_weight():
    limits = replace(HEAVY.limits, shift=0.003, give=0.001)
    settings = replace(HEAVY, limits=limits, contact=replace(HEAVY.contact, mass=1.0))
    assert bound("shift", settings).upper == pytest.approx(0.001 * GRAVITY)
    assert bound("sag", settings).lower == pytest.approx(1000.0)
    light = replace(settings, contact=replace(settings.contact, mass=0.2))
    assert bound("shift", light).upper == 0.003


def test_the_penalty_formulation_keeps_only_what_makes_it_well_posed():
    assert names(HEAVY, "penalty") == ["stiffness", "rotation", "workspace"]
    assert names(replace(HEAVY, contact=replace(CLOSURE.contact, heuristic=0.0)), "penalty") == [
        "workspace",
        "cone",
        "press",
    ]
    assert names(PLANNED, "penalty") == names(HEAVY, "penalty")
    assert len(ALL) == len(CONSTRAINTS) + len(EQUATIONS)


def test_a_metric_has_its_own_constraints_and_those_of_every_grasp():
    free = replace(SMALL, contact=replace(SMALL.contact, metric="closure"))
    spring, closure = (set(names(settings, "constrained")) for settings in (SMALL, free))
    assert {"contact", "object", "table", "self", "workspace"} <= spring & closure
    assert closure - spring == {"cone", "press", "force_initial", "net_force", "net_torque"}
    assert {"stiffness", "rotation", "margin_equilibrium", "force", "shift", "sag"} <= spring - closure
    dictated = replace(free, contact=replace(free.contact, heuristic=1.6))
    for form in ("penalty", "constrained"):
        assert set(names(dictated, form)) - set(names(free, form)) == {"gains"}
    assert set(names(HEAVY, "constrained")) - spring == {"torque_initial", "torque_equilibrium"}
    reaching = {"reach", "object_contact", "table_contact", "self_contact"}
    assert set(names(PLANNED, "constrained")) - set(names(HEAVY, "constrained")) == reaching
    assert set(names(HEAVY, "lifted")) - set(names(HEAVY, "constrained")) == {c.name for c in EQUATIONS}


def test_the_gains_of_the_heuristic_are_inverse_to_the_deviations(g):
    assert not violated("gains", replace(g, gains=1.6 / np.full(4, 0.02), contact_deviations=np.full(4, 0.02)), CLOSURE)
    assert violated("gains", replace(g, gains=np.full(4, 90.0), contact_deviations=np.full(4, 0.02)), CLOSURE)


def test_forces_that_hardly_press_violate_the_least_normal_force_whatever_their_size(g):
    across = np.cross(g.normals, [0.0, 0.0, 1.0])
    assert violated("press", replace(g, forces=9 * across - 3.9 * g.normals))
    assert not violated("press", replace(g, forces=9 * across - 4.1 * g.normals))


def test_without_a_pregrasp_the_pads_need_no_clearance_from_the_object(g):
    near = replace(g, pad_clearances=np.full(4, -2e-3))
    assert violated("pads_object", near)
    assert not violated("pads_object", near, replace(HEAVY, contact=replace(HEAVY.contact, c=1.0)))


def test_the_error_of_the_place_and_the_margin_add_up_to_the_gap():
    limits = replace(PLANNED.limits, object_margin=0.003, place_error=0.005)
    wide = replace(PLANNED, limits=limits)
    for name in ("object", "pads_object"):
        assert bound(name, wide).lower == pytest.approx(0.008)
    assert bound("object_contact", wide).lower == PLANNED.closing.margin


def test_shift_and_rotation_are_bounded_about_the_desired_pose():
    g, limit = random_grasp(MOVED, 0), MOVED.limits.rotation_deg
    there = replace(g, contacts_eq=g.contacts_desired, rotation=g.rotation_desired)
    assert not violated("shift", there, MOVED)
    assert not violated("rotation", there, MOVED)
    assert violated("shift", replace(there, contacts_eq=g.contacts), MOVED)
    assert violated("rotation", replace(there, rotation=np.eye(3)), MOVED)
    assert np.degrees(rotation_angle(g.rotation_desired)) > limit
    assert not violated("rotation", replace(there, rotation=turned(limit - 1) @ g.rotation_desired), MOVED)
    assert violated("rotation", replace(there, rotation=turned(limit + 1) @ g.rotation_desired), MOVED)


@pytest.mark.parametrize("settings", [HEAVY, CLOSURE], ids=["spring", "closure"])
@pytest.mark.parametrize("formulation", ["penalty", "constrained"])
def test_the_bounds_of_the_rows_are_those_of_the_settings_in_scaled_units(formulation, settings):
    nlp, problem = oracle(settings, formulation).nlp, posed(settings)
    low, high = problem.row_bounds(nlp)
    assert len(low) == len(high) == sum(nlp.row_sizes)
    start = 0
    for constraint, size in zip(nlp.constraints, nlp.row_sizes, strict=True):
        own = bound(constraint.name, settings)
        np.testing.assert_allclose(low[start : start + size] * constraint.scale, own.lower)
        np.testing.assert_allclose(high[start : start + size] * constraint.scale, own.upper)
        start += size


@pytest.mark.parametrize("settings", PRESETS.values(), ids=PRESETS)
def test_every_constraint_of_a_preset_bounds_something_and_says_what_and_how_exactly(settings):
    for constraint in preset_constraints(settings):
        touching = constraint.name == "pads_object" and settings.contact.c == 1
        assert constraint.bounded is not touching, constraint.name
        assert constraint.about, constraint.name
        assert 0 < constraint.tolerance <= 1.0, constraint.name


def test_every_built_in_constraint_pickles_and_has_a_key_of_its_own():
    assert pickle.loads(pickle.dumps(ALL)) == ALL
    base = posed(HEAVY).structure(formulation("penalty"))
    swapped = replace(ALL["contact"], value=ALL["reach"].value)
    assert len({replace(base, constraints=(c,)).key for c in (*ALL.values(), swapped)}) == len(ALL) + 1


def test_the_numbers_of_numpy_are_plain_ones_in_a_constraint():
    made = Constraint(
        "level", ALL["contact"].value, upper=np.array(1.0), lower=np.float32(0.5), always=np.bool_(True), unit=""
    )
    assert (made.upper, made.lower, made.always) == (1.0, 0.5, True)
    assert {type(made.upper), type(made.lower), type(made.always)} == {float, bool}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"lower": "0"}, "lower of constraint 'own' must be a number, not '0'"),
        ({"upper": np.zeros((2, 3))}, r"upper of constraint 'own' must be a number, not \(\(0"),
        ({"lower": None, "upper": None}, "lower of constraint 'own' must be a number, not None"),
        ({"lower": True}, "lower of constraint 'own' must be a number, not True"),
        ({"unit": "mm"}, "constraint 'own' has the unit 'mm': its bounds are in SI units"),
        ({"unit": None}, "unit of constraint 'own' must be of Unit or a text, not None"),
        ({"value": 3}, "value of constraint 'own' must be a function, not 3"),
        ({"tolerance": "1e-3"}, "tolerance of constraint 'own' must be a number or None"),
        ({"tolerance": -1.0}, "tolerance of constraint 'own' must be at least 0, not -1"),
        ({"lower": 2, "upper": np.float64(1)}, "has the bounds 2 to 1"),
    ],
)
def test_a_constraint_with_a_field_of_another_kind_is_refused_where_it_is_made(given, said):
    with pytest.raises(InputError, match=said) as error:
        Constraint("own", **{"value": ALL["contact"].value, "lower": 0} | given)
    assert "\n" not in str(error.value)


def test_each_limit_moves_a_bound():
    fixed = {"gain_min", "gain_max", "gain_fixed", "wrist_travel"}  # bounds of variables
    fixed |= {"place_error_tight"}  # takes the place of `place_error` where a wide gap is hard to keep
    for name, limit in vars(HEAVY.limits).items():
        if name not in fixed:
            other = replace(HEAVY, limits=Limits(**vars(HEAVY.limits) | {name: limit + 0.01}))
            both = [preset_constraints(s, CROWD.around(s, True)) for s in (HEAVY, other)]
            before, after = ([(c.lower, c.upper) for c in constraints] for constraints in both)
            assert before != after, name
