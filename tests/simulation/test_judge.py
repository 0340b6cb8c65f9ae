"""The judge on readings made by hand: what counts as clear, touched, lifted, slid, withstood and diverged."""

from dataclasses import replace

import numpy as np
import pytest
from readings import AIR, BEGIN, GIVEN, LIFTED, REST, SETTINGS, TABLE, TOUCHED, Played, moved, turn

from sgnlp.base.errors import InputError
from sgnlp.hand.hand import load_hand
from sgnlp.simulation import Command
from sgnlp.simulation.judge import execute, judge
from sgnlp.simulation.outcome import ARM, EARLY, OBSTACLE, THING, Knock
from sgnlp.simulation.protocol import AXES
from sgnlp.simulation.settings import SAMPLE

UNPLANNED = Command(np.zeros(7), np.zeros(16), np.zeros((2, 3)), np.zeros((2, 3)), np.ones(2))
"""A command of which nothing is expected."""
TURN = turn(0.3, -0.2, 0.4)
PLANNED = replace(UNPLANNED, forces_eq=np.array([[3.0, 0, 0], [0, 0, 2.0]]), rotation_eq=TURN, translation_eq=BEGIN)
NEAR, FAR = 4e-4, 6e-4
"""Heights over the table on either side of what counts as clear of it [m]."""


def low(height: float):
    """The lifted reading with the object's lowest point so high over the table [m]."""
    return replace(LIFTED, lowest=TABLE + height)


def slid(reading, *paths: float):
    return replace(reading, slide=np.array(paths))


def judged(command: Command = UNPLANNED, **changes):
    return judge(Played(**changes), command)


def phases(**changes) -> list[str]:
    run = Played(**changes)
    judge(run, UNPLANNED)
    return run.taken


# --- what happens ----------------------------------------------------------------------------------------------------


def test_a_grasp_that_lifts_and_holds_scores_one_and_is_pushed_six_ways():
    outcome = judged()
    assert (outcome.ending, outcome.score, outcome.score_strict, outcome.pushes_held) == ("held", 1.0, 1.0, 6)
    assert outcome.trace == "the trace"
    assert phases() == ["close", "lift", "hold", *AXES]
    assert [push.direction for push in outcome.pushes] == ["+x", "-x", "+y", "-y", "+z", "-z"]


def test_without_weight_of_pushes_there_are_none():
    none = replace(SETTINGS, push_weights=0.0)
    assert phases(settings=none) == ["close", "lift", "hold"]
    assert judged(settings=none).pushes == ()


@pytest.mark.parametrize("part", ["object", "table"])
def test_a_pregrasp_deeper_than_the_limit_is_not_carried_out(part):
    depth = SETTINGS.max_penetration
    assert judged(depth={part: depth}).ending == "held"
    outcome = judged(depth={part: depth + 1e-4})
    assert (outcome.ending, outcome.score, outcome.closing, outcome.lift) == ("in collision", 0.0, None, None)
    assert getattr(outcome.pregrasp, f"penetration_{part}") == depth + 1e-4
    assert phases(depth={part: depth + 1e-4}) == []


KNOCK = Knock("approach", OBSTACLE, "palm", "crate", 0.001, SETTINGS.collision_force)
"""A hand that hits an obstacle just hard enough to stop."""


def hitting(reading, **changes):
    return replace(reading, knocks=(replace(KNOCK, **changes),))


@pytest.mark.parametrize(
    ("phase", "last"), [("approach", REST), ("close", TOUCHED), ("lift", LIFTED), ("hold", LIFTED)]
)
def test_a_robot_that_hits_something_hard_stops_there_and_scores_nothing(phase, last):
    coming = {"approach": [REST] * 2}
    hard = coming | {phase: [last, hitting(last), last]}
    outcome = judged(**hard)
    assert (outcome.ending, outcome.score, outcome.score_strict, outcome.pushes) == ("in collision", 0.0, 0.0, ())
    assert phases(**hard)[-1] == phase
    assert (outcome.knocks, outcome.obstacles_touched) == ((KNOCK,), ("crate",))
    light = coming | {phase: [last, hitting(last, force=KNOCK.force - 0.1), *[last] * 3]}
    outcome = judged(**light)
    assert (outcome.ending, outcome.obstacles_touched, outcome.pushes_held) == ("held", ("crate",), 6)


