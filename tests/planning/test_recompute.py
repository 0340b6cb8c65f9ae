"""Two independent paths to one grasp: the expressions that the solver sees and the NumPy recomputation agree."""

from dataclasses import fields, replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from scenes import CROWD, REACHING, SMALL, exact_grasp, hand, oracle, posed, random_point, random_rotation, with_added

from sgnlp.base.settings import Contact, Settings
from sgnlp.hand.hand import Hand
from sgnlp.planning.recompute import equilibrium, rotation_angle
from sgnlp.program.carried import Carried
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp
from sgnlp.program.lifting import Lifting
from sgnlp.program.model import Model
from sgnlp.program.oracle import SurfaceJets
from sgnlp.program.variables import variable_units

LOADED = replace(SMALL, contact=Contact(mass=0.3, friction=0.7, samples=4))
MOVED = replace(
    SMALL,
    contact=Contact(mass=0.3, samples=4, c=1.0, displacement=(0.01, -0.02, 0.03), rotation=(0.2, -0.1, 0.3)),
    weights=replace(SMALL.weights, pose=1.0),
)
NO_PAD = replace(SMALL, contact=Contact(mass=0.0, pad=False, samples=4))
ROUNDED = ("contact_deviations", "path_deviations", "normals", "normals_eq", "gaps")
"""√σ² and |∇μ| are rounded at 0 in the smooth grasp."""


@cache
def symbolic_grasp(settings: Settings, other: Hand | None = None) -> tuple[ca.Function, list[str]]:
    """(x, p, jets…) → every symbolic field of the grasp, of another hand if one is given, and their names."""
    nlp = oracle(settings, "constrained").nlp
    chain = Lifting(ca.SX.sym("x", len(nlp.units)))
    p, blocks = nlp.parameters.symbols()
    model = Model(other or nlp.hand, nlp.structure, chain, blocks, nlp.units)
    symbols = {f.name: getattr(model.grasp, f.name) for f in fields(Grasp)}
    symbols |= {f"links.{name}": origin for name, origin in model.grasp.links.items()}
    symbols = {name: value for name, value in symbols.items() if isinstance(value, ca.SX)}
    return ca.Function(
        "grasp", [chain.x, p, *model.jets, model.field_jets], chain.values(list(symbols.values()))
    ), list(symbols)


def both(settings: Settings, seed: int) -> tuple[dict[str, np.ndarray], Grasp]:
    """The smooth and the exact grasp at one random point."""
    functions, problem = oracle(settings, "constrained"), posed(settings)
    start, x = random_point(problem, functions.nlp, seed)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    x = with_added(functions, x, p, problem.row_bounds(functions.nlp))
    x[len(variable_units(problem.hand)) :] += 0.05  # off what inverse kinematics finds, if there is any
    f, names = symbolic_grasp(settings)
    numbers = f(x, p, *SurfaceJets(functions.surface, complete=True)(*functions.nlp.points(x, p)))
    smooth = {name: np.array(number) for name, number in zip(names, numbers, strict=True)}
    return smooth, exact_grasp(problem, start, x)


@pytest.mark.parametrize("settings", [LOADED, NO_PAD, MOVED, REACHING], ids=["loaded", "no_pad", "moved", "reaching"])
@pytest.mark.parametrize("seed", range(4))
def test_the_numpy_grasp_equals_the_symbolic_one(settings, seed):
    smooth, exact = both(settings, seed)
    assert {"tips", "contacts_eq", "rotation", "stiffness", "forces_eq", "pair_clearances"} <= smooth.keys()
    assert {
        "wrench",
        "wrench_eq",
        "contacts_desired",
        "torques",
        "torques_eq",
        "rotation_desired",
        "pad_clearances",
        "joints_contact",
        "reach_errors",
        "object_clearances_contact",
        "table_clearances_contact",
        "pair_clearances_contact",
        "wrist_position",
        "wrist_rotation",
        "centre",
        "links.palm_link",
        "links.link_11.0_tip",
    } <= smooth.keys()
    for name, value in smooth.items():
        field, _, link = name.partition(".")
        exactly = getattr(exact, field)
        expected = np.asarray(exactly[link] if link else exactly).reshape(value.shape)
        rtol = 1e-4 if name in ROUNDED else 1e-8
        atol = 2e-6 if name == "gaps" else 1e-9  # [m]: the feet follow the normals
        np.testing.assert_allclose(value, expected, rtol=rtol, atol=atol, err_msg=name)


