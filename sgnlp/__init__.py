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
from sgnlp.perception.scene import Scene
from sgnlp.perception.segment import segment
from sgnlp.perception.shape import Shape
from sgnlp.planning.additions import constraints, terms
from sgnlp.planning.extension import extension
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion.files import load_trajectory
from sgnlp.planning.motion.trajectory import Trajectory
from sgnlp.planning.plan import Plan
from sgnlp.planning.replan import Touch, replan
from sgnlp.planning.results import load_grasps
from sgnlp.planning.shape_files import load_shapes, painted
from sgnlp.planning.solve import improve, solve
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.solvers.solver import Answer, NlpInstance, Solver
from sgnlp.program.constraint import Constraint
from sgnlp.program.formulation import Formulation
from sgnlp.program.grasp import Grasp
from sgnlp.program.terms import Term
from sgnlp.simulation.simulate import simulate
from sgnlp.surface.kernel import Kernel

__all__ = [
    "Answer",
    "Constraint",
    "DepthImage",
    "Formulation",
    "Grasp",
    "Grasps",
    "Hand",
    "InputError",
    "Ipopt",
    "Kernel",
    "NlpInstance",
    "Observation",
    "Plan",
    "Scene",
    "Settings",
    "SgnlpError",
    "Shape",
    "Solver",
    "Term",
    "Touch",
    "Trajectory",
    "constraints",
    "extension",
    "from_depth",
    "improve",
    "load",
    "load_grasps",
    "load_hand",
    "load_shapes",
    "load_trajectory",
    "observe",
    "painted",
    "preset",
    "replan",
    "segment",
    "simulate",
    "solve",
    "terms",
]
__version__ = "0.1.0"
