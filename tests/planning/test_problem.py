"""The posed problem: bounds, parameters and what the program is told of the settings."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import SMALL, block, hand, observation, posed, unbuilt, with_settings
from views import EYES, MIDDLE, ball

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Limits, Weights
from sgnlp.planning.problem import build_problem, place_error
from sgnlp.planning.starts import starts
from sgnlp.program.formulations import formulation


@pytest.fixture
def problem():
    return posed(SMALL)


@pytest.fixture
def nlp(problem):
    return unbuilt(problem)


def test_a_hand_is_given_by_name_or_loaded(problem):
    assert build_problem(observation(), "allegro_left", SMALL).hand.name == problem.hand.name == "allegro_left"
    assert problem.hand is hand()
    with pytest.raises(InputError, match=r"unknown hand 'claw'; valid: .*allegro_left"):
        build_problem(observation(), "claw", SMALL)


def test_the_same_seed_fits_the_same_surface(problem):
    again, other = (build_problem(observation(), hand(), SMALL, seed) for seed in (0, 1))
    np.testing.assert_array_equal(again.gpis.alpha, problem.gpis.alpha)
    assert not np.array_equal(other.gpis.X, problem.gpis.X)


def test_box_and_centre_of_mass_are_those_of_the_cloud(problem):
    np.testing.assert_array_equal(problem.box[0], observation().points.min(axis=0))
    np.testing.assert_array_equal(problem.box[1], observation().points.max(axis=0))
    np.testing.assert_allclose(problem.com, problem.box.mean(axis=0))


def test_with_free_space_the_centre_of_mass_is_that_of_the_surface():
    one = ball(EYES[:1])
    known = build_problem(one, hand(), SMALL)
    unknown = build_problem(replace(one, camera_positions=None), hand(), SMALL)
    off, middle_off = (np.linalg.norm(posed.com - MIDDLE) for posed in (known, unknown))
    assert off < 0.5 * middle_off
    np.testing.assert_allclose(unknown.com, unknown.box.mean(axis=0))
    assert known.gpis.free_space
    assert not unknown.gpis.free_space


def test_without_cameras_less_is_asked_of_the_gaps_and_the_settings_stay():
    wide = replace(
        SMALL,
        limits=replace(SMALL.limits, place_error=0.016),
        closing=replace(SMALL.closing, planned=True, margin=0.008),
    )
    wider = replace(wide, limits=replace(wide.limits, place_error=0.024))
    one = ball(EYES[:1])
    alone = replace(one, camera_positions=None)
    unused = replace(wide, free_space=replace(wide.free_space, used=False))
    cases = (
        (one, wide, 0.016, 0.008),
        (alone, wide, 0.01, 0.002),
        (alone, wider, 0.01, 0.002),
        (alone, unused, 0.016, 0.008),
    )
    for cloud, settings, gap, margin in cases:
        built = build_problem(cloud, hand(), settings)
        lower = {constraint.name: constraint.lower for constraint in built.constraints}
        assert lower["pads_object"] == lower["object"] == pytest.approx(gap)
        assert lower["object_contact"] == lower["table_contact"] == pytest.approx(margin)
        assert built.settings == settings


@pytest.mark.parametrize(("name", "gap"), [("allegro_left", 0.024), ("dlr_hit_right", 0.016)])
def test_a_hand_whose_fingers_have_few_joints_keeps_a_smaller_gap(name, gap):
    limits = replace(SMALL.limits, place_error=0.024)
    built = build_problem(ball(EYES[:1]), name, replace(SMALL, limits=limits))
    lower = {constraint.name: constraint.lower for constraint in built.constraints}
    assert lower["pads_object"] == lower["object"] == pytest.approx(gap)
    assert place_error(replace(limits, place_error=0.01), tight=True) == 0.01
    assert place_error(replace(limits, place_error_tight=0.03), tight=True) == 0.024
    assert built.settings.limits == limits


def test_the_bounds_of_the_variables_are_the_joint_limits_the_gains_and_a_cube_in_the_models_ball(problem, nlp):
    joints = hand().reference
    low, high = (bound * nlp.units for bound in problem.variable_bounds(nlp, joints))
    n, m, limits = len(joints), len(hand().fingers), SMALL.limits
    np.testing.assert_allclose(joints + low[6 : 6 + n], hand().lower)
    np.testing.assert_allclose(joints + high[6 : 6 + n], hand().upper)
    np.testing.assert_allclose([-low[:3], high[:3]], limits.wrist_travel)
    np.testing.assert_allclose(low[-m:], limits.gain_min)
    np.testing.assert_allclose(high[-m:], limits.gain_max)
    for corner in (low, high):
        offsets = corner[6 + n : -m].reshape(m, 3) - problem.gpis.centre
        np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), problem.gpis.radius)  # its corners, on the ball
        np.testing.assert_allclose(np.abs(offsets), problem.gpis.radius / np.sqrt(3))
    assert (low < high).all()


def test_the_wrist_may_turn_by_nearly_half_a_turn_and_no_further(problem):
    """In a tangent space each turn by less than π is one vector, and longer vectors are turns already counted."""
    low, high = problem.variable_bounds(unbuilt(problem), hand().reference)
    farthest = [np.linalg.norm(bound[3:6]) for bound in (low, high)]
    assert max(farthest) < np.pi
    assert min(farthest) > 0.98 * np.pi


def test_without_a_weight_no_motion_is_desired_whatever_the_settings_say(problem):
    contact = replace(SMALL.contact, displacement=(0.01, 0.02, 0.03), rotation=(0.1, 0.2, 0.3))
    still = with_settings(problem, replace(SMALL, contact=contact)).numbers()
    np.testing.assert_array_equal(still["displacement"], np.zeros(3))
    np.testing.assert_array_equal(still["rotation_desired"], np.eye(3))


@pytest.mark.parametrize("field", ["gain_min", "gain_max", "wrist_travel"])
def test_the_limits_of_the_settings_move_the_bounds(problem, nlp, field):
    limits = Limits(
        **vars(SMALL.limits) | {field: getattr(SMALL.limits, field) * (0.9 if field == "gain_max" else 1.1)}
    )
    moved = with_settings(problem, replace(SMALL, limits=limits))
    before, after = (np.concatenate(p.variable_bounds(nlp, hand().reference)) for p in (problem, moved))
    assert not np.array_equal(before, after)


def test_every_parameter_is_the_setting_of_its_name(problem, nlp):
    start = starts(problem, 1, 0)[0]
    p = problem.parameters(nlp, start.wrist, start.joints)

    def values(name: str) -> np.ndarray:
        return p[block(nlp.parameters, name)]

    s = SMALL
    expected = {
        "wrist": start.wrist,
        "joints": start.joints,
        "weights": problem.weights(),
        "c": s.contact.c,
        "friction": s.contact.friction,
        "pad": 1.0,
        "foot": 0.0,
        "force_min": s.limits.force_min,
        "displacement": np.zeros(3),
        "rotation_desired": np.eye(3).ravel(),
        "mass": s.contact.mass,
        "com": problem.com,
        "table": observation().table_height,
        "ball_centre": problem.gpis.centre,
        "ball_radius": problem.gpis.radius,
        "standoff": s.motion.standoff,
        "lift": s.motion.lift,
        "distance": s.smoothing.distance,
        "collision": s.smoothing.collision,
        "log_width": s.smoothing.log,
        "force": s.smoothing.force,
        "deviation": s.smoothing.deviation,
        "exponent": s.smoothing.exponent,
    }
    assert expected.keys() == nlp.parameters.sizes.keys()
    for name, value in expected.items():
        np.testing.assert_array_equal(values(name), np.atleast_1d(value), err_msg=name)
    assert len(p) == sum(nlp.parameters.sizes.values())


def test_the_desired_motion_of_the_object_reaches_the_program_where_it_has_a_weight(problem, nlp):
    contact = replace(SMALL.contact, displacement=(0.01, 0.02, 0.03), rotation=(0.0, 0.0, np.pi / 2))
    moved = with_settings(problem, replace(SMALL, contact=contact, weights=replace(SMALL.weights, pose=1.0)))
    start = starts(problem, 1, 0)[0]
    p = moved.parameters(nlp, start.wrist, start.joints)
    np.testing.assert_array_equal(p[block(nlp.parameters, "displacement")], contact.displacement)
    turn = p[block(nlp.parameters, "rotation_desired")].reshape(3, 3, order="F")
    np.testing.assert_allclose(turn, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


def fixed(problem, limits: Limits, heuristic: float = 0.0):
    contact = replace(SMALL.contact, heuristic=heuristic)
    return with_settings(problem, replace(SMALL, limits=limits, contact=contact)).gain_bounds()


def test_gains_are_fixed_at_a_multiple_of_the_hands_initial_ones_or_free_for_the_heuristic(problem):
    for scale in (1.0, 2.0):
        low, high = fixed(problem, replace(SMALL.limits, gain_fixed=scale))
        np.testing.assert_allclose(low, scale * hand().gain_initial)
        np.testing.assert_array_equal(low, high)
    low, high = fixed(problem, SMALL.limits, heuristic=1.6)
    np.testing.assert_array_equal([low, high], [hand().gain_lower, hand().gain_upper])
    with pytest.raises(InputError, match=r"--limits.gain-fixed leaves nothing of the hand's gains, 40 to 400 N/m"):
        fixed(problem, replace(SMALL.limits, gain_fixed=3.0))


def test_what_shapes_the_functions_is_their_structure_and_the_rest_are_parameters(problem):
    penalty, constrained, elastic = map(formulation, ("penalty", "constrained", "elastic"))
    contact = replace(SMALL.contact, samples=7, density="density", equilibrium="printed")
    structure = with_settings(problem, replace(SMALL, contact=contact)).structure(constrained)
    assert (structure.formulation, structure.samples) == (constrained, 7)
    assert (structure.density, structure.equilibrium) == ("density", "printed")
    closure = replace(SMALL, contact=replace(SMALL.contact, metric="closure"))
    assert with_settings(problem, closure).structure(penalty) != problem.structure(penalty)
    strong = with_settings(problem, replace(SMALL, limits=replace(SMALL.limits, effort=1.0)))
    assert strong.structure(constrained) != problem.structure(constrained)
    assert strong.structure(elastic).inner == strong.structure(constrained)
    contact = replace(SMALL.contact, mass=1.0, c=0.5, pad=False)
    numbers = replace(SMALL, contact=contact, limits=replace(SMALL.limits, shift=0.03), weights=Weights(tar=3.0))
    assert with_settings(problem, numbers).structure(constrained) == problem.structure(constrained)
