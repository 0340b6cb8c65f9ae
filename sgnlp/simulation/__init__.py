"""Tests whether a grasp holds: the hand, the table and the true object in MuJoCo.

A planned grasp and the true surface of its object come in, an `Outcome` goes out: what happened in each phase, and the
score. It imports from the rooms before it, among them `hand` and `planning`.

>>> outcome = simulate(plan.best, observation, SimulationSettings(mass=0.3))
>>> outcome.score, outcome.pushes_held
"""

from sgnlp.control.command import Command, command
from sgnlp.simulation.body import Body, body, true_body
from sgnlp.simulation.displacement import displaced
from sgnlp.simulation.estimate import estimated
from sgnlp.simulation.judge import execute
from sgnlp.simulation.outcome import Closing, Lift, Outcome, Pregrasp, Push, Trace, plain
from sgnlp.simulation.settings import SimulationSettings
from sgnlp.simulation.simulate import simulate

__all__ = [
    "Body",
    "Closing",
    "Command",
    "Lift",
    "Outcome",
    "Pregrasp",
    "Push",
    "SimulationSettings",
    "Trace",
    "body",
    "command",
    "displaced",
    "estimated",
    "execute",
    "plain",
    "simulate",
    "true_body",
]
