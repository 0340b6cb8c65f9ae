"""Wider limits of the object's motion than those of `robust`, for objects where no start is feasible with these.

Little motion makes a plan happen as planned. But a finger with few joints presses only along some directions, so the
object moves more before the forces balance. Only bounds of the program change, not its functions. Limits other than
those of `robust` are a user's own and never widened.
"""

from collections.abc import Iterable
from dataclasses import replace

from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.planning.ending import any_feasible
from sgnlp.planning.pool import Failure
from sgnlp.planning.problem import Problem, with_limits
from sgnlp.planning.solution import Solution

WIDE_ROTATION, WIDE_SHIFT = 10.0, 0.01
"""Largest rotation [deg] and displacement [m], `robust`'s before they were narrowed."""


def widened(problem: Problem, results: Iterable[Solution | Failure]) -> Problem | None:
    """The problem with wide limits; None if a start is feasible, none has ended, or the limits are the user's own."""
    settings, solutions = problem.settings, [result for result in results if isinstance(result, Solution)]
    if settings != narrow(settings) or settings.contact.metric != "spring":
        return None
    if not solutions or any_feasible(solutions):
        return None
    return with_limits(problem, replace(settings.limits, rotation_deg=WIDE_ROTATION, shift=WIDE_SHIFT))


def narrow(settings: Settings) -> Settings:
    """Settings with the limits of `robust`, as they were before they were widened."""
    usual = ROBUST.limits
    return replace(settings, limits=replace(settings.limits, rotation_deg=usual.rotation_deg, shift=usual.shift))