@pytest.mark.parametrize(
    ("kind", "part", "stops"),
    [(OBSTACLE, "palm", True), (OBSTACLE, THING, False), (ARM, "elbow", True), (EARLY, "palm", False)],
)
def test_hand_and_arm_collide_but_not_what_they_are_to_touch(kind, part, stops):
    outcome = judged(approach=[hitting(REST, kind=kind, part=part, force=1e3)])
    assert (outcome.ending == "in collision") == stops
    assert outcome.obstacles_touched == (("crate",) if kind == OBSTACLE else ())


def test_of_knocks_of_the_same_parts_in_a_phase_the_deepest_and_the_hardest_is_told():
    deep, hard = hitting(REST, depth=0.004, force=1.0), hitting(REST, depth=0.001, force=3.0)
    other = hitting(TOUCHED, phase="close", depth=0.002, force=2.0)
    outcome = judged(approach=[deep, hard], close=[other, *[TOUCHED] * 3])
    told = [(knock.phase, knock.depth, knock.force) for knock in outcome.knocks]
    assert told == [("approach", 0.004, 3.0), ("close", 0.002, 2.0)]


def test_a_pregrasp_inside_an_obstacle_is_not_carried_out_and_names_what_is_deep():
    depth = SETTINGS.max_penetration
    deep, shallow = replace(KNOCK, depth=depth + 1e-4), replace(KNOCK, part="thumb", depth=depth)
    outcome = judged(depth={"obstacles": depth + 1e-4}, overlaps=(deep, shallow), approach=[REST])
    assert (outcome.ending, outcome.knocks) == ("in collision", (deep,))
    assert judged(depth={"obstacles": depth}, overlaps=(shallow,)).ending == "held"


def test_how_far_the_wrist_was_off_is_told_phase_by_phase():
    off = {"approach": [replace(REST, off=2e-4), replace(REST, off=1e-4)], "close": [replace(TOUCHED, off=3e-4)] * 3}
    lift = [replace(LIFTED, off=5e-4, strain=0.6)] * 4
    way = judged(**off, lift=lift).carriage
    assert (way.approach_off, way.closing_off, way.lift_off, way.torque_share) == (2e-4, 3e-4, 5e-4, 0.6)
    assert (way.approach_seconds, way.lift_seconds) == pytest.approx((2 * SAMPLE, 0.0))
    assert judged().carriage is None


def test_fingers_that_overlap_are_told_and_carried_out():
    outcome = judged(depth={"self": 0.01})
    assert outcome.ending == "held"
    assert outcome.pregrasp.penetration_self == 0.01


def test_how_the_object_settled_is_told_from_where_it_was_given():
    begin = replace(REST, centre=np.add(GIVEN, [0.003, 0.0, -0.004]), rotation=turn(0.0, 0.2, 0.0))
    pregrasp = judged(begin=begin).pregrasp
    assert (pregrasp.settle_shift, pregrasp.settle_turn) == pytest.approx((0.005, 0.2))


NAN = replace(LIFTED, centre=np.full(3, np.nan))
LOST = replace(LIFTED, tips=np.full((2, 3), np.inf))


@pytest.mark.parametrize("broken", [NAN, LOST], ids=["object", "tips"])
@pytest.mark.parametrize("phase", ["close", "lift", "hold"])
def test_what_diverges_scores_nothing_wherever_it_does_and_goes_no_further(phase, broken):
    changes = {phase: [LIFTED, LIFTED, broken, LIFTED]}
    outcome = judged(**changes)
    assert (outcome.ending, outcome.score, outcome.lift, outcome.pushes) == ("diverged", 0.0, None, ())
    assert (outcome.closing is None) == (phase == "close")
    assert phases(**changes)[-1] == phase


def test_a_push_that_diverges_is_not_withstood():
    outcome = judged(pushes={"+y": [LIFTED, NAN, LIFTED]})
    assert [push.direction for push in outcome.pushes if not push.held] == ["+y"]


# --- closing ---------------------------------------------------------------------------------------------------------

ONE = replace(REST, touching=np.array([True, False]))


def test_the_first_touch_of_each_pad_is_told_and_a_later_loss_does_not_matter():
    times = judged(close=[REST, ONE, REST, TOUCHED, ONE]).closing.contact_times
    np.testing.assert_allclose(times, [2 * SAMPLE, 4 * SAMPLE])


def test_a_pad_that_touches_at_the_pregrasp_touches_at_its_time():
    times = judged(begin=ONE, close=[REST, TOUCHED]).closing.contact_times
    np.testing.assert_allclose(times, [0.0, 2 * SAMPLE])


