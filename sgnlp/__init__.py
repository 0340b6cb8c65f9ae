"""Compliant dexterous pregrasps under shape uncertainty, planned as one nonlinear program.

>>> import sgnlp
>>> plan = sgnlp.solve(sgnlp.load("problems/mug_0.npz"))
>>> plan.best.grasp.gains  # (m,) [N/m]
"""

from sgnlp.base.errors import InputError, SgnlpError
from sgnlp.base.presets import preset
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.depth import DepthImage, from_depth
from sgnlp.perception.observation import Observation, load, observe
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.plan import Plan, solve
from sgnlp.planning.results import load_grasps
from sgnlp.planning.summary import arrays

__all__ = [
    "DepthImage",
    "Grasps",
    "Hand",
    "InputError",
    "Observation",
    "Plan",
    "Settings",
    "SgnlpError",
    "arrays",
    "from_depth",
    "load",
    "load_grasps",
    "load_hand",
    "observe",
    "preset",
    "solve",
]
__version__ = "0.1.0"
