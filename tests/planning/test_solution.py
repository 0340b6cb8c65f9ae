"""Solutions: recomputed values, the conditions of feasibility one by one, and the ranking."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scenes import REACHING, SMALL, exact_grasp, oracle, posed, random_grasp, random_point, with_added, with_settings
from scipy.spatial.transform import Rotation

from sgnlp.base.errors import SgnlpError
from sgnlp.hand.kinematics import frames
from sgnlp.perception.shape import Shape
from sgnlp.planning.kkt import Kkt
from sgnlp.planning.plan import Plan
from sgnlp.planning.planner import History, Iterate
from sgnlp.planning.solution import Solution, feasibility, rank, solution
from sgnlp.planning.surroundings import Surroundings
from sgnlp.program.constraint import Constraint
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Exact
from sgnlp.program.terms.spring import margins
from sgnlp.program.variables import variable_units

CLEAR = np.full(3, 0.02)  # [m]
N = len(posed(SMALL).hand.joint_names)


def good(settings=SMALL) -> Grasp:
    """A grasp that passes every check."""
    hand, g = posed(SMALL).hand, random_grasp(settings, 0)
    return replace(
        g,
        joints=(hand.lower + hand.upper) / 2,
        joints_contact=(hand.lower + hand.upper) / 2,
        gaps=np.zeros(4),
        object_clearances=CLEAR,
        pad_clearances=CLEAR,
        table_clearances=CLEAR,
        pad_heights=CLEAR,
        pair_clearances=CLEAR,
        contact_heights=CLEAR,
        contact_heights_eq=CLEAR,
        contacts_eq=g.contacts_desired,
        rotation=g.rotation_desired,
        forces=-5.0 * g.normals,
        forces_eq=-5.0 * g.normals_eq,
        torques=np.zeros(N),
        torques_eq=np.zeros(N),
        stiffness=0.1,
        ball_clearances=CLEAR,
    )


def failed(g: Grasp, settings=SMALL) -> set[str]:
    return {check.name for check in feasibility(with_settings(posed(SMALL), settings), g) if not check.passed}


def one(value: float, rest: float = 0.02) -> np.ndarray:
    return np.array([rest, value, rest])


def beyond(limit: str, by: float) -> np.ndarray:
    """Joint angles in the middle of their ranges, one of them past a limit."""
    hand = posed(SMALL).hand
    joints = (hand.lower + hand.upper) / 2
    joints[3] = getattr(hand, limit)[3] + by
    return joints


def pressed(size: float) -> np.ndarray:
    """Forces along the inward normals, one of another size [N]."""
    return -np.array([5.0, 5.0, size, 5.0])[:, None] * random_grasp(SMALL, 0).normals_eq


def moved(size: float) -> np.ndarray:
    """Contacts that move by so much [m] on their way to the equilibrium."""
    return good().contacts + np.array([0.0, 0.0, size])


def turned(angle_deg: float) -> np.ndarray:
    return Rotation.from_euler("x", angle_deg, degrees=True).as_matrix()


LIMITS = SMALL.limits
VIOLATIONS = [  # check, field, a value just past its tolerance, one just inside
    ("contact", "gaps", np.array([0, 2.1e-3, 0, 0]), np.array([0, 1.9e-3, 0, 0])),
    ("contact", "gaps", np.array([0, -2.1e-3, 0, 0]), np.array([0, -1.9e-3, 0, 0])),
    ("object", "object_clearances", one(-1.1e-3), one(-0.9e-3)),
    ("pads_object", "pad_clearances", one(-1.1e-3), one(-0.9e-3)),
    ("table", "table_clearances", one(LIMITS.table_margin - 1.1e-3), one(LIMITS.table_margin - 0.9e-3)),
    ("pads_table", "pad_heights", one(LIMITS.pad_margin - 1.1e-3), one(LIMITS.pad_margin - 0.9e-3)),
    ("self", "pair_clearances", one(-1.1e-3), one(-0.9e-3)),
    ("contact_table", "contact_heights", one(-1.1e-3), one(-0.9e-3)),
    ("equilibrium_table", "contact_heights_eq", one(-1.1e-3), one(-0.9e-3)),
    ("joint_limits", "joints", beyond("upper", 1e-3), beyond("upper", -1e-3)),
    ("joint_limits", "joints", beyond("lower", -1e-3), beyond("lower", 1e-3)),
    ("force", "forces_eq", pressed(LIMITS.force_min - 0.21), pressed(LIMITS.force_min - 0.19)),
    ("force", "forces_eq", pressed(LIMITS.force_max + 0.21), pressed(LIMITS.force_max + 0.19)),
    ("stiffness", "stiffness", LIMITS.stiffness - 1.1e-4, LIMITS.stiffness - 0.9e-4),
    ("rotation", "rotation", turned(LIMITS.rotation_deg + 0.2), turned(LIMITS.rotation_deg + 0.1)),
    ("shift", "contacts_eq", moved(LIMITS.shift + 1.1e-3), moved(LIMITS.shift + 0.9e-3)),
    ("workspace", "ball_clearances", one(-2e-6), one(-0.5e-6)),
]


def test_a_good_grasp_passes_every_check():
    assert failed(good()) == set()


@pytest.mark.parametrize(("check", "field", "bad", "fine"), VIOLATIONS)
def test_each_constraint_fails_by_itself_and_only_past_its_tolerance(check, field, bad, fine):
    g = good() if field != "rotation" else replace(good(), normals_eq=good().normals)
    assert failed(replace(g, **{field: bad})) == {check}
    assert failed(replace(g, **{field: fine})) == set()


@pytest.mark.parametrize(("state", "least"), [("initial", 0.0), ("equilibrium", LIMITS.margin_equilibrium)])
def test_a_force_outside_its_cone_less_the_reserve_fails_in_either_state(state, least):
    suffix = "" if state == "initial" else "_eq"
    g = good()
    normals = getattr(g, f"normals{suffix}")
    across = np.cross(normals, [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    cone = 1 / np.sqrt(1 + SMALL.contact.friction**2)
    for margin, names in ((least - 1e-5, {f"margin_{state}"}), (least + 1e-5, set())):
        angle = np.arccos(margin + cone)
        forces = 5.0 * (-np.cos(angle) * normals + np.sin(angle) * across)
        assert failed(replace(g, **{f"forces{suffix}": forces})) == names


def test_an_equilibrium_that_is_not_strictly_stable_is_never_feasible():
    free = with_settings(posed(SMALL), SMALL)
    free = replace(free, constraints=tuple(c for c in free.constraints if c.name != "stiffness"))
    for stiffness, names in ((-0.1, {"stable"}), (0.0, {"stable"}), (1e-4, set())):
        checks = feasibility(free, replace(good(), stiffness=stiffness))
        assert {check.name for check in checks if not check.passed} == names


def test_every_constraint_of_a_plan_is_checked_and_a_users_own_too():
    own = Constraint("upright", lambda g, op: g.wrist_rotation[2, 0], upper=-2.0)
    problem = replace(posed(SMALL), constraints=(*posed(SMALL).constraints, own))
    checks = {check.name: check for check in feasibility(problem, good())}
    assert checks.keys() == {c.name for c in problem.constraints} | {"joint_limits", "stable"}
    assert not checks["upright"].passed
    assert checks["upright"].value == pytest.approx(good().wrist_rotation[2, 0])
    assert checks["contact"].row.startswith("contact[")


def test_without_a_pregrasp_the_pads_may_touch():
    touching = replace(good(), pad_clearances=np.full(4, -2e-3))
    assert failed(touching) == {"pads_object"}
    assert failed(touching, replace(SMALL, contact=replace(SMALL.contact, c=1.0))) == set()


def test_force_closure_is_judged_by_its_balance_and_its_normal_forces_at_first_contact_alone():
    closure = replace(SMALL, contact=replace(SMALL.contact, metric="closure"))
    g = good()
    balanced = replace(g, wrench=np.zeros((2, 3)), stiffness=-0.1, forces_eq=np.zeros((4, 3)))
    assert failed(balanced, closure) == set()
    assert failed(replace(balanced, forces=5.0 * g.normals), closure) == {"cone", "press"}
    light = replace(balanced, forces=-(LIMITS.force_min - 0.21) * g.normals)
    assert failed(light, closure) == {"press"}
    for i, wrench in enumerate(np.eye(6).reshape(6, 2, 3)):
        name = "net_force" if i < 3 else "net_torque"
        assert failed(replace(balanced, wrench=1.1e-3 * wrench), closure) == {name}, i
        assert failed(replace(balanced, wrench=0.9e-3 * wrench), closure) == set()


def test_joint_torques_are_judged_where_they_are_limited_in_both_states():
    limited = replace(SMALL, limits=replace(SMALL.limits, effort=1.0))
    strained = replace(good(), torques_eq=0.71 * np.eye(N)[5])
    assert failed(strained) == set()
    assert failed(strained, limited) == {"torque_equilibrium"}
    assert failed(replace(strained, torques_eq=-0.69 * np.eye(N)[5]), limited) == set()
    closure = replace(limited, contact=replace(SMALL.contact, metric="closure"))
    assert "torque_equilibrium" not in failed(strained, closure)
    assert "torque_initial" in failed(replace(strained, torques=strained.torques_eq), closure)


def test_what_is_not_a_number_is_not_feasible():
    for gaps in (np.full(4, np.nan), np.array([0.0, np.nan, 0.0, 1e-3])):
        assert failed(replace(good(), gaps=gaps)) == {"contact"}


def test_a_hand_without_self_collision_pairs_passes_that_check():
    assert failed(replace(good(), pair_clearances=np.zeros(0))) == set()


def test_a_check_says_what_was_demanded_in_the_unit_of_tables():
    checks = {check.name: check.demand for check in feasibility(posed(SMALL), good())}
    assert checks["contact"] == "0 ± 2 mm"
    assert checks["force"] == f"{LIMITS.force_min:g} to {LIMITS.force_max:g} N"
    assert checks["shift"] == "≤ 10 mm"
    assert checks["stiffness"] == "≥ 5 mN m"
    assert checks["rotation"] == "0 to 10 deg"
    assert checks["margin_equilibrium"] == "≥ 0.05"


# --- recomputed values ----------------------------------------------------------------------------------------------


def made(seed: int = 0, **changes: object) -> tuple[Solution, Grasp]:
    """The solution of an iterate at a random point, and the grasp there; `changes` are of the problem."""
    problem, nlp = replace(posed(SMALL), **changes), oracle(SMALL, "penalty").nlp
    start, x = random_point(problem, nlp, seed)
    history = History(*[np.zeros(8)] * 5)
    iterate = Iterate(
        start.index, "penalty", x, np.zeros(0), 1e9, Kkt(0.1, 0.2, 0.3), "Solve_Succeeded", 7, 0.5, history
    )
    return solution(problem, start, iterate, nlp), exact_grasp(problem, start, x)


def test_a_solution_knows_what_its_problem_was_to_stay_clear_of_and_how_it_gets_there():
    crate = Shape.box([1.0, 0.0, 0.1], [0.1, 0.1, 0.2], name="crate")
    settings = replace(SMALL, motion=replace(SMALL.motion, standoff=0.07), closing=replace(SMALL.closing, seconds=1.7))
    s, _ = made(surroundings=Surroundings((crate,)), settings=settings)
    assert (s.obstacles, s.motion.standoff, s.closing.seconds) == ((crate,), 0.07, 1.7)


def test_a_solution_is_recomputed_and_not_believed():
    s, g = made()
    exact = np.array([term.value(g, Exact()) for term in posed(SMALL).terms])
    np.testing.assert_allclose(s.energy_terms, exact, rtol=1e-12)
    assert s.energy == pytest.approx(posed(SMALL).weights() @ exact)
    np.testing.assert_allclose(s.margins_initial, margins(g.forces, g.normals, g.friction, Exact()))
    np.testing.assert_allclose(s.margins_equilibrium, margins(g.forces_eq, g.normals_eq, g.friction, Exact()))
    assert s.worst_margin == min(*s.margins_initial, *s.margins_equilibrium)
    assert not s.feasible  # whatever the status says
    assert s.violated == tuple(c.name for c in s.checks if not c.passed) != ()
    assert (s.status, s.iterations, s.kkt.worst) == ("Solve_Succeeded", 7, 0.3)


def test_the_contact_points_lie_a_pad_radius_below_the_centres():
    s, g = made()
    np.testing.assert_allclose(np.linalg.norm(s.contact_points - g.contacts, axis=1), 0.012, rtol=1e-4)
    assert ((g.contacts - s.contact_points) * g.normals).sum(axis=1).min() > 0


def test_the_pose_of_a_solution_moves_contacts_to_the_equilibrium():
    s, g = made(3)
    np.testing.assert_allclose(g.contacts @ s.grasp.rotation.T + s.translation_eq, g.contacts_eq, atol=1e-12)


# --- the hand at first contact ---------------------------------------------------------------------------------------


def touched(seed: int = 0) -> tuple[Solution, Grasp]:
    """The solution of a constrained iterate with the hand at first contact planned, and the grasp there."""
    problem, functions = posed(REACHING), oracle(REACHING, "constrained")
    start, x = random_point(problem, functions.nlp, seed)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    x = with_added(functions, x, p, problem.row_bounds(functions.nlp))
    x[len(variable_units(problem.hand)) :] += 0.03
    ended = Iterate(0, "constrained", x, p, 1e9, Kkt(0, 0, 0), "", 7, 0.5, History(*[np.zeros(8)] * 5))
    return solution(problem, start, ended, functions.nlp), exact_grasp(problem, start, x)


def test_planned_joints_at_contact_and_c_are_those_of_the_variables():
    s, g = touched()
    np.testing.assert_array_equal(s.joints_contact, g.joints_contact)
    np.testing.assert_allclose(g.contacts - g.targets, s.c[:, None] * (g.tips - g.targets), atol=1e-15)
    np.testing.assert_allclose(s.c, REACHING.contact.c + 0.03)
    np.testing.assert_allclose(s.clearances_contact, g.object_clearances_contact, atol=1e-12)


def test_unplanned_joints_at_contact_are_those_that_reach_the_contacts():
    s, g = made()
    tips, spheres = frames(posed(SMALL).hand, s.wrist, s.joints_contact)
    far = np.linalg.norm(tips - g.contacts, axis=1)
    assert far.max() < np.linalg.norm(g.tips - g.contacts, axis=1).max()
    links = np.delete(spheres, posed(SMALL).hand.tip_spheres, axis=0)
    radii = np.delete(g.radii, posed(SMALL).hand.tip_spheres)
    np.testing.assert_allclose(s.clearances_contact, posed(SMALL).gpis.distance(links) - radii)


@pytest.mark.parametrize("solved", [made, touched])
def test_the_squeeze_is_as_far_as_the_torques_at_equilibrium_over_the_stiffness_of_a_joint(solved):
    s, g = solved()
    hand, step = posed(SMALL).hand, 1e-6
    slopes = [
        (frames(hand, s.wrist, s.joints_contact + e)[0] - frames(hand, s.wrist, s.joints_contact - e)[0]) / (2 * step)
        for e in step * np.eye(N)
    ]
    torques = np.array([(slope * g.forces_eq).sum() for slope in slopes])
    np.testing.assert_allclose(s.joints_squeeze - s.joints_contact, torques / SMALL.closing.joint_stiffness, atol=1e-7)


def test_the_joint_limits_hold_at_first_contact_too():
    assert failed(replace(good(), joints_contact=beyond("upper", 1e-3))) == {"joint_limits"}


def test_a_link_that_meets_the_object_on_the_way_to_the_contacts_fails_that_check():
    problem, (s, g) = posed(REACHING), touched()
    links = [i for i in range(len(g.radii)) if i not in problem.hand.tip_spheres]
    way = next(check for check in s.checks if check.name == "way")
    shares = np.arange(1, 6) / 6
    worst = min(
        min(
            float(problem.gpis.distance(centre[None])[0] - radius),
            float(centre[2] - radius - problem.table_height),
        )
        for share in shares
        for centre, radius in zip(
            frames(problem.hand, s.wrist, g.joints + share * (g.joints_contact - g.joints))[1][links],
            g.radii[links],
            strict=True,
        )
    )
    assert way.value == pytest.approx(1e3 * worst)
    assert way.passed == (worst >= -1e-3)


# --- ranking ---------------------------------------------------------------------------------------------------------


def candidate(start: int, feasible: bool, margin: float, energy: float, stiffness: float) -> SimpleNamespace:
    values = {"worst_margin": margin, "margins_initial": np.array([0.9 - margin, 0.9]), "energy": energy}
    return SimpleNamespace(start=start, feasible=feasible, grasp=SimpleNamespace(stiffness=stiffness), **values)


CANDIDATES = [
    candidate(0, False, 0.9, -99.0, 9.0),
    candidate(1, True, 0.1, 5.0, 0.3),
    candidate(2, True, 0.3, 7.0, 0.1),
    candidate(3, True, 0.2, -5.0, 0.2),
    candidate(4, False, -0.1, -100.0, 1.0),
]


@pytest.mark.parametrize(
    ("key", "order"),
    [
        ("margin", [2, 3, 1, 0, 4]),
        ("margin_initial", [1, 3, 2, 4, 0]),
        ("energy", [3, 1, 2, 4, 0]),
        ("stiffness", [1, 3, 2, 0, 4]),
    ],
)
def test_feasible_solutions_come_first_each_group_best_first(key, order):
    assert [s.start for s in rank(CANDIDATES, key)] == order
    assert [s.start for s in rank(CANDIDATES[::-1], key)] == order


def test_ties_go_to_the_earlier_start():
    tied = [candidate(i, True, 0.1, 0.0, 0.1) for i in (2, 0, 1)]
    assert [s.start for s in rank(tied, "margin")] == [0, 1, 2]


def plan(*solutions: SimpleNamespace) -> Plan:
    made = object.__new__(Plan)  # of stand-ins for solutions, which a plan itself refuses
    vars(made)["solutions"] = solutions
    return made


def test_the_best_is_the_first_feasible_solution_or_none():
    assert plan(*rank(CANDIDATES, "margin")).best is CANDIDATES[2]
    assert plan(CANDIDATES[0], CANDIDATES[4]).best is None
    assert plan().best is None


def test_an_unknown_key_of_the_ranking_never_reaches_it():
    with pytest.raises(SgnlpError, match="margin"):
        replace(SMALL, rank_by="beauty")
