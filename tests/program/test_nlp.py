"""The nonlinear program: its exact derivatives against differences and against CasADi on the whole expression."""

from dataclasses import fields, replace

import casadi as ca
import numpy as np
import pytest
from finite_differences import assert_jacobian, assert_products, jacobian
from scenes import (
    CROWD,
    REACHING,
    SMALL,
    block,
    exact_grasp,
    hand,
    observation,
    oracle,
    posed,
    random_point,
    with_added,
)

from sgnlp.base.settings import Contact, Settings, Weights
from sgnlp.base.surface_settings import GpisSettings
from sgnlp.experiments.benchmarks.plain import plain, plain_hessian
from sgnlp.hand.hand import load_hand
from sgnlp.planning.problem import build_problem
from sgnlp.planning.surroundings import NOWHERE, Surroundings
from sgnlp.program.formulations import formulation
from sgnlp.program.nlp import build
from sgnlp.program.oracle import Oracle
from sgnlp.program.variables import UNITS, variable_units
from sgnlp.surface.kernels import KERNELS

CONSTRAINED = formulation("constrained")
FORMULATIONS = ("penalty", "constrained", "lifted")
EVERY_TERM = Weights(**{field.name: getattr(Weights(), field.name) or 50.0 for field in fields(Weights)})
LOADED = replace(SMALL, spheres="paper", contact=Contact(mass=0.2, friction=0.7, samples=3), weights=EVERY_TERM)
"""No more spheres and samples than every row and a straight path need."""
MOVED = replace(LOADED, contact=replace(LOADED.contact, displacement=(0.01, 0.02, -0.01), rotation=(0.2, -0.1, 0.3)))
TORQUES = replace(LOADED, limits=replace(LOADED.limits, effort=1.0))
CLOSURE = replace(TORQUES, contact=replace(LOADED.contact, metric="closure", heuristic=1.6))
PRINTED = replace(LOADED, contact=replace(LOADED.contact, equilibrium="printed", pad=False, density="density"))


def with_kernel(settings: Settings, kernel: str, surface_points: int = 60) -> Settings:
    return replace(settings, gpis=GpisSettings(kernel=kernel, surface_points=surface_points, interior_points=12))


def scene(settings: Settings, form: str, seed: int = 0, around: Surroundings = NOWHERE, arm: str | None = None):
    """The functions, a point near a start, its parameters with a weight on every term, random multipliers."""
    functions, problem = oracle(settings, form, around, arm), posed(settings, around, arm)
    start, x = random_point(problem, functions.nlp, seed)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    x = with_added(functions, x, p, problem.row_bounds(functions.nlp))
    x[len(variable_units(problem.hand)) :] += 0.1
    p[block(functions.nlp.parameters, "weights")] = [getattr(EVERY_TERM, term.setting) for term in problem.terms]
    lam = np.random.default_rng(seed).normal(size=sum(functions.nlp.row_sizes))
    return functions, x, p, lam


def full(H) -> np.ndarray:
    """The symmetric matrix of an upper triangle."""
    H = np.array(H)
    return H + np.triu(H, 1).T


@pytest.mark.parametrize("form", ["constrained", "lifted"])
def test_the_derivatives_of_joint_torques_match_differences(form):
    check(*scene(TORQUES, form, seed=4))


@pytest.mark.parametrize(
    ("settings", "form"),
    [*((MOVED, form) for form in FORMULATIONS), (CLOSURE, "penalty"), (CLOSURE, "constrained")],
)
def test_the_derivatives_of_desired_motion_and_of_force_closure_match_differences(settings, form):
    check(*scene(settings, form, seed=2))


@pytest.mark.parametrize("form", ["constrained", "lifted"])
def test_the_derivatives_of_the_hand_at_contact_match_differences(form):
    check(*scene(REACHING, form, seed=5))


@pytest.mark.parametrize(("settings", "form"), [(LOADED, "penalty"), (REACHING, "constrained"), (LOADED, "lifted")])
def test_the_derivatives_of_obstacles_and_regions_match_differences(settings, form):
    check(*scene(replace(settings, spheres="paper"), form, 6, CROWD))


@pytest.mark.parametrize(("form", "arm"), [("penalty", "panda"), ("constrained", "ur5"), ("lifted", "panda")])
def test_the_derivatives_of_the_arm_match_differences(form, arm):
    check(*scene(replace(REACHING, spheres="paper"), form, 7, CROWD, arm))