def test_the_object_moves_before_contact_until_the_last_pad_touches_and_not_after():
    pushed = replace(moved(ONE, 0.003, 0.004, 0.0), rotation=turn(0.0, 0.0, 0.1))
    at_last = replace(moved(TOUCHED, 0.006, 0.008, 0.0), rotation=turn(0.0, 0.0, 0.2))
    after = replace(moved(TOUCHED, 0.06, 0.08, 0.0), rotation=turn(0.0, 0.0, 0.9))
    closing = judged(begin=replace(REST, rotation=turn(0.0, 0.0, -0.1)), close=[pushed, at_last, after]).closing
    assert closing.shift_before_contact == pytest.approx(0.010)
    assert closing.turn_before_contact == pytest.approx(0.3)


def test_where_a_pad_never_touches_the_object_moves_before_contact_until_the_end():
    closing = judged(close=[moved(ONE, 0.001, 0.0, 0.0), moved(ONE, 0.0, 0.003, 0.004)]).closing
    assert np.isnan(closing.contact_times[1])
    assert closing.contact_times[0] == pytest.approx(SAMPLE)
    assert closing.shift_before_contact == pytest.approx(0.005)


def test_links_are_premature_that_touch_before_the_last_pad_and_no_others():
    first, second, third = replace(ONE, links={"b": 1.0}), replace(TOUCHED, links={"c": 1.0}), TOUCHED
    closing = judged(begin=replace(REST, links={"a": 1.0}), close=[first, second, replace(third, links={"d": 2.0})])
    assert closing.closing.premature == ("a", "b")
    never = judged(close=[replace(ONE, links={"z": 1.0}), replace(ONE, links={"y": 1.0}), ONE])
    assert never.closing.premature == ("y", "z")


def test_the_shift_error_is_that_of_the_centre_of_mass_under_the_planned_motion():
    planned = TURN @ GIVEN + BEGIN
    end = replace(TOUCHED, centre=np.add(planned, [0.003, -0.004, 0.0]))
    assert judged(PLANNED, close=[TOUCHED, end]).closing.shift_error == pytest.approx(0.005)


def test_the_turn_error_is_the_angle_between_simulated_and_planned_rotation():
    end = replace(TOUCHED, rotation=turn(0.0, 0.25, 0.0) @ TURN)
    closing = judged(PLANNED, close=[TOUCHED, end]).closing
    assert closing.turn_error == pytest.approx(0.25)
    np.testing.assert_array_equal(closing.rotation, end.rotation)


def test_without_a_plan_nothing_is_off_it():
    closing = judged().closing
    assert (closing.shift_error, closing.turn_error, closing.force_errors) == (None, None, None)


def test_forces_motion_and_time_are_those_of_the_last_reading_and_slip_is_summed_by_finger():
    forces = np.array([[3.0, 0.3, 0.4], [0, 0, 1.0]])
    end = replace(slid(TOUCHED, 1e-3, 0.0), forces=forces, links={"palm": 1.5, "tip": 0.25}, translation=np.ones(3))
    closing = judged(PLANNED, close=[slid(REST, 2e-3, 5e-3), end]).closing
    np.testing.assert_array_equal(closing.forces, forces)
    np.testing.assert_allclose(closing.force_errors, [0.5, 1.0])
    np.testing.assert_allclose(closing.slip, [3e-3, 5e-3])
    np.testing.assert_array_equal(closing.translation, np.ones(3))
    assert (closing.links_force, closing.seconds) == (1.75, 2 * SAMPLE)


def test_links_that_touch_at_any_time_of_closing_are_named_and_those_of_the_equilibrium_apart():
    early, late = replace(ONE, links={"c": 1.0, "a": 0.1}), replace(TOUCHED, links={"b": 2.0})
    closing = judged(close=[early, TOUCHED, late, replace(TOUCHED, links={"d": 0.5})]).closing
    assert (closing.links, closing.links_equilibrium) == (("a", "b", "c", "d"), ("d",))
    assert judged(begin=replace(REST, links={"a": 1.0}), close=[TOUCHED]).closing.links == ("a",)
    free = judged(close=[early, TOUCHED]).closing
    assert (free.links, free.links_equilibrium, free.links_force) == (("a", "c"), (), 0.0)