PADS = np.array([0.008, 0.010, 0.013, 0.016])
"""Radii of the pads of a hand whose fingers differ [m]."""


@cache
def unequal() -> Hand:
    fingers = [replace(f, radius=float(r)) for f, r in zip(hand().fingers, PADS, strict=True)]
    return replace(hand(), fingers=tuple(fingers))


def test_with_unequal_pads_every_gap_and_height_is_that_of_its_finger():
    problem = replace(posed(LOADED), hand=unequal())
    g = exact_grasp(problem, *random_point(problem, oracle(LOADED, "constrained").nlp, 2))
    gpis, K = problem.gpis, LOADED.contact.samples
    for i, radius in enumerate(PADS):
        path, samples = (
            np.array([a * g.targets[i] + (1 - a) * g.tips[i] for a in np.arange(K) / (K - 1)]),
            slice(K * i, K * i + K),
        )
        np.testing.assert_allclose(g.path_gaps[samples], gpis.distance(path) - radius, atol=1e-12)
        np.testing.assert_allclose(g.path_deviations[samples], gpis.distance_deviation(path), rtol=1e-9)
        foot = g.contacts[i] - radius * g.normals[i]
        assert g.gaps[i] == pytest.approx(gpis.distance(foot[None])[0], abs=1e-12)
        heights = g.tips[i, 2], g.contacts[i, 2], g.contacts_eq[i, 2]
        found = g.pad_heights[i], g.contact_heights[i], g.contact_heights_eq[i]
        assert found == pytest.approx([height - radius for height in heights], abs=1e-12)


def test_with_unequal_pads_the_numpy_grasp_still_equals_the_symbolic_one():
    functions, problem = oracle(LOADED, "constrained"), posed(LOADED)
    start, x = random_point(problem, functions.nlp, 2)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    f, names = symbolic_grasp(LOADED, unequal())
    jets = SurfaceJets(functions.surface, complete=True)(functions.nlp.points(x, p)[0], PADS, np.empty((0, 3)))
    smooth = dict(zip(names, f(x, p, *jets), strict=True))
    exact = exact_grasp(replace(problem, hand=unequal()), start, x)
    for name in ("path_gaps", "gaps", "pad_heights", "contact_heights", "contact_heights_eq"):
        found = np.array(smooth[name]).ravel()
        np.testing.assert_allclose(found, getattr(exact, name), atol=2e-6, err_msg=name)


def test_in_the_penalty_formulation_the_gap_is_that_of_the_centre_less_the_radius():
    functions, problem = oracle(LOADED, "penalty"), posed(LOADED)
    start, x = random_point(problem, functions.nlp, 0)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    f, names = symbolic_grasp(LOADED)
    numbers = f(x, p, *SurfaceJets(functions.surface, complete=True)(*functions.nlp.points(x, p)))
    gaps = np.array(numbers[names.index("gaps")]).ravel()
    contacts = exact_grasp(problem, start, x).contacts
    np.testing.assert_allclose(gaps, problem.gpis.distance(contacts) - 0.012, atol=1e-9)


def test_contacts_forces_and_normals_obey_the_equations_of_the_grasp():
    _, g = both(LOADED, 1)
    np.testing.assert_allclose(g.contacts - g.targets, 0.7 * (g.tips - g.targets), atol=1e-15)
    np.testing.assert_allclose(g.forces, g.gains[:, None] * (g.targets - g.contacts))
    np.testing.assert_allclose(g.forces_eq, g.gains[:, None] * (g.targets - g.contacts_eq))
    np.testing.assert_allclose(g.forces_eq.sum(axis=0), [0, 0, 0.3 * GRAVITY], atol=1e-10)
    np.testing.assert_allclose(g.wrench_eq, 0, atol=1e-10)
    np.testing.assert_allclose(np.linalg.norm(g.normals, axis=1), 1, rtol=1e-4)
    shape, shape_eq = (np.linalg.norm(p[:, None] - p[None], axis=2) for p in (g.contacts, g.contacts_eq))
    np.testing.assert_allclose(shape, shape_eq, atol=1e-12)  # the object is rigid


