"""The public names and where they come from. They are imported when they are asked for."""

from .base.errors import InputError as InputError
from .base.errors import SgnlpError as SgnlpError
from .base.presets import preset as preset
from .base.settings import Settings as Settings
from .hand.hand import Hand as Hand
from .hand.hand import load_hand as load_hand
from .perception.depth import DepthImage as DepthImage
from .perception.depth import from_depth as from_depth
from .perception.observation import Observation as Observation
from .perception.observation import load as load
from .perception.observation import observe as observe
from .perception.scene import Scene as Scene
from .perception.segment import segment as segment
from .perception.shape import Shape as Shape
from .planning.additions import constraints as constraints
from .planning.additions import terms as terms
from .planning.extension import extension as extension
from .planning.grasps import Grasps as Grasps
from .planning.improve import improve as improve
from .planning.motion.files import load_trajectory as load_trajectory
from .planning.motion.trajectory import Trajectory as Trajectory
from .planning.plan import Plan as Plan
from .planning.replan import Touch as Touch
from .planning.replan import replan as replan
from .planning.results import load_grasps as load_grasps
from .planning.shape_files import load_shapes as load_shapes
from .planning.shape_files import painted as painted
from .planning.solve import solve as solve
from .planning.solvers.ipopt import Ipopt as Ipopt
from .planning.solvers.solver import Answer as Answer
from .planning.solvers.solver import NlpInstance as NlpInstance
from .planning.solvers.solver import Solver as Solver
from .program.constraint import Constraint as Constraint
from .program.formulation import Formulation as Formulation
from .program.grasp import Grasp as Grasp
from .program.terms import Term as Term
from .simulation.simulate import simulate as simulate
from .surface.kernel import Kernel as Kernel

__all__: list[str]
__version__: str