def test_beside_its_own_rows_and_variables_the_program_of_an_arm_is_that_of_the_hand():
    settings = replace(REACHING, spheres="paper")
    alone, x, p, _ = scene(settings, "constrained", 7, CROWD)
    carried, y, q, _ = scene(settings, "constrained", 7, CROWD, "ur5")
    np.testing.assert_array_equal(x, y[: len(x)])
    ours, theirs = (
        dict(zip(f.nlp.row_names, f.values(z, r), strict=True)) for f, z, r in ((alone, x, p), (carried, y, q))
    )
    own = {name.partition("[")[0] for name in theirs.keys() - ours.keys()}
    assert own == {"arm", "arm_self", "arm_hand", "arm_turn", "wrist", "standoff", "lift", "dexterity"}
    for name, value in ours.items():
        assert theirs[name] == pytest.approx(value, abs=1e-12), name
    q[block(carried.nlp.parameters, "weights")] *= [term.name != "arm" for term in posed(settings, CROWD, "ur5").terms]
    assert float(carried.objective(y, q)) == pytest.approx(float(alone.objective(x, p)), abs=1e-12)
    gradients = [np.array(f.gradient(z, r)[1]).ravel() for f, z, r in ((alone, x, p), (carried, y, q))]
    np.testing.assert_allclose(gradients[1][: len(x)], gradients[0], atol=1e-12)
    np.testing.assert_array_equal(gradients[1][len(x) :], 0.0)


def test_where_an_arm_stands_is_no_part_of_the_program():
    here, there = (load_hand("allegro_left", arm="panda", arm_base=base) for base in ([-0.5, 0, 0], [0, 0.6, 0.1]))
    assert here.digest == there.digest
    p = [build_problem(observation(), robot, SMALL) for robot in (here, there)]
    assert p[0].structure(CONSTRAINED) == p[1].structure(CONSTRAINED)


def test_a_scene_is_no_part_of_the_program():
    other = replace(CROWD, obstacles=CROWD.obstacles[:1], avoid=CROWD.obstacles)
    settings = replace(LOADED, spheres="paper")
    assert posed(settings, other).structure(CONSTRAINED) == posed(settings, CROWD).structure(CONSTRAINED)
    assert posed(settings).structure(CONSTRAINED) != posed(settings, CROWD).structure(CONSTRAINED)


def test_the_variables_at_contact_are_c_of_each_finger_and_then_the_joints():
    functions = oracle(REACHING, "constrained")
    first = len(variable_units(hand()))
    names, units = functions.nlp.variable_names[first:], functions.nlp.units[first:]
    assert names[: len(hand().fingers)] == tuple(f"c.{finger.name}" for finger in hand().fingers)
    assert names[len(hand().fingers) :] == tuple(f"contact.{name}" for name in hand().joint_names)
    np.testing.assert_array_equal(units, 1.0)
    assert len(oracle(REACHING, "penalty").nlp.units) == first


@pytest.mark.parametrize("form", FORMULATIONS)
@pytest.mark.parametrize("kernel", sorted(KERNELS))
def test_gradient_jacobian_and_hessian_match_differences(kernel, form):
    functions, x, p, lam = scene(with_kernel(LOADED, kernel), form)
    check(functions, x, p, lam)


def test_the_derivatives_match_differences_with_the_printed_equilibrium_without_pads_too():
    check(*scene(PRINTED, "penalty", seed=1))


def test_the_derivatives_match_differences_far_from_a_start_too():
    functions, x, p, lam = scene(LOADED, "constrained", seed=3)
    rng = np.random.default_rng(3)
    check(functions, x + 0.1 * rng.normal(size=len(x)), p, lam)


def check(functions: Oracle, x, p, lam) -> None:
    f, g = functions.gradient(x, p)
    rows, J = functions.jacobian(x, p)
    assert float(f) == float(functions.objective(x, p))
    np.testing.assert_array_equal(np.array(rows), np.array(functions.rows(x, p)))
    assert_jacobian(lambda y: float(functions.objective(y, p)), g, x)
    expected, start = jacobian(lambda y: np.array(functions.rows(y, p)).ravel(), x), 0
    for constraint, size in zip(functions.nlp.constraints, functions.nlp.row_sizes, strict=True):
        part = slice(start, start + size)
        scale = np.abs(expected[part]).max()
        np.testing.assert_allclose(np.array(J)[part], expected[part], atol=1e-6 * scale, err_msg=constraint.name)
        start += size

    def lagrangian(y):
        return np.array(functions.gradient(y, p)[1]).ravel() + np.array(functions.jacobian(y, p)[1]).T @ lam

    assert_products(lagrangian, full(functions.hessian(x, p, 1.0, lam)), x)


@pytest.mark.parametrize(
    ("kernel", "form"), [*zip(("squared_exponential", "matern52", "matern32"), FORMULATIONS, strict=True)]
)
def test_the_chain_with_jets_equals_casadis_differentiation_of_the_whole_expression(kernel, form):
    """One kernel each, thin plate below: the others' jets are compared by themselves, in test_jets."""
    compare_with_casadi(with_kernel(LOADED, kernel), form)


