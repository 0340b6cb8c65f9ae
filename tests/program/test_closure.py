"""Force closure: the program's forces against a convex solver, and the baselines and ablations as they are planned."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scenes import SMALL, block, exact_grasp, hand, oracle, posed, random_point
from scipy.spatial.transform import Rotation

from sgnlp.base.presets import preset
from sgnlp.base.settings import Settings, Weights
from sgnlp.hand.kinematics import frames, integrate
from sgnlp.planning.planner import Planner
from sgnlp.planning.pool import solve_start
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.solvers.solver import NlpInstance
from sgnlp.planning.starts import initial, starts
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Exact
from sgnlp.program.terms.spring import margins
from sgnlp.program.variables import variable_units


def small(name: str) -> Settings:
    """A preset with as few points and samples as the shared scene."""
    given = preset(name)
    return replace(given, gpis=SMALL.gpis, contact=replace(given.contact, samples=SMALL.contact.samples))


CLOSURE = small("bilevel-low")
INNER = replace(
    CLOSURE,
    contact=replace(CLOSURE.contact, c=1.0),
    weights=Weights(**dict.fromkeys(vars(Weights()), 0.0) | {"closure": 200.0}),
    solver=replace(CLOSURE.solver, formulation="penalty"),
)
"""Force closure alone without a pregrasp: the hand sets the contacts, the targets the forces."""
WIDTHS = (0.1, 1e-2, 1e-3)
"""Of the rounding of the residual [N, N m], the last fine enough to compare with what is not rounded."""


def convex(problem: Problem, g: Grasp) -> float:
    """min |Σ F - m g e_z| + |Σ (p - c_g) × F| over the friction cones with a least normal force, as cones."""
    import cvxpy as cp  # takes a second, which a process that runs other files saves

    contact, force_min = problem.settings.contact, problem.settings.limits.force_min
    F = cp.Variable(g.contacts.shape)
    force = cp.sum(F, axis=0) - np.array([0.0, 0.0, contact.mass * GRAVITY])
    torque = sum(_skew(p - problem.com) @ F[i] for i, p in enumerate(g.contacts))
    cones = [cp.norm(F[i]) <= -np.sqrt(1 + contact.friction**2) * (n @ F[i]) for i, n in enumerate(g.normals)]
    press = [n @ F[i] <= -force_min for i, n in enumerate(g.normals)]
    program = cp.Problem(cp.Minimize(cp.norm(force) + cp.norm(torque)), cones + press)
    program.solve(solver=cp.CLARABEL)
    assert program.status == cp.OPTIMAL
    return float(program.value)


def _skew(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def residual(g: Grasp) -> float:
    return float(np.linalg.norm(g.wrench, axis=1).sum())


@cache
def inner(bend: float, friction: float) -> Grasp:
    """The grasp with the least residual that the program finds for a hand that it may not move."""
    settings = replace(INNER, contact=replace(INNER.contact, friction=friction))
    problem, functions = posed(settings), oracle(settings, "penalty")
    nlp, n = functions.nlp, len(hand().joint_names)
    start = starts(problem, 1, 0)[0]
    joints = np.clip(start.joints + bend, hand().lower, hand().upper)
    start = replace(start, joints=joints)
    low, high = problem.variable_bounds(nlp, joints)
    low[: 6 + n] = high[: 6 + n] = 0.0
    low[-4:] = high[-4:] = hand().gain_upper / nlp.units[-4:]  # so stiff that no force leads a target out of its bounds
    rows = problem.row_bounds(nlp)
    p = problem.parameters(nlp, start.wrist, joints)
    x = initial(nlp, start)
    for width in WIDTHS:
        p[block(nlp.parameters, "force")] = width
        instance = NlpInstance(functions, p, (low, high), rows, settings.solver.tolerance, 500, np.zeros(len(x)))
        answer = Ipopt().settled(settings.solver).solve(instance, x)
        assert answer.status == "Solve_Succeeded", width
        x = answer.x
    return exact_grasp(problem, replace(start, joints=joints), x)


@pytest.mark.parametrize("friction", [0.2, 0.6, 1.0])
@pytest.mark.parametrize("bend", [-0.2, 0.0, 0.3])
def test_the_forces_of_the_program_leave_the_residual_of_the_second_order_cone_program(bend, friction):
    g = inner(bend, friction)
    least = convex(posed(replace(INNER, contact=replace(INNER.contact, friction=friction))), g)
    assert residual(g) == pytest.approx(least, abs=1e-3)
    assert margins(g.forces, g.normals, friction, Exact()).min() > -1e-6
    assert -(g.forces * g.normals).sum(axis=1).max() >= INNER.limits.force_min - 1e-5


def test_some_of_these_contacts_admit_force_closure_and_some_do_not():
    residuals = [residual(inner(bend, friction)) for bend in (-0.2, 0.0, 0.3) for friction in (0.2, 0.6, 1.0)]
    assert min(residuals) < 1e-3
    assert max(residuals) > 1.0


def test_contacts_and_forces_are_targets_and_pregrasps_in_other_coordinates():
    problem, c = posed(CLOSURE), CLOSURE.contact.c
    start, x = random_point(problem, oracle(INNER, "penalty").nlp, 0)
    g = exact_grasp(problem, start, x)
    wrist, joints = integrate(hand(), start.wrist, start.joints, (x * variable_units(hand()))[: 6 + len(start.joints)])
    assert 0 < c < 1
    o = g.contacts + g.forces / g.gains[:, None]
    np.testing.assert_allclose(o, g.targets, atol=1e-14)
    np.testing.assert_allclose(g.contacts / c - (1 - c) / c * o, frames(hand(), wrist, joints)[0], atol=1e-14)


# --- planned ---------------------------------------------------------------------------------------------------------


@cache
def planned(name: str) -> tuple[Solution, Settings]:
    """The first start of a preset on the ellipsoid."""
    settings = small(name)
    return first(settings), settings


def first(settings: Settings) -> Solution:
    """The solution of the first start."""
    planner = Planner(posed(settings))
    return solve_start(planner, starts(planner.problem, 1, 0)[0])


@pytest.mark.parametrize("name", ["bilevel-high", "bilevel-low", "bilevel-heuristic", "paper+bilevel-low"])
def test_a_baseline_is_solved_and_the_convex_solver_agrees_that_its_contacts_close_the_grasp(name):
    s, settings = planned(name)
    g = s.grasp
    assert s.solved(settings.solver.tolerance)
    assert s.feasible
    assert residual(g) < 1e-5
    assert convex(posed(settings), g) < 1e-5
    np.testing.assert_allclose(g.targets, g.contacts + g.forces / g.gains[:, None], atol=1e-12)
    assert np.linalg.norm(g.forces, axis=1).max() <= settings.limits.force_max + 1e-5


def test_the_gains_of_the_baselines_are_those_of_the_paper():
    np.testing.assert_allclose(planned("bilevel-high")[0].grasp.gains, [160, 160, 160, 320])
    np.testing.assert_allclose(planned("bilevel-low")[0].grasp.gains, [80, 80, 80, 160])
    g = planned("bilevel-heuristic")[0].grasp
    np.testing.assert_allclose(g.gains * g.contact_deviations, 1.6, rtol=1e-4)
    assert np.ptp(g.gains) > 1


def test_a_baseline_converges_in_the_penalty_formulation_too():
    settings = replace(CLOSURE, solver=replace(CLOSURE.solver, formulation="penalty"))
    s = first(settings)
    assert s.solved(settings.solver.tolerance)
    assert residual(s.grasp) < 1e-2
    assert s.margins_initial.min() > -1e-6


def test_without_a_pregrasp_the_hand_begins_in_contact():
    s, _ = planned("no-pregrasp")
    assert s.feasible
    np.testing.assert_allclose(s.grasp.tips, s.grasp.contacts, atol=1e-12)
    assert np.isfinite(s.energy_terms).all()


@pytest.mark.parametrize("name", ["no-uncertainty", "robust+no-contact+no-pad"])
def test_an_ablation_is_solved(name):
    s, settings = planned(name)
    assert s.solved(settings.solver.tolerance)
    assert np.isfinite(s.energy_terms).all()
    assert s.feasible


def test_a_plan_for_the_printed_equilibrium_is_judged_by_the_true_one():
    s, settings = planned("printed-equilibrium")
    g = s.grasp
    assert s.solved(settings.solver.tolerance)
    k = g.gains[:, None]
    B = (k * (g.targets - g.targets.mean(axis=0))).T @ (k * (g.contacts - g.contacts.mean(axis=0)))
    printed = Rotation.align_vectors(np.eye(3), B)[0].as_matrix()  # max tr(Rᵀ B) over rotations, by SciPy
    there = g.contacts @ printed.T + (g.gains @ (g.targets - g.contacts @ printed.T)) / g.gains.sum()
    assert np.linalg.norm(printed - g.rotation) > 1e-2
    assert np.linalg.norm(np.cross(there, k * (g.targets - there)).sum(axis=0)) > 1e-4  # [N m]: no equilibrium
    planned_margins = margins(k * (g.targets - there), g.normals @ printed.T, g.friction, Exact())
    assert planned_margins.min() > settings.limits.margin_equilibrium - 1e-5
    np.testing.assert_allclose(g.wrench_eq, 0, atol=1e-10)


def test_the_object_is_lifted_by_a_centimetre_where_that_is_desired():
    s, settings = planned("robust+no-contact+lift")
    moved = s.grasp.contacts_eq - s.grasp.contacts
    assert s.feasible
    np.testing.assert_allclose(moved, np.tile([0, 0, 0.01], (4, 1)), atol=settings.limits.shift + 1e-6)
    np.testing.assert_allclose(moved[:, :2], 0, atol=1e-3)


def test_the_object_turns_where_that_is_desired():
    settings = small("lift")
    contact = replace(settings.contact, displacement=(0.0, 0.0, 0.005), rotation=(0.0, 0.0, 0.3))
    s = first(replace(settings, contact=contact))
    np.testing.assert_allclose(s.grasp.rotation, s.grasp.rotation_desired, atol=0.05)
    names = [term.name for term in posed(settings).terms]
    assert s.energy_terms[names.index("pose")] < 0.01
