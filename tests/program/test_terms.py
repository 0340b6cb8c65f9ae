"""Every energy term by itself: its derivatives, its value by an independent formula, and what it rewards."""

from dataclasses import fields, replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from finite_differences import assert_jacobian, jacobian
from scenes import REACHING, SMALL, block, exact_grasp, oracle, posed, random_grasp, random_point
from scipy.spatial.transform import Rotation

from sgnlp.base.settings import Settings, Smoothing, Weights
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp
from sgnlp.program.nlp import ENERGY_UNIT
from sgnlp.program.ops import Exact
from sgnlp.program.terms import CLOSURE as OF_CLOSURE
from sgnlp.program.terms import COMPLIANT, preset_terms
from sgnlp.program.terms.collision import SLOPE
from sgnlp.program.terms.contact import FAINT_DENSITY
from sgnlp.program.terms.regularisation import Arm, Closing
from sgnlp.program.terms.spring import margins

DISPLACEMENT, TURN = (0.004, -0.003, 0.01), (0.1, -0.2, 0.15)
HEAVY = replace(
    SMALL,
    contact=replace(SMALL.contact, mass=0.2, displacement=DISPLACEMENT, rotation=TURN),
    weights=replace(SMALL.weights, pose=50.0),
)
CLOSURE = replace(HEAVY, contact=replace(HEAVY.contact, metric="closure"))
DENSITY = replace(HEAVY, contact=replace(HEAVY.contact, density="density"))
SHARP = Smoothing(distance=1e-9, collision=1e-9, log=1e-9, force=1e-9, deviation=1e-9, exponent=1e9)
ALL = {term.name: term for term in (*COMPLIANT, *OF_CLOSURE)}
NAMES = list(ALL)
SEEDS = (0, 5)


def settings_of(name: str) -> Settings:
    """Settings of a metric that has the term."""
    return HEAVY if ALL[name] in COMPLIANT else CLOSURE


def value(name: str, g: Grasp) -> float:
    """The exact value of a term."""
    return float(ALL[name].value(g, Exact()))


# --- derivatives ---------------------------------------------------------------------------------------------------


def only(name: str, settings: Settings, seed: int):
    """The penalty objective reduced to one term of weight 1: oracle, point, parameters."""
    functions, problem = oracle(settings, "penalty"), posed(settings)
    start, x = random_point(problem, functions.nlp, seed)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    p[block(functions.nlp.parameters, "weights")] = [term.name == name for term in problem.terms]
    return functions, x, p


@cache
def gradients_by_differences(settings: Settings, seed: int) -> np.ndarray:
    """∂terms/∂x (T, nx) of all terms at once."""
    functions, x, p = only("sp", settings, seed)
    return jacobian(lambda y: np.array(functions.terms(y, p)).ravel(), x)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", NAMES)
