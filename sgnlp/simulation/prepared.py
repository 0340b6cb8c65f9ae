"""The grasp, the hand and its route as they are carried out: displaced by the settings' errors."""

from typing import NamedTuple

from sgnlp.control.command import Command, check
from sgnlp.hand.hand import Hand
from sgnlp.simulation.displacement import carried_wrong, erred
from sgnlp.simulation.route import Moving, Route, route
from sgnlp.simulation.settings import SimulationSettings


class Prepared(NamedTuple):
    """A grasp as it is carried out."""

    command: Command
    hand: Hand
    route: Route | None


def prepared(command: Command, hand: Hand, settings: SimulationSettings, motion: Moving | None = None) -> Prepared:
    """The grasp with the settings' errors. Raises `InputError` if it does not fit the hand or the motion."""
    check(command, hand)
    way = None if motion is None else route(motion, command, hand)
    if way is not None:
        hand, way = carried_wrong(hand, way, command, settings)
    return Prepared(erred(command, settings), hand, way)
