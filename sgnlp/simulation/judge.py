"""From the readings of an experiment to its outcome."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sgnlp.control.command import Command, check
from sgnlp.hand.hand import Hand
from sgnlp.simulation.body import Body
from sgnlp.simulation.closing import closed
from sgnlp.simulation.displacement import erred
from sgnlp.simulation.outcome import Ending, Lift, Outcome, Pregrasp, Push
from sgnlp.simulation.protocol import AXES, Experiment, angle
from sgnlp.simulation.recorder import Reading
from sgnlp.simulation.settings import SAMPLE, SimulationSettings

Array = NDArray[np.float64]

CLEAR = 5e-4
"""Least height of the lowest point over the table that counts as clear of it [m]."""
SLID_SCORE = 0.5
"""The paper's score of a grasp that lifts the object but slides."""
DEFAULTS = SimulationSettings()


def execute(command: Command, body: Body, hand: Hand, settings: SimulationSettings = DEFAULTS) -> Outcome:
    """Carry out a grasp on the true object and judge it, the hand off by the settings' errors of its place.

    The same arguments give the same bits.

    Raises:
        InputError: the command does not fit the hand, or MuJoCo refuses the hand or the mesh.
    """
    check(command, hand)
    told = erred(command, settings)
    return judge(Experiment(told, body, hand, settings), told)


def judge(experiment: Experiment, command: Command) -> Outcome:
    """Take an experiment through its phases and judge its readings; nothing here knows the simulator."""
    settings, body = experiment.settings, experiment.body
    pregrasp = _pregrasp(experiment)
    if max(pregrasp.penetration_object, pregrasp.penetration_table) > settings.max_penetration:
        return Outcome("in collision", 0.0, 0.0, pregrasp, None, None, (), experiment.recorder.trace())
    closing = _finite(experiment.close())
    lifting = _finite(experiment.lift()) if closing[-1].finite else []
    clear = bool(lifting) and lifting[-1].finite and _clearance(lifting[-1:], body) > CLEAR
    holding = _finite(experiment.hold()) if clear else []
    readings = [*closing, *lifting, *holding]
    shut = closed(experiment, closing, command) if closing[-1].finite else None
    lifted = _lift(experiment, lifting, holding, body) if lifting and readings[-1].finite else None
    ending = _ending(lifted, bool(holding), settings, settings.rise)
    strict = _ending(lifted, bool(holding), settings, settings.rise_strict)
    pushed = ending in ("held", "slid") and settings.push_weights > 0
    pushes = tuple(_push(experiment, name, holding[-1]) for name in AXES) if pushed else ()
    return Outcome(
        ending=ending,
        score=_score(ending),
        score_strict=_score(strict),
        pregrasp=pregrasp,
        closing=shut,
        lift=lifted,
        pushes=pushes,
        trace=experiment.recorder.trace(),
    )


def _finite(phase: Iterable[Reading]) -> list[Reading]:
    """The readings of a phase, up to the first that is not finite."""
    readings = []
    for reading in phase:
        readings.append(reading)
        if not reading.finite:
            break
    return readings


def _clearance(readings: list[Reading], body: Body) -> float:
    return min(reading.lowest for reading in readings) - body.table_height


def _pregrasp(experiment: Experiment) -> Pregrasp:
    begin, depth = experiment.begin, experiment.penetrations()
    return Pregrasp(
        penetration_object=depth["object"],
        penetration_table=depth["table"],
        penetration_self=depth["self"],
        settle_shift=float(np.linalg.norm(begin.centre - experiment.given)),
        settle_turn=angle(begin.rotation),
    )


def _lift(experiment: Experiment, lifting: list[Reading], holding: list[Reading], body: Body) -> Lift:
    judged = holding or lifting[-1:]
    half = holding[len(holding) // 2 :]
    creep = np.linalg.norm(half[-1].centre - half[0].centre) / ((len(half) - 1) * SAMPLE) if len(half) > 1 else None
    return Lift(
        rise=min(float(reading.centre[2]) for reading in judged) - float(experiment.begin.centre[2]),
        clearance=_clearance(judged, body),
        slip=np.sum([reading.slide for reading in [*lifting, *holding]], axis=0),
        creep=None if creep is None else float(creep),
    )


def _ending(lift: Lift | None, held: bool, settings: SimulationSettings, rise: float) -> Ending:
    if lift is None:
        return "diverged"
    if not held:
        return "not lifted"
    if lift.clearance <= CLEAR:
        return "dropped"
    if lift.rise < rise:
        return "not lifted"
    return "slid" if lift.slip.max() > settings.slip_limit else "held"


def _score(ending: Ending) -> float:
    return {"held": 1.0, "slid": SLID_SCORE}.get(ending, 0.0)


def _push(experiment: Experiment, direction: str, before: Reading) -> Push:
    readings = _finite(experiment.push(direction))
    slip = float(np.sum([reading.slide for reading in readings], axis=0).max())
    clear = readings[-1].finite and _clearance(readings, experiment.body) > CLEAR
    shift = max(float(np.linalg.norm(reading.centre - before.centre)) for reading in readings)
    return Push(direction, clear and slip <= experiment.settings.slip_limit, shift, slip)
