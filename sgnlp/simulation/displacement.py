"""A hand beside its planned place: an error in the calibration between camera and robot."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.control.command import Command
from sgnlp.hand.hand import Hand
from sgnlp.simulation.route import Leg, Route
from sgnlp.simulation.settings import SimulationSettings


def displaced(command: Command, shift: Array, turn: Array) -> Command:
    """The command with the hand and all that moves with it turned by `turn` (3, 3), then shifted by `shift` (3,) [m].

    Wrist, tips, targets, and the expected tips and forces at the equilibrium move together. The turn is about the
    middle of the pregrasp tips; about the wrist, a decimetre away, it would shift the tips too. The object and its
    expected motion stay the same.
    """
    middle = command.tips.mean(axis=0)

    def moved(points: Array) -> Array:
        return (points - middle) @ turn.T + middle + shift

    pose = turn @ pin.XYZQUATToSE3(np.asarray(command.wrist, float)).rotation
    wrist = pin.SE3ToXYZQUAT(pin.SE3(pose, moved(command.wrist[:3])))
    return replace(
        command,
        wrist=wrist,
        tips=moved(command.tips),
        targets=moved(command.targets),
        contacts_eq=None if command.contacts_eq is None else moved(command.contacts_eq),
        forces_eq=None if command.forces_eq is None else command.forces_eq @ turn.T,
    )


def erred(command: Command, settings: SimulationSettings) -> Command:
    """The command displaced by the settings' errors, in random directions of their seed.

    The shift is horizontal, the axis of the turn arbitrary. The directions do not depend on the size of the errors.
    """
    if not (settings.place_error or settings.turn_error):
        return command
    return displaced(command, *_error(settings))


def carried_wrong(hand: Hand, way: Route, command: Command, settings: SimulationSettings) -> tuple[Hand, Route]:
    """The hand and its route with the same error: the base of an arm, or the path of a floating wrist, is displaced.

    `command` is the planned one.
    """
    if not (settings.place_error or settings.turn_error):
        return hand, way
    shift, turn = _error(settings)
    if hand.arm is None:
        legs = (Leg(leg.times, leg.coordinates @ turn.T) for leg in (way.approach, way.lift))
        return hand, Route(*legs)
    middle, base = command.tips.mean(axis=0), pin.XYZQUATToSE3(hand.arm.base)
    place = turn @ (base.translation - middle) + middle + shift
    pose = pin.SE3ToXYZQUAT(pin.SE3(turn @ base.rotation, place))
    return replace(hand, arm=replace(hand.arm, base=pose)), way


def _error(settings: SimulationSettings) -> tuple[Array, Array]:
    """Shift (3,) [m] and turn (3, 3)."""
    rng = np.random.default_rng(settings.seed)
    heading, axis = rng.uniform(0.0, 2 * np.pi), rng.normal(size=3)
    shift = settings.place_error * np.array([np.cos(heading), np.sin(heading), 0.0])
    return shift, pin.exp3(np.radians(settings.turn_error) * axis / np.linalg.norm(axis))
