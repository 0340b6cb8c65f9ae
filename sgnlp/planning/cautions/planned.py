"""What cautions are taken from: a plan's grasps, with cloud and problem where they are known."""

from dataclasses import dataclass

from sgnlp.hand.hand import Hand
from sgnlp.perception.observation import Observation
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.problem import Problem


@dataclass(frozen=True, eq=False)
class Planned:
    """A plan's grasps, best first; where its cloud is missing or has changed, `missing` says so in the place of it."""

    grasps: Grasps
    hand: Hand
    cloud: Observation | None
    problem: Problem | None
    missing: str = ""