def test_the_gradient_of_a_term_matches_differences(name, seed):
    functions, x, p = only(name, settings_of(name), seed)
    f, g = functions.gradient(x, p)
    row = [term.name for term in functions.nlp.terms_used].index(name)
    expected = gradients_by_differences(settings_of(name), seed)[row]
    np.testing.assert_allclose(ENERGY_UNIT * np.array(g).ravel(), expected, atol=1e-6 * np.abs(expected).max())
    assert ENERGY_UNIT * float(f) == pytest.approx(float(functions.terms(x, p)[row]), rel=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_the_hessian_of_a_term_matches_differences_of_its_gradient(name):
    functions, x, p = only(name, settings_of(name), SEEDS[0])
    H = np.array(functions.hessian(x, p, 1.0, np.zeros(sum(functions.nlp.row_sizes))))
    H = H + np.triu(H, 1).T
    assert_jacobian(lambda y: np.array(functions.gradient(y, p)[1]).ravel(), H, x, 1e-6, floor=1e-6)


def test_the_derivatives_of_the_printed_uncertainty_match_differences():
    functions, x, p = only("uncer", DENSITY, 0)
    g = functions.gradient(x, p)[1]
    H = np.array(functions.hessian(x, p, 1.0, np.zeros(sum(functions.nlp.row_sizes))))
    assert_jacobian(lambda y: float(functions.objective(y, p)), g, x)
    assert_jacobian(lambda y: np.array(functions.gradient(y, p)[1]).ravel(), H + np.triu(H, 1).T, x)


# --- values --------------------------------------------------------------------------------------------------------


def log_margin(force: np.ndarray, normal: np.ndarray, friction: float) -> float:
    """log(1 + ε): of one finger."""
    cosine = -force @ normal / np.sqrt(force @ force)
    return np.log(1 + cosine - np.cos(np.arctan(friction)))


def prominence(g: Grasp, share: bool) -> float:
    """Mean density on the path less that at the contact, finger by finger."""
    total, K = 0.0, g.path_samples

    def normal_density(d: float, s: float) -> float:
        return np.exp(-0.5 * (d / s) ** 2) / np.sqrt(2 * np.pi * s**2)

    for i, (d, s) in enumerate(zip(g.gaps, g.contact_deviations, strict=True)):
        path = [normal_density(g.path_gaps[i * K + j], g.path_deviations[i * K + j]) for j in range(K)]
        scale = sum(path) + FAINT_DENSITY if share else 1.0
        total += (sum(path) / K - normal_density(d, s)) / scale
    return total


def penetration(g: Grasp) -> float:
    pads = [g.pad_clearances, g.pad_heights]
    clearances = np.concatenate([g.pair_clearances, g.object_clearances, g.table_clearances, *pads])
    return float(-clearances[clearances < 0].sum())


FORMULAS = {
    "sp": lambda g: (
        -sum(
            log_margin(f, n, g.friction) + log_margin(f_eq, g.rotation @ n, g.friction)
            for f, f_eq, n in zip(g.forces, g.forces_eq, g.normals, strict=True)
        )
    ),
    "dist": lambda g: sum(abs(d) for d in g.gaps),
    "uncer": lambda g: prominence(g, share=True),
    "gain": lambda g: sum(g.gains),
    "tar": lambda g: sum(g.target_means),
    "col": lambda g: 1e4 * penetration(g),
    "reg_joints": lambda g: sum((q - r) ** 2 for q, r in zip(g.joints, g.reference, strict=True)),
    "reg_motion": lambda g: sum(np.linalg.norm(p - e) ** 2 for p, e in zip(g.contacts, g.contacts_eq, strict=True)),
    "force": lambda g: -sum(min(g.force_min, np.linalg.norm(f)) for f in g.forces_eq),
    "pose": lambda g: sum(np.linalg.norm(desired(p) - e) for p, e in zip(g.contacts, g.contacts_eq, strict=True)),
    "stability": lambda g: -np.log(g.stiffness / 0.01),
    "closure": lambda g: sum(np.linalg.norm(row) for row in net_wrench(g)),
    "deviation": lambda g: sum(g.contact_deviations),
}


def desired(p: np.ndarray) -> np.ndarray:
    """Where a contact is to be at equilibrium."""
    com = posed(HEAVY).com
    return Rotation.from_rotvec(TURN).apply(p - com) + com + DISPLACEMENT


def net_wrench(g: Grasp) -> tuple[np.ndarray, np.ndarray]:
    """Net force and torque about the centre of mass of the springs and the weight at first contact."""
    force, torque, com = np.array([0, 0, -0.2 * GRAVITY]), np.zeros(3), posed(HEAVY).com
    for k, p, o in zip(g.gains, g.contacts, g.targets, strict=True):
        force, torque = force + k * (o - p), torque + np.cross(p - com, k * (o - p))
    return force, torque


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", NAMES)
def test_the_exact_value_of_a_term_is_that_of_its_equation(name, seed):
    g = random_grasp(HEAVY, seed)
    assert value(name, g) == pytest.approx(FORMULAS[name](g), rel=1e-12)


def test_the_printed_uncertainty_is_the_mean_density_on_the_path_less_that_at_the_contact():
    g = random_grasp(DENSITY, 0)
    assert value("uncer", g) == pytest.approx(prominence(g, share=False), rel=1e-12)


@pytest.mark.parametrize("metric", ["spring", "closure"])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_smooth_terms_tend_to_the_exact_ones(seed, metric):
    settings = replace(HEAVY, smoothing=SHARP, contact=replace(HEAVY.contact, metric=metric))
    problem, functions = posed(settings), oracle(settings, "penalty")
    start, x = random_point(problem, functions.nlp, seed)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    p[block(functions.nlp.parameters, "foot")] = 1.0  # the gap that the exact grasp has
    g = exact_grasp(problem, start, x)
    exact = [term.value(g, Exact()) for term in functions.nlp.terms_used]
    np.testing.assert_allclose(np.array(functions.terms(x, p)).ravel(), exact, rtol=1e-4, atol=1e-6)


def test_the_arm_is_near_its_home_and_near_its_pregrasp_at_the_ends_of_the_way():
    q, home, standoff, lift = np.random.default_rng(0).normal(size=(4, 7))
    g = SimpleNamespace(arm=SimpleNamespace(joints=q, home=home, standoff=standoff, lift=lift))
    expected = ((q - home) ** 2).sum() + ((standoff - q) ** 2).sum() + ((lift - q) ** 2).sum()
    assert Arm().value(g, Exact()) == pytest.approx(expected)


def test_every_term_has_a_weight_and_every_weight_a_term():
    settings = {term.setting for term in (*ALL.values(), Closing(), Arm())}
    assert settings == {field.name for field in fields(Weights)}
    assert len({type(term) for term in ALL.values()}) == len(NAMES)


def test_the_energy_is_the_sum_of_its_weighted_terms():
    weights = Weights(sp=3.0, dist=5.0, uncer=7.0, gain=11.0, tar=13.0, col=17.0, reg=19.0, force=23.0, stability=29.0)
    settings = replace(HEAVY, weights=weights)
    problem, functions = posed(settings), oracle(settings, "penalty")
    start, x = random_point(problem, functions.nlp, 0)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    names = [term.name for term in functions.nlp.terms_used]
    smooth = dict(zip(names, np.array(functions.terms(x, p)).ravel(), strict=True))
    used = functions.nlp.terms_used
    expected = sum(getattr(weights, term.setting) * smooth[term.name] for term in used)
    assert ENERGY_UNIT * float(functions.objective(x, p)) == pytest.approx(expected, rel=1e-12)


def test_a_weight_of_the_pose_term_replaces_the_motion_term():
    assert weights_of(SMALL)["reg_motion"] == SMALL.weights.reg
    lifted = weights_of(replace(SMALL, weights=replace(SMALL.weights, pose=2.0)))
    assert lifted["reg_motion"] == 0.0
    assert lifted["pose"] == 2.0
    assert lifted["reg_joints"] == SMALL.weights.reg


def weights_of(settings: Settings) -> dict[str, float]:
    """The weight of each term of a plan."""
    return {term.name: term.weight for term in posed(settings).terms}


def test_a_metric_has_its_own_terms_and_those_of_every_grasp():
    spring, closure = (
        {name for name, weight in weights_of(s).items() if weight > 0}
        for s in (replace(HEAVY, weights=Weights(pose=1.0)), CLOSURE)
    )
    assert closure == {"closure", "deviation", "dist", "col", "reg_joints"}
    assert spring == set(NAMES) - {"closure", "deviation", "reg_motion"}
    assert {t.name for t in oracle(CLOSURE, "penalty").nlp.terms_used} == closure
    assert weights_of(CLOSURE)["deviation"] == CLOSURE.weights.uncer


def test_without_a_weight_nothing_is_desired_but_that_the_contacts_stay():
    g = random_grasp(replace(HEAVY, weights=SMALL.weights), 0)
    np.testing.assert_allclose(g.contacts_desired, g.contacts, atol=1e-15)
    np.testing.assert_array_equal(g.rotation_desired, np.eye(3))


# --- what each term rewards -----------------------------------------------------------------------------------------


@pytest.fixture
def g() -> Grasp:
    return random_grasp(HEAVY, 0)


def pressing(g: Grasp, normals: np.ndarray, angle_deg: float = 0.0) -> Grasp:
    """The grasp with every force of 5 N at an angle to the inward normal, in both states."""
    side = np.cross(normals, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    angle = np.radians(angle_deg)
    forces = 5 * (-np.cos(angle) * normals + np.sin(angle) * side)
    return replace(g, forces=forces, forces_eq=forces, normals=normals, normals_eq=normals)


def test_margins_have_the_documented_range_and_are_zero_on_the_cone(g):
    cone = np.degrees(np.arctan(g.friction))
    c = 1 / np.sqrt(1 + g.friction**2)
    for angle, expected in ((0, 1 - c), (cone, 0.0), (180, -1 - c)):
        tilted = pressing(g, g.normals, angle)
        np.testing.assert_allclose(margins(tilted.forces, tilted.normals, g.friction, Exact()), expected, atol=1e-12)


def test_the_margin_does_not_depend_on_the_size_of_the_force(g):
    one, ten = (margins(f * g.forces, g.normals, g.friction, Exact()) for f in (1.0, 10.0))
    np.testing.assert_allclose(one, ten, rtol=1e-12)


def test_pulling_raises_the_spring_term_in_either_state_and_pressing_straight_is_best(g):
    best = value("sp", pressing(g, g.normals))
    assert all(value("sp", pressing(g, g.normals, a)) > best for a in (20, 60, 100, 179))
    assert value("sp", pressing(g, g.normals, 179)) > value("sp", pressing(g, g.normals, 100))
    pulled = pressing(g, g.normals, 120)
    for state in ("forces", "forces_eq"):
        assert value("sp", replace(pressing(g, g.normals), **{state: getattr(pulled, state)})) > best


def test_distance_counts_alike_in_and_out_of_the_surface_and_is_zero_on_it(g):
    assert value("dist", replace(g, gaps=np.zeros(4))) == 0
    assert value("dist", replace(g, gaps=np.full(4, 1e-3))) == value("dist", replace(g, gaps=np.full(4, -1e-3))) > 0


def test_uncertainty_falls_where_the_contact_is_likelier_than_the_rest_of_the_path(g):
    sure = replace(g, gaps=np.zeros(4), contact_deviations=np.full(4, 1e-3))
    assert value("uncer", sure) < value("uncer", replace(sure, gaps=np.full(4, 5e-3)))
    assert value("uncer", sure) < value("uncer", replace(sure, contact_deviations=np.full(4, 5e-3)))


def test_softer_springs_cost_less(g):
    assert value("gain", replace(g, gains=0.5 * g.gains)) < value("gain", g)


def test_deeper_targets_cost_less(g):
    assert value("tar", replace(g, target_means=g.target_means - 0.01)) < value("tar", g)


CLEARANCES = ("pair_clearances", "object_clearances", "table_clearances", "pad_clearances", "pad_heights")


@pytest.mark.parametrize("which", CLEARANCES)
def test_penetration_raises_the_collision_term_with_its_slope_and_clearance_does_not(g, which):
    free = replace(g, **{name: np.full(3, 0.01) for name in CLEARANCES})
    assert value("col", free) == 0
    depths = [value("col", replace(free, **{which: np.array([0.01, -depth, 0.02])})) for depth in (1e-3, 2e-3)]
    np.testing.assert_allclose(depths, [SLOPE * 1e-3, SLOPE * 2e-3])


def test_leaving_the_reference_pose_costs_more(g):
    assert value("reg_joints", replace(g, joints=g.reference)) == 0
    assert value("reg_joints", g) > 0


def test_motion_costs_more_and_the_desired_lift_costs_nothing_in_the_pose_term(g):
    still, lifted = replace(g, contacts_eq=g.contacts), replace(g, contacts_eq=g.contacts_desired)
    assert value("reg_motion", still) == 0 < value("reg_motion", lifted)
    assert value("pose", lifted) < 1e-9 < value("pose", still)
    sunk = replace(g, contacts_eq=2 * g.contacts - g.contacts_desired)
    assert value("pose", sunk) > value("pose", still)


def test_balanced_forces_cost_nothing_and_what_is_left_over_its_size(g):
    assert value("closure", replace(g, wrench=np.zeros((2, 3)))) < 1e-9
    left = np.array([[3.0, 0.0, 4.0], [0.0, 0.3, 0.4]])
    assert value("closure", replace(g, wrench=left)) == pytest.approx(5.5)


def test_surely_known_contacts_cost_less(g):
    assert value("deviation", replace(g, contact_deviations=np.full(4, 1e-3))) == pytest.approx(4e-3)


def test_more_force_lowers_the_force_term_up_to_the_least_force_and_no_further(g):
    forces = np.tile([0.0, 0.0, 1.0], (4, 1))
    levels = [value("force", replace(g, forces_eq=f * forces)) for f in (0.5, 1.0, g.force_min, 3 * g.force_min)]
    np.testing.assert_allclose(levels, [-2.0, -4.0, -4 * g.force_min, -4 * g.force_min])


def test_a_stiffer_equilibrium_lowers_the_stability_term(g):
    assert value("stability", replace(g, stiffness=0.2)) < value("stability", replace(g, stiffness=0.1))


def test_the_closing_term_is_the_squared_motion_of_the_joints_to_first_contact():
    g = random_grasp(SMALL, 0)
    bent = replace(g, joints_contact=g.joints + np.arange(len(g.joints)) / 10)
    term = Closing(weight=2.0)
    assert term.value(g, Exact()) == 0.0
    assert term.value(bent, Exact()) == pytest.approx(sum((i / 10) ** 2 for i in range(len(g.joints))))
    names = [term.name for term in preset_terms(REACHING)]
    assert names == [*(term.name for term in preset_terms(SMALL)), "closing"]
