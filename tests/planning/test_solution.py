"""Solutions: recomputed values, the conditions of feasibility one by one, and the ranking."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scenes import SMALL, exact_grasp, oracle, posed, random_grasp, random_point

from sgnlp.base.errors import SgnlpError
from sgnlp.planning.ipopt import Course, Iterate
from sgnlp.planning.kkt import Kkt
from sgnlp.planning.plan import Plan
from sgnlp.planning.solution import Check, Solution, feasibility, rank, solution
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Exact
from sgnlp.program.terms import TERMS
from sgnlp.program.terms.spring import margins

GOOD_MARGIN = np.full(4, 0.1)
CLEAR = np.full(3, 0.01)  # [m]
N = len(posed(SMALL).hand.joint_names)


def good() -> Grasp:
    """A grasp that passes every check."""
    hand = posed(SMALL).hand
    return replace(
        random_grasp(SMALL, 0),
        joints=(hand.lower + hand.upper) / 2,
        gaps=np.zeros(4),
        object_clearances=CLEAR,
        pad_clearances=CLEAR,
        table_clearances=CLEAR,
        pad_heights=CLEAR,
        pair_clearances=CLEAR,
        forces_eq=np.full((4, 3), 5.0),
        stiffness=0.1,
        ball_clearances=CLEAR,
    )


def failed(g: Grasp, initial=GOOD_MARGIN, equilibrium=GOOD_MARGIN, settings=SMALL) -> set[str]:
    problem = replace(posed(SMALL), settings=settings)
    return {c.name for c in feasibility(problem, g, initial, equilibrium) if not c.passed}


def one(value: float, rest: float = 0.01) -> np.ndarray:
    return np.array([rest, value, rest])


def beyond(limit: str, by: float) -> np.ndarray:
    """Joint angles in the middle of their ranges, one of them past a limit."""
    hand = posed(SMALL).hand
    joints = (hand.lower + hand.upper) / 2
    joints[3] = getattr(hand, limit)[3] + by
    return joints


def force(size: float) -> np.ndarray:
    forces = np.tile([0.0, 0.0, 9.0], (4, 1))
    forces[2] = [0.0, -size, 0.0]
    return forces


LEAST_FORCE = 0.9 * SMALL.limits.force_min
VIOLATIONS = [  # check, field, a value just past its bound, one just inside
    ("contact distance", "gaps", np.array([0, 2.1e-3, 0, 0]), np.array([0, 1.9e-3, 0, 0])),
    ("contact distance", "gaps", np.array([0, -2.1e-3, 0, 0]), np.array([0, -1.9e-3, 0, 0])),
    ("object clearance", "object_clearances", one(-1.1e-3), one(-0.9e-3)),
    ("object clearance", "pad_clearances", one(-1.1e-3), one(-0.9e-3)),
    ("table clearance", "table_clearances", one(-1.1e-3), one(-0.9e-3)),
    ("table clearance", "pad_heights", one(-1.1e-3), one(-0.9e-3)),
    ("self clearance", "pair_clearances", one(-1.1e-3), one(-0.9e-3)),
    ("joint limits", "joints", beyond("upper", 1e-3), beyond("upper", -1e-3)),
    ("joint limits", "joints", beyond("lower", -1e-3), beyond("lower", 1e-3)),
    ("force", "forces_eq", force(0.99 * LEAST_FORCE), force(1.01 * LEAST_FORCE)),
    ("stiffness", "stiffness", 0.0, 1e-4),
    ("stiffness", "stiffness", -0.1, 0.1),
    ("surface model", "ball_clearances", one(-1e-4), one(1e-4)),
]


def test_a_good_grasp_passes_every_check():
    assert failed(good()) == set()


@pytest.mark.parametrize(("check", "field", "bad", "fine"), VIOLATIONS)
def test_each_condition_fails_by_itself_and_only_past_its_bound(check, field, bad, fine):
    assert failed(replace(good(), **{field: bad})) == {check}
    assert failed(replace(good(), **{field: fine})) == set()


@pytest.mark.parametrize("state", ["initial", "equilibrium"])
def test_a_negative_margin_at_either_state_fails(state):
    slipping = np.array([0.1, 0.1, -1e-3, 0.1])
    name = {"initial": "margin at first contact", "equilibrium": "margin at equilibrium"}[state]
    assert failed(good(), **{state: slipping}) == {name}
    assert failed(good(), **{state: np.zeros(4)}) == set()


def test_without_a_pregrasp_the_pads_may_touch():
    touching = replace(good(), pad_clearances=np.full(4, -2e-3))
    assert failed(touching) == {"object clearance"}
    assert failed(touching, settings=replace(SMALL, contact=replace(SMALL.contact, c=1.0))) == set()


def test_force_closure_is_judged_by_its_residual_and_its_normal_forces_at_first_contact_alone():
    closure = replace(SMALL, contact=replace(SMALL.contact, metric="closure"))
    g = good()
    balanced = replace(g, wrench=np.zeros((2, 3)), forces=-LEAST_FORCE * 1.01 * g.normals, stiffness=-0.1)
    balanced = replace(balanced, forces_eq=np.zeros((4, 3)))
    slips = np.full(4, -0.5)
    assert failed(balanced, equilibrium=slips, settings=closure) == set()
    assert failed(balanced, initial=slips, settings=closure) == {"margin at first contact"}
    light = replace(balanced, forces=0.98 * balanced.forces)
    assert failed(light, settings=closure) == {"normal force"}
    for i, residual in enumerate(np.eye(6).reshape(6, 2, 3)):
        assert failed(replace(balanced, wrench=1.1e-3 * residual), settings=closure) == {"force closure"}, i
        assert failed(replace(balanced, wrench=0.9e-3 * residual), settings=closure) == set()


def test_joint_torques_are_judged_where_they_are_limited_by_the_larger_of_both_states():
    limited = replace(SMALL, limits=replace(SMALL.limits, effort=1.0))
    strained = replace(good(), torques=np.zeros(N), torques_eq=0.71 * np.eye(N)[5])
    assert failed(strained) == set()
    assert failed(strained, settings=limited) == {"joint torque"}
    assert failed(replace(strained, torques_eq=-0.69 * np.eye(N)[5]), settings=limited) == set()
    closure = replace(limited, contact=replace(SMALL.contact, metric="closure"))
    assert "joint torque" not in failed(strained, settings=closure)
    assert "joint torque" in failed(replace(strained, torques=strained.torques_eq), settings=closure)


def test_what_is_not_a_number_is_not_feasible():
    assert not Check("x", float("nan"), 0.0, "").passed
    assert failed(replace(good(), gaps=np.full(4, np.nan))) == {"contact distance"}


def test_a_hand_without_self_collision_pairs_passes_that_check():
    assert failed(replace(good(), pair_clearances=np.zeros(0))) == set()


# --- recomputed values ----------------------------------------------------------------------------------------------


def made(seed: int = 0) -> tuple[Solution, Grasp]:
    """The solution of an iterate at a random point, and the grasp there."""
    problem, nlp = posed(SMALL), oracle(SMALL, "penalty").nlp
    start, x = random_point(problem, nlp, seed)
    course = Course(*[np.zeros(8)] * 5)
    iterate = Iterate(
        start.index, "penalty", x, np.zeros(0), 1e9, Kkt(0.1, 0.2, 0.3), "Solve_Succeeded", 7, 0.5, course
    )
    return solution(problem, start, iterate, nlp.units), exact_grasp(problem, start, x)


def test_a_solution_is_recomputed_and_not_believed():
    s, g = made()
    exact = np.array([term.value(g, Exact()) for term in TERMS])
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
    return Plan(None, posed(SMALL), solutions, (), 0, 1, 1.0, {})


def test_the_best_is_the_first_feasible_solution_or_none():
    assert plan(*rank(CANDIDATES, "margin")).best is CANDIDATES[2]
    assert plan(CANDIDATES[0], CANDIDATES[4]).best is None
    assert plan().best is None


def test_an_unknown_key_of_the_ranking_never_reaches_it():
    with pytest.raises(SgnlpError, match="margin"):
        replace(SMALL, rank_by="beauty")
