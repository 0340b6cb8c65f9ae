"""The input of cautions: a plan's grasps, with cloud and problem if they are known."""

from dataclasses import dataclass

from sgnlp.hand.hand import Hand
from sgnlp.perception.observation import Observation
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.problem import Problem


@dataclass(frozen=True, eq=False)
class Planned:
    """A plan's grasps, best first; if its cloud is missing or has changed, `missing` says why."""

    grasps: Grasps
    hand: Hand
    cloud: Observation | None
    problem: Problem | None
    missing: str = ""
