"""The phases of an experiment by themselves: rest, the course of the lift, the force of a push, and settling."""

import copy
from dataclasses import replace
from itertools import accumulate, pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from readings import REST, SETTINGS, moved, turn

from sgnlp.base.errors import InputError
from sgnlp.simulation import protocol
from sgnlp.simulation.protocol import AXES, REST_SPEED, REST_TURN, Experiment, calm, settled
from sgnlp.simulation.settings import SAMPLE
from sgnlp.simulation.world import ARM_INERTIA

QUIET = 20
"""Samples on end that must be slow."""
SPEED, SPIN = 1e-3 * SAMPLE, 2e-2 * SAMPLE
"""What is at rest moves and turns by less than this in a sample [m], [rad]."""


class State:
    """What the phases write into MuJoCo's data. A copy is a state of its own, as MuJoCo's is."""

    def __init__(self):
        self.qfrc_applied, self.xfrc_applied = np.zeros(4), np.zeros((3, 6))
        self.steps = 0

    def __copy__(self):
        return copy.deepcopy(self)


def played(readings=None, ramp=0.0, **settings) -> Experiment:
    """An experiment without a simulator: its samples are the readings, or what was applied when they were taken."""
    run = Experiment.__new__(Experiment)
    run.ramp, run.route = ramp, None
    run.settings = replace(SETTINGS, **settings)
    run.data, run.forgotten = State(), 0
    run.world = SimpleNamespace(carrier_speeds=[2], object_body=1)
    run.recorder = SimpleNamespace(forget=lambda: setattr(run, "forgotten", run.forgotten + 1))
    rest = iter(readings or [])

    def advance(phase):
        run.data.steps += 1
        return next(rest) if readings else (phase, run.data.qfrc_applied.copy(), run.data.xfrc_applied.copy())

    run._advance = advance
    return run


# --- settings --------------------------------------------------------------------------------------------------------


def test_a_contact_stiffer_than_two_steps_is_refused_and_one_of_two_steps_is_not():
    assert replace(SETTINGS, timestep=0.002, contact_time=0.004).contact_time == 0.004
    with pytest.raises(InputError, match=r"--simulation.contact-time must be at least 2 times .*, 0.004, not 0.0039"):
        replace(SETTINGS, timestep=0.002, contact_time=0.0039)
    assert replace(SETTINGS, timestep=0.001, contact_time=0.0039).timestep == 0.001


def test_a_time_step_that_does_not_make_whole_samples_is_refused():
    assert [replace(SETTINGS, timestep=SAMPLE / n).timestep for n in (5, 6, 7, 10, 11, 1000)]
    with pytest.raises(InputError, match=r"--simulation.timestep must be 0.01 s over a whole number, not 0.0015"):
        replace(SETTINGS, timestep=0.0015)


# --- rest ------------------------------------------------------------------------------------------------------------


def walk(count: int, *shift: float) -> list:
    """As many steps of the object of a shift each [m]."""
    return [moved(REST, *(i * np.array(shift))) for i in range(count + 1)]


def test_rest_is_as_many_slow_samples_on_end_and_no_fewer():
    slow = 0.9 * SPEED
    assert calm(walk(QUIET, slow, 0.0, 0.0))
    assert not calm(walk(QUIET - 1, slow, 0.0, 0.0))
    assert not calm([])
    assert not calm(walk(QUIET, 0.8 * SPEED, 0.0, 0.8 * SPEED))


def test_only_the_last_samples_count():
    jump = [moved(REST, 0.1, 0.0, 0.0)]
    assert calm([*jump, *walk(QUIET, 0.0, 0.0, 0.0)])
    assert not calm([*jump, *walk(QUIET - 1, 0.0, 0.0, 0.0)])


def test_a_tip_that_moves_is_no_rest():
    def drift(step):
        return [replace(REST, tips=np.add(REST.tips, [[0, 0, 0], [0, i * step, 0]])) for i in range(QUIET + 1)]

    assert calm(drift(0.9 * SPEED))
    assert not calm(drift(1.1 * SPEED))


def test_an_object_that_spins_on_the_spot_is_no_rest():
    def spinning(step):
        return [replace(REST, rotation=turn(0.0, 0.0, i * step)) for i in range(QUIET + 1)]

    assert calm(spinning(0.9 * SPIN))
    assert not calm(spinning(1.1 * SPIN))


def test_closing_ends_when_all_has_been_slow_for_long_enough_and_not_at_a_slow_start():
    start = walk(QUIET - 1, 0.0, 0.0, 0.0)  # springs that pull an inert hand begin slowly
    swing = [moved(REST, 0.1 * i, 0.0, 0.0) for i in range(1, 6)]
    rest = [swing[-1]] * 100
    taken = list(played([*start, *swing, *rest]).close())
    assert len(taken) == len(start) + len(swing) + QUIET
    assert calm(taken)


