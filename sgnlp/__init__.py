"""Compliant dexterous pregrasps under shape uncertainty, planned as one nonlinear program.

>>> import sgnlp
>>> plan = sgnlp.solve(sgnlp.load("problems/mug_0.npz"))
>>> plan.best.grasp.gains  # (m,) [N/m]
"""

from sgnlp.depth import DepthImage, from_depth
from sgnlp.errors import InputError, SgnlpError
from sgnlp.grasps import Grasps
from sgnlp.hand import Hand, load_hand
from sgnlp.observation import Observation, load, observe
from sgnlp.plan import Plan, solve
from sgnlp.presets import preset
from sgnlp.results import load_grasps
from sgnlp.settings import Settings
from sgnlp.summary import arrays

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
