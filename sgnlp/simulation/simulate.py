"""A planned grasp carried out on the true object that comes with its cloud."""

from types import NoneType

from sgnlp.base.errors import InputError
from sgnlp.control.command import Command
from sgnlp.perception.observation import Observation
from sgnlp.planning import arguments
from sgnlp.planning.grasps import stack
from sgnlp.planning.motion.way import way
from sgnlp.planning.solution import Solution
from sgnlp.simulation.body import true_body
from sgnlp.simulation.judge import DEFAULTS, execute
from sgnlp.simulation.outcome import Outcome
from sgnlp.simulation.settings import SimulationSettings

KINDS: dict[str, arguments.Kinds] = {
    "solution": ((Solution, NoneType), "plan.best is one"),
    "observation": arguments.OBSERVATION,
    "settings": ((SimulationSettings,), "sgnlp.simulation.SimulationSettings(mass=0.3) makes them"),
}


def simulate(solution: Solution | None, observation: Observation, settings: SimulationSettings = DEFAULTS) -> Outcome:
    """Close, lift, hold and push in MuJoCo, to test whether a solution of a plan holds the true object of
    `observation`.

    The obstacles of the plan are in the scene. A hand on an arm follows the plan's motion from the stand-off to the
    lift.

    Args:
        solution: such as `plan.best`.
        observation: the cloud, whose file has the true shape (`mesh_vertices`, `mesh_faces`).
        settings: mass [kg] and friction of the object, control, phases and judgement.

    Returns:
        What happened in each phase, and the score.

    Raises:
        InputError: there is no solution, the observation has no true surface, or MuJoCo refuses hand or mesh.
    """
    arguments.check({"solution": solution, "observation": observation, "settings": settings}, KINDS)
    if solution is None or solution.hand is None:
        raise InputError("there is no grasp to simulate: plan.best is None if no start is feasible")
    g, closing = solution.grasp, solution.closing
    told = Command(
        wrist=solution.wrist,
        joints=solution.joints,
        tips=g.tips,
        targets=g.targets,
        gains=g.gains,
        joints_contact=solution.joints_contact,
        joints_squeeze=solution.joints_squeeze,
        closing_seconds=closing.seconds,
        posture=closing.posture,
        joint_stiffness=closing.joint_stiffness,
        contacts_eq=g.contacts_eq,
        forces_eq=g.forces_eq,
        rotation_eq=g.rotation,
        translation_eq=solution.translation_eq,
    )
    hand, motion = solution.hand, None
    if hand.arm is not None and solution.arm is not None:
        motion = way(hand, solution.motion, closing, stack(hand, (), [solution], {}), 0)
    return execute(told, true_body(observation), hand, settings, solution.obstacles, motion)