def test_so_does_the_whole_hessian_of_the_benchmark():
    program, functions, x, p, lam = compare_with_casadi(LOADED, "penalty")
    H = np.array(plain_hessian(*program)(x, p, 0.7, lam))
    np.testing.assert_allclose(np.array(functions.hessian(x, p, 0.7, lam)), H, rtol=1e-9, atol=1e-9 * np.abs(H).max())


@pytest.mark.parametrize(
    ("settings", "form"), [(MOVED, "constrained"), (CLOSURE, "penalty"), (REACHING, "constrained")]
)
def test_so_it_does_with_a_desired_motion_for_force_closure_and_with_the_hand_at_contact(settings, form):
    compare_with_casadi(settings, form)


def compare_with_casadi(settings: Settings, form: str):
    small = replace(settings.gpis, surface_points=12, interior_points=12)
    settings = replace(settings, spheres="paper", gpis=small)
    functions, x, p, lam = scene(settings, form)
    program = hand("paper"), functions.nlp.structure, posed(settings).gpis
    y, q, objective, constraints = plain(*program)
    slope = ca.gradient(0.7 * objective + ca.dot(lam, constraints), y)
    along = np.random.default_rng(1).normal(size=(len(x), 3))  # all of a Hessian would take ten times as long
    every = [objective, ca.gradient(objective, y), constraints, ca.jacobian(constraints, y), ca.jtimes(slope, y, along)]
    f, g, rows, J, curvature = (np.array(a) for a in ca.Function("every", [y, q], every)(x, p))
    near = {"rtol": 1e-9}
    np.testing.assert_allclose(np.array(functions.objective(x, p)), f, **near)
    np.testing.assert_allclose(np.array(functions.gradient(x, p)[1]), g, atol=1e-9 * np.abs(g).max(), **near)
    np.testing.assert_allclose(np.array(functions.rows(x, p)), rows, atol=1e-9, **near)
    np.testing.assert_allclose(np.array(functions.jacobian(x, p)[1]), J, atol=1e-9 * np.abs(J).max(), **near)
    H = full(functions.hessian(x, p, 0.7, lam))
    np.testing.assert_allclose(H @ along, curvature, atol=1e-9 * np.abs(H).max(), **near)
    return program, functions, x, p, lam


def test_the_hessian_is_linear_in_its_multipliers():
    functions, x, p, lam = scene(LOADED, "constrained")
    both, objective, rows = (full(functions.hessian(x, p, *a)) for a in ((2.0, lam), (1.0, 0 * lam), (0.0, lam)))
    np.testing.assert_allclose(both, 2 * objective + rows, rtol=1e-10, atol=1e-9 * np.abs(both).max())


def test_the_query_points_are_contacts_paths_spheres_and_targets_in_this_order():
    functions, problem = oracle(LOADED, "penalty"), posed(LOADED)
    start, x = random_point(problem, functions.nlp, 2)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    Z, g = np.array(functions.nlp.points(x, p)[0]), exact_grasp(problem, start, x)
    m, K, S = functions.nlp.layout.m, functions.nlp.layout.K, functions.nlp.layout.S
    contacts, paths, spheres, targets = np.split(Z, [m, m + m * K, m + m * K + S])
    near = {"atol": 1e-12}
    np.testing.assert_allclose(contacts, g.contacts, **near)
    np.testing.assert_allclose(spheres, g.spheres, **near)
    np.testing.assert_allclose(targets, g.targets, **near)
    for i, path in enumerate(paths.reshape(m, K, 3)):
        np.testing.assert_allclose(path[0], g.tips[i], **near)
        np.testing.assert_allclose(path[-1], g.targets[i], **near)
        np.testing.assert_allclose(np.diff(path, n=2, axis=0), 0, **near)


def test_variables_have_their_documented_order_and_units():
    units = variable_units(hand())
    n, m = len(hand().joint_names), len(hand().fingers)
    assert len(units) == 6 + n + 4 * m
    np.testing.assert_array_equal(units[:3], UNITS["linear"])
    np.testing.assert_array_equal(units[3 : 6 + n], UNITS["angular"])
    np.testing.assert_array_equal(units[6 + n : -m], UNITS["target"])
    np.testing.assert_array_equal(units[-m:], UNITS["gain"])


def test_the_same_hand_and_structure_give_the_same_functions():
    structure = posed(SMALL).structure(formulation("penalty"))
    assert build(hand("paper"), structure) is build(hand("paper"), structure)
    assert build(hand("paper"), structure) is not build(hand("paper"), replace(structure, samples=3))


def test_terms_that_constraints_replace_leave_the_constrained_objective():
    for settings, replaced in ((LOADED, {"dist", "col", "force"}), (CLOSURE, {"dist", "col", "closure"})):
        names = {f: {t.name for t in oracle(settings, f).nlp.terms_used} for f in ("penalty", "constrained")}
        assert names["penalty"] - names["constrained"] == replaced
