"""From the readings of an experiment to its outcome."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from sgnlp.control.command import Command
from sgnlp.hand.hand import Hand
from sgnlp.perception.shape import Shape
from sgnlp.planning.recompute import rotation_angle
from sgnlp.simulation.body import Body
from sgnlp.simulation.closing import closed
from sgnlp.simulation.outcome import Carriage, Ending, Knock, Lift, Outcome, Pregrasp, Push
from sgnlp.simulation.prepared import prepared
from sgnlp.simulation.protocol import AXES, Experiment
from sgnlp.simulation.recorder import Reading
from sgnlp.simulation.route import Moving
from sgnlp.simulation.settings import SAMPLE, SimulationSettings

CLEAR = 5e-4
"""Least height of the lowest point over the table that counts as clear of it [m]."""
SLID_SCORE = 0.5
"""The paper's score of a grasp that lifts the object but slides."""
DEFAULTS = SimulationSettings()


def execute(
    command: Command,
    body: Body,
    hand: Hand,
    settings: SimulationSettings = DEFAULTS,
    obstacles: Sequence[Shape] = (),
    motion: Moving | None = None,
) -> Outcome:
    """Carry out a grasp on the true object and judge it, with the hand displaced by the settings' errors.

    `obstacles` are fixed around the object. With a `motion`, such as a `Trajectory`, the hand follows it from the
    stand-off to the lift, on its arm if it has one. Without a motion it floats at the pregrasp and rises by the
    settings. The same arguments give the same bits.

    Args:
        command: the grasp, as `sgnlp.control.command` makes it.
        body: the true object, in the world frame.
        hand: the hand, on its arm if it has one.
        settings: mass, friction, control, phases and judgement.
        obstacles: shapes in the world frame.
        motion: samples of the wrist pose and of the arm's joints.

    Raises:
        InputError: the command does not fit the hand or the motion, or MuJoCo refuses the hand, its arm or the mesh.
    """
    told = prepared(command, hand, settings, motion)
    return judge(Experiment(told.command, body, told.hand, settings, obstacles, told.route), told.command)


def judge(experiment: Experiment, command: Command) -> Outcome:
    """Take an experiment through its phases and judge its readings; nothing here knows the simulator."""
    settings, body = experiment.settings, experiment.body
    pregrasp, depth = _pregrasp(experiment), settings.max_penetration
    inside = (pregrasp.penetration_object, pregrasp.penetration_table, pregrasp.penetration_obstacles)
    if max(inside) > depth:
        deep = tuple(knock for knock in experiment.overlaps() if knock.depth > depth)
        return Outcome("in collision", 0.0, 0.0, pregrasp, None, None, (), experiment.recorder.trace(), deep)
    force = settings.collision_force
    coming = _finite(experiment.approach(), force)
    closing = _finite(experiment.close(), force) if _goes_on(coming, force) else []
    lifting = _finite(experiment.lift(), force) if closing and _goes_on(closing, force) else []
    clear = bool(lifting) and _goes_on(lifting, force) and _clearance(lifting[-1:], body) > CLEAR
    holding = _finite(experiment.hold(), force) if clear else []
    readings = [*closing, *lifting, *holding]
    shut = closed(experiment, closing, command) if closing and closing[-1].finite else None
    lifted = _lift(experiment, lifting, holding, body) if lifting and readings[-1].finite else None
    hit = any(_collided(reading, force) for reading in (*coming, *readings))
    ending, strict = (
        "in collision" if hit else _ending(lifted, bool(holding), settings, rise)
        for rise in (settings.rise, settings.rise_strict)
    )
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
        knocks=worst([*coming, *readings]),
        carriage=_carriage(coming, closing, [*lifting, *holding]) if coming else None,
    )


def _goes_on(readings: list[Reading], force: float) -> bool:
    """Whether the next phase begins: nothing diverged, and the robot has hit nothing at this force [N]."""
    return not readings or (readings[-1].finite and not _collided(readings[-1], force))


def _collided(reading: Reading, force: float) -> bool:
    return any(knock.collision(force) for knock in reading.knocks)


def worst(readings: Iterable[Reading]) -> tuple[Knock, ...]:
    """One knock for the same parts in a phase, with the greatest depth and force, in the order in which they began."""
    found: dict[tuple[str, ...], Knock] = {}
    for knock in (knock for reading in readings for knock in reading.knocks):
        key = knock.phase, knock.kind, knock.part, knock.hit
        before = found.get(key, knock)
        found[key] = replace(knock, depth=max(knock.depth, before.depth), force=max(knock.force, before.force))
    return tuple(found.values())


def _carriage(coming: list[Reading], closing: list[Reading], rising: list[Reading]) -> Carriage:
    spans = ([r for r in readings if r.finite] for readings in (coming, closing, rising))
    approach, shut, lift = (max((r.off for r in readings), default=0.0) for readings in spans)
    return Carriage(
        approach_seconds=len(coming) * SAMPLE,
        lift_seconds=sum(r.phase == "lift" for r in rising) * SAMPLE,
        approach_off=approach,
        closing_off=shut,
        lift_off=lift,
        torque_share=max(r.strain for r in (*coming, *closing, *rising)),
    )


def _finite(phase: Iterable[Reading], force: float = inf) -> list[Reading]:
    """The readings of a phase, up to the first that is not finite, or where the robot hits something at a force [N]."""
    readings = []
    for reading in phase:
        readings.append(reading)
        if not reading.finite or _collided(reading, force):
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
        penetration_obstacles=depth["obstacles"],
        settle_shift=float(np.linalg.norm(begin.centre - experiment.given)),
        settle_turn=rotation_angle(begin.rotation),
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