def test_pads_that_press_at_the_equilibrium_carry_load_from_a_twentieth_of_a_newton_on():
    def loaded(*forces):
        return judged(close=[TOUCHED, replace(TOUCHED, forces=np.array(forces))]).closing.pads_loaded

    assert loaded([0.03, 0.0, -0.041], [0.0, 0.04, 0.0]) == 1  # 0.051 N and 0.04 N
    assert loaded([0.0, 0.0, 0.0], [0.0, 0.049, 0.0]) == 0
    assert loaded([0.0, 0.0, 3.0], [-3.0, 0.0, 0.0]) == 2
    assert judged(close=[replace(TOUCHED, forces=np.ones((2, 3))), TOUCHED]).closing.pads_loaded == 0


def test_the_spread_of_the_touches_is_from_the_first_pads_to_the_last_ones_and_unknown_where_one_never_touches():
    assert judged(close=[REST, ONE, ONE, ONE, TOUCHED]).closing.contact_spread == pytest.approx(3 * SAMPLE)
    assert judged(close=[REST, TOUCHED]).closing.contact_spread == 0.0
    assert np.isnan(judged(close=[ONE, ONE]).closing.contact_spread)


def test_tip_errors_are_those_of_the_last_reading_from_the_planned_tips_at_the_equilibrium():
    planned = replace(UNPLANNED, contacts_eq=np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]))
    end = replace(TOUCHED, tips=np.add(planned.contacts_eq, [[0.003, 0.0, -0.004], [0.0, 0.002, 0.0]]))
    np.testing.assert_allclose(judged(planned, close=[TOUCHED, end]).closing.tip_errors, [0.005, 0.002])
    assert judged(close=[TOUCHED, end]).closing.tip_errors is None


def test_torques_are_told_at_the_equilibrium_and_over_the_whole_closing_and_joints_at_their_limit_counted():
    def pulled(*torques):
        return replace(TOUCHED, torques=np.array(torques))

    begin = replace(REST, torques=np.ones(3))  # before anything moves
    closing = judged(begin=begin, close=[pulled(1.0, 0.2, 0.0), pulled(0.3, 0.9989, 0.2), REST, pulled(0.5, 0.9, 1.0)])
    assert (closing.closing.torque_share, closing.closing.torque_share_closing) == (1.0, 1.0)
    assert closing.closing.joints_limited == pytest.approx(1 / 3)
    assert closing.closing.joints_limited_closing == pytest.approx(2 / 3)
    calmer = judged(begin=begin, close=[pulled(0.2, 0.8, 0.1), pulled(0.5, 0.3, 0.1)]).closing
    assert (calmer.torque_share, calmer.torque_share_closing) == (0.5, 0.8)
    assert (calmer.joints_limited, calmer.joints_limited_closing) == (0.0, 0.0)


def test_it_has_rested_if_the_last_readings_are_calm():
    assert judged(close=[TOUCHED] * 30).closing.rested
    assert not judged(close=[TOUCHED] * 5).closing.rested
    assert not judged(close=[*[TOUCHED] * 30, moved(TOUCHED, 1e-3, 0.0, 0.0)]).closing.rested


# --- lift and hold ---------------------------------------------------------------------------------------------------


def test_an_object_that_is_not_clear_of_the_table_after_the_lift_is_not_held_up():
    touching = judged(lift=[low(0.02), low(NEAR)])
    assert (touching.ending, touching.score) == ("not lifted", 0.0)
    assert touching.lift.clearance == pytest.approx(NEAR)
    assert phases(lift=[low(0.02), low(NEAR)]) == ["close", "lift"]
    assert judged(lift=[low(NEAR), low(FAR)], hold=[low(FAR)] * 3).ending == "held"


def test_an_object_that_comes_down_to_the_table_in_the_hold_is_dropped_even_if_it_is_caught():
    outcome = judged(hold=[LIFTED, low(NEAR), LIFTED])
    assert (outcome.ending, outcome.score, outcome.score_strict, outcome.pushes) == ("dropped", 0.0, 0.0, ())
    assert outcome.lift.clearance == pytest.approx(NEAR)
    assert judged(hold=[LIFTED, low(FAR), LIFTED]).ending == "held"


@pytest.mark.parametrize(
    ("least", "score", "strict"), [(0.019, 0.0, 0.0), (0.021, 1.0, 0.0), (0.039, 1.0, 0.0), (0.041, 1.0, 1.0)]
)
def test_an_object_that_sags_is_lifted_by_its_least_rise_in_the_hold(least, score, strict):
    sagged = moved(TOUCHED, 0.0, 0.0, least)
    outcome = judged(hold=[LIFTED, LIFTED, sagged, LIFTED])
    assert outcome.lift.rise == pytest.approx(least)
    assert (outcome.score, outcome.score_strict) == (score, strict)
    assert outcome.ending == ("held" if score else "not lifted")