def test_closing_ends_with_the_longest_wait_where_nothing_rests():
    assert len(list(played(walk(200, 0.1, 0.0, 0.0), close_time=1.5).close())) == 150


@pytest.mark.parametrize("ramp", [0.0, 0.3, 0.305])
def test_rest_is_looked_for_from_the_end_of_the_ramp_on_and_the_longest_wait_counts_from_there(ramp):
    ramped = int(np.ceil(100 * ramp))
    still = [REST] * 1000  # a hand whose setpoints have not yet pulled it away
    assert len(list(played(still, ramp=ramp).close())) == max(ramped, 1) + QUIET
    assert len(list(played(walk(999, 0.1, 0.0, 0.0), ramp=ramp, close_time=1.5).close())) == ramped + 150


# --- lift and hold ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lift_time", [0.4, 1.0, 2.5])
@pytest.mark.parametrize("lift_height", [0.02, 0.05])
def test_the_wrist_rises_by_the_height_in_the_time_and_stands_at_both_ends(lift_time, lift_height):
    run = played(lift_time=lift_time, lift_height=lift_height)
    forces = np.array([applied for _, applied, _ in run.lift()])
    assert not forces[:, [0, 1, 3]].any()
    speeds = [0.0, *accumulate(forces[:, 2] / ARM_INERTIA * SAMPLE)]
    heights = [0.0, *accumulate(SAMPLE * (a + b) / 2 for a, b in pairwise(speeds))]
    s = np.linspace(0, 1, round(lift_time / SAMPLE) + 1)
    np.testing.assert_allclose(heights, lift_height * (10 * s**3 - 15 * s**4 + 6 * s**5), atol=2e-3 * lift_height)
    assert speeds[-1] == pytest.approx(0.0, abs=1e-12)
    assert not run.data.qfrc_applied.any()  # in the hold nothing pulls


def test_the_hold_lasts_its_time_and_nothing_is_applied():
    held = list(played(hold_time=0.3).hold())
    assert [phase for phase, *_ in held] == ["hold"] * 30
    assert not np.concatenate([np.ravel(applied) for _, *both in held for applied in both]).any()


# --- pushes ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", AXES)
def test_a_push_is_so_many_weights_of_the_object_along_its_axis_for_its_time(direction):
    run = played(push_weights=0.5, mass=0.4, push_time=0.25)
    pushed = list(run.push(direction))
    sign, axis = {"+": 1, "-": -1}[direction[0]], "xyz".index(direction[1])
    expected = np.zeros((3, 6))
    expected[1, axis] = sign * 0.5 * 0.4 * 9.81
    assert [phase for phase, *_ in pushed] == [f"push {direction}"] * 25
    for _, _, force in pushed:
        np.testing.assert_allclose(force, expected)


@pytest.mark.parametrize("samples", [1, 100])
def test_after_a_push_that_ends_or_is_given_up_the_state_is_that_before(samples):
    run = played()
    run.data.steps = 7
    pushed = run.push("+x")
    for _ in zip(range(samples), pushed, strict=False):
        pass
    pushed.close()
    assert run.data.steps == 7
    assert not run.data.xfrc_applied.any()
    assert run.forgotten == 1


# --- settling --------------------------------------------------------------------------------------------------------


def samples_until_settled(monkeypatch, speeds) -> int:
    """The samples taken of an object whose six speeds are given sample by sample; the last one stays."""
    mujoco = pytest.importorskip("mujoco")
    data, taken = SimpleNamespace(qvel=np.zeros(6), qpos=np.zeros(7)), []

    def step(model, data, steps):
        taken.append(steps)
        data.qvel = np.array(speeds[min(len(taken), len(speeds)) - 1])

    monkeypatch.setattr(mujoco, "MjData", lambda model: data)
    monkeypatch.setattr(mujoco, "mj_step", step)
    monkeypatch.setattr(protocol, "object_alone", lambda body, settings, obstacles: None)
    settled(None, SETTINGS)
    assert set(taken) == {round(SAMPLE / SETTINGS.timestep)}
    return len(taken)


STILL = np.zeros(6)


@pytest.mark.parametrize(
    ("speed", "rests"),
    [
        ([0.9 * REST_SPEED, 0, 0, 0, 0, 0.9 * REST_TURN], True),
        ([0, 1.1 * REST_SPEED, 0, 0, 0, 0], False),
        ([0, 0, 0, 0, 0, 1.1 * REST_TURN], False),
    ],
    ids=["slow", "slides", "spins"],
)
def test_the_object_rests_when_it_neither_slides_nor_spins(monkeypatch, speed, rests):
    assert samples_until_settled(monkeypatch, [speed]) == (QUIET if rests else 300)


def test_an_object_that_moves_again_is_waited_for_again(monkeypatch):
    speeds = [STILL] * (QUIET - 1) + [np.ones(6)] + [STILL]
    assert samples_until_settled(monkeypatch, speeds) == 2 * QUIET
