"""Whether a grasp holds: the hand, the table and the true object in MuJoCo.

>>> outcome = simulate(command(grasps, 0), true_body(observation), hand, SimulationSettings(mass=0.3))
>>> outcome.score, outcome.pushes_held
"""

from sgnlp.simulation.body import Body, body, true_body
from sgnlp.simulation.command import Command, command
from sgnlp.simulation.judge import simulate
from sgnlp.simulation.outcome import Closing, Lift, Outcome, Pregrasp, Push, Trace, plain
from sgnlp.simulation.settings import SimulationSettings

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
    "plain",
    "simulate",
    "true_body",
]