def test_the_rise_counts_from_where_the_object_rested_and_not_from_where_it_was_given_or_closed_upon():
    outcome = judged(close=[moved(TOUCHED, 0.0, 0.0, 0.01)])
    assert outcome.lift.rise == pytest.approx(AIR)


def test_slip_is_summed_over_lift_and_hold_for_each_pad_by_itself():
    limit = SETTINGS.slip_limit
    both = {"lift": [slid(LIFTED, 0.3 * limit, 0.6 * limit)] * 2, "hold": [slid(LIFTED, 0.35 * limit, 0.0)] * 2}
    outcome = judged(**both)
    np.testing.assert_allclose(outcome.lift.slip, [1.3 * limit, 1.2 * limit])
    assert (outcome.ending, outcome.score, outcome.score_strict) == ("slid", 0.5, 0.5)
    assert len(outcome.pushes) == 6
    each = {"lift": [slid(LIFTED, 0.9 * limit, 0.0)], "hold": [slid(LIFTED, 0.0, 0.9 * limit)]}
    assert judged(**each).ending == "held"
    assert judged(close=[slid(TOUCHED, 5 * limit, 0.0)]).ending == "held"  # before the lift it may slide


def test_a_slip_in_the_hold_alone_is_a_slip():
    assert judged(hold=[LIFTED, slid(LIFTED, 0.0, 1.1 * SETTINGS.slip_limit)]).ending == "slid"


def test_creep_is_the_speed_of_the_centre_over_the_second_half_of_the_hold():
    fast, slow = [moved(LIFTED, 1e-3 * i, 0.0, 0.0) for i in range(4)], []
    slow = [moved(fast[-1], 0.0, 3e-5 * i, -4e-5 * i) for i in range(5)]
    assert judged(hold=[*fast, *slow]).lift.creep == pytest.approx(5e-5 / SAMPLE)
    assert judged(hold=[LIFTED]).lift.creep is None
    assert judged(lift=[low(0.0)]).lift.creep is None


# --- pushes ----------------------------------------------------------------------------------------------------------


def test_a_push_that_slides_a_pad_further_than_the_limit_is_not_withstood():
    step = SETTINGS.slip_limit / 2
    slides = {"+x": [slid(LIFTED, 0.9 * step, 0.0)] * 2, "-z": [slid(LIFTED, 0.0, 1.1 * step)] * 2}
    pushes = {push.direction: push for push in judged(pushes=slides).pushes}
    assert (pushes["+x"].held, pushes["-z"].held) == (True, False)
    assert (pushes["+x"].slip, pushes["-z"].slip) == pytest.approx((1.8 * step, 2.2 * step))
    assert judged(pushes=slides).pushes_held == 5


def test_a_push_that_brings_the_object_to_the_table_is_not_withstood():
    pushes = judged(pushes={"-z": [LIFTED, low(NEAR), LIFTED], "+z": [low(FAR)]}).pushes
    assert [push.direction for push in pushes if not push.held] == ["-z"]


def test_the_shift_of_a_push_is_the_farthest_from_where_the_hold_ended():
    far, back = moved(LIFTED, 0.0, 0.003, 0.004), moved(LIFTED, 0.001, 0.0, 0.0)
    outcome = judged(hold=[moved(LIFTED, 0.1, 0.0, 0.0), LIFTED], pushes={"+y": [far, back]})
    assert {push.direction: push.shift for push in outcome.pushes}["+y"] == pytest.approx(0.005)


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gains": np.array([100.0, 100.0, 0.0, 100.0])}, "gains must be positive"),
        ({"targets": np.full((4, 3), np.nan)}, r"targets must be \(4, 3\) finite numbers"),
        ({"tips": np.zeros((3, 3))}, r"tips must be \(4, 3\) finite numbers"),
        ({"joints_contact": np.zeros(4)}, r"joints_contact must be \(16,\) finite numbers"),
        ({"joints_squeeze": np.full(16, np.nan)}, r"joints_squeeze must be \(16,\) finite numbers"),
        ({"wrist": np.zeros(6)}, r"wrist must be \(7,\) finite numbers"),
    ],
)
def test_a_command_that_is_none_is_refused(changes, message):
    command = Command(np.eye(7)[6], np.zeros(16), np.zeros((4, 3)), np.zeros((4, 3)), np.full(4, 100.0))
    with pytest.raises(InputError, match=message):
        execute(replace(command, **changes), None, load_hand("allegro_left"))