def test_the_recomputed_equilibrium_is_the_true_one_even_where_the_plan_took_the_printed_one():
    printed = replace(LOADED, contact=replace(LOADED.contact, equilibrium="printed"))
    _, g = both(printed, 1)
    _, h = both(LOADED, 1)
    np.testing.assert_array_equal(g.rotation, h.rotation)


@pytest.mark.parametrize("seed", range(5))
def test_the_svd_equilibrium_balances_force_and_torque_and_undoes_a_known_motion(seed):
    rng = np.random.default_rng(seed)
    p, k, com = rng.normal(size=(4, 3)), rng.uniform(40, 400, 4), rng.normal(size=3)
    Q, shift = random_rotation(rng), rng.normal(size=3)
    R, t, rho = equilibrium(p, p @ Q.T + shift, k, 0.0, com)
    np.testing.assert_allclose(R, Q, atol=1e-12)
    np.testing.assert_allclose(t, shift, atol=1e-12)
    assert rho > 0
    o = p + 0.3 * rng.normal(size=(4, 3))
    R, t, _ = equilibrium(p, o, k, 0.5, com)
    there, weight = p @ R.T + t, np.array([0, 0, -0.5 * GRAVITY])
    f = k[:, None] * (o - there)
    np.testing.assert_allclose(f.sum(axis=0) + weight, 0, atol=1e-11)
    np.testing.assert_allclose(np.cross(there, f).sum(axis=0) + np.cross(R @ com + t, weight), 0, atol=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_where_the_targets_are_mirrored_the_equilibrium_is_still_the_best_rotation(seed):
    rng = np.random.default_rng(seed)
    p, k = rng.normal(size=(4, 3)), rng.uniform(40, 400, 4)
    o = p @ (np.diag([1.0, 0.9, -0.8]) @ random_rotation(rng))
    R, t, _ = equilibrium(p, o, k, 0.0, np.zeros(3))
    assert np.linalg.det(R) == pytest.approx(1.0)

    def energy(Q, shift):
        return 0.5 * k @ ((p @ Q.T + shift - o) ** 2).sum(axis=1)

    for _ in range(300):
        Q = random_rotation(rng)
        assert energy(Q, k @ (o - p @ Q.T) / k.sum()) >= energy(R, t)


def test_coinciding_targets_have_an_equilibrium_without_stiffness_and_nothing_is_nan():
    p = np.random.default_rng(0).normal(size=(4, 3))
    R, t, rho = equilibrium(p, np.zeros((4, 3)), np.full(4, 80.0), 0.0, np.zeros(3))
    assert np.isfinite(R).all()
    assert np.isfinite(t).all()
    assert rho == 0


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, np.pi - 1e-6, np.pi])
def test_the_rotation_angle_is_accurate_from_zero_to_a_half_turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert rotation_angle(R) == pytest.approx(angle, rel=1e-6, abs=1e-12)


def test_the_numpy_arm_equals_the_symbolic_one():
    functions, problem = oracle(REACHING, "constrained", CROWD, "panda"), posed(REACHING, CROWD, "panda")
    start, x = random_point(problem, functions.nlp, 3)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    x = with_added(functions, x, p, problem.row_bounds(functions.nlp))
    x[-2 * len(problem.hand.arm.joint_names) :] += 0.1  # the ends of the way; the flange holds the palm at its begin
    chain = Lifting(ca.SX.sym("x", len(x)))
    symbols, blocks = functions.nlp.parameters.symbols()
    model = Model(problem.hand, functions.nlp.structure, chain, blocks, functions.nlp.units)
    smooth = {f.name: getattr(model.grasp.arm, f.name) for f in fields(Carried) if f.name != "home"}
    f = ca.Function("arm", [chain.x, symbols, *model.jets, model.field_jets], chain.values(list(smooth.values())))
    found = f(x, p, *SurfaceJets(functions.surface, complete=True)(*functions.nlp.points(x, p)))
    exact = exact_grasp(problem, start, x).arm
    for name, value in zip(smooth, found, strict=True):
        rounded = {"clearances": 1e-3, "wrist_error": 2e-3, "standoff_error": 2e-3, "lift_error": 2e-3}  # edges; tan
        np.testing.assert_allclose(
            np.array(value).ravel(), np.ravel(getattr(exact, name)), atol=rounded.get(name, 1e-6), err_msg=name
        )
