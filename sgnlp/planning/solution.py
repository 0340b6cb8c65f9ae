"""A planned grasp: everything recomputed from the solver's variables, and whether it is feasible."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf, isnan, nan

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.brief import brief
from sgnlp.base.settings import Closing, Motion
from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_kinematics import gravity_torques
from sgnlp.hand.hand import Hand
from sgnlp.hand.inverse import closing_way, reached
from sgnlp.hand.kinematics import frames, joint_torques
from sgnlp.perception.shape import Shape
from sgnlp.planning.kkt import SOLVED_FACTOR, Kkt
from sgnlp.planning.planner import History, Iterate
from sgnlp.planning.problem import Problem
from sgnlp.planning.recompute import recompute
from sgnlp.planning.starts import Start
from sgnlp.planning.violations import Violation
from sgnlp.planning.warm_start import WarmStart
from sgnlp.program.constraint import Check, Constraint
from sgnlp.program.grasp import Grasp
from sgnlp.program.names import rows_of
from sgnlp.program.nlp import Nlp
from sgnlp.program.ops import Exact
from sgnlp.program.terms.spring import margins
from sgnlp.program.tolerances import CLEARANCE
from sgnlp.program.variables import Posture, posture

JOINT_SLACK = 1e-6
"""Rounding allowed to a joint limit [rad]."""
LEAST_STIFFNESS = 1e-6
"""Stiffness ρ above which an equilibrium is strictly stable [N m]: rounding is a thousandth of it."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A grasp recomputed from a solver's variables; m fingers, n joints. Lengths in m, forces in N."""

    start: int
    wrist: Array  # (7,) pose of the root link, x y z qx qy qz qw
    joints: Array  # (n,) [rad]
    joints_contact: Array  # (n,) [rad] at first contact: planned, or by inverse kinematics from the pregrasp
    joints_squeeze: Array  # (n,) [rad] for joints under position control: they press with the torques at equilibrium
    clearances_contact: Array  # (S - m,) [m] of every sphere but the pads from the object, at joints_contact
    c: Array  # (m,) c: each finger touches at this share of the way from its target to its pregrasp tip
    grasp: Grasp
    translation_eq: Array  # (3,) [m]
    contact_points: Array  # (m, 3) [m], p_i - r n_i
    margins_initial: Array  # (m,)
    margins_equilibrium: Array  # (m,)
    energy: float
    energy_terms: Array  # (T,) exact, unweighted
    checks: tuple[Check, ...]
    kkt: Kkt
    status: str
    iterations: int
    seconds: float
    history: History
    violations: tuple[Violation, ...]  # violated rows of the solver's last program, worst first
    hand: Hand | None = None  # the hand of the plan
    closing: Closing = field(default_factory=Closing)  # how the hand closes
    motion: Motion = field(default_factory=Motion)  # approach and lift
    obstacles: tuple[Shape, ...] = ()  # obstacles of the plan, given and seen
    arm: Array | None = None  # (3, a) [rad], of an arm at the pregrasp, at the stand-off and lifted
    ended: WarmStart | None = None  # the solver's end, in the planning frame
    confidence: float = nan  # probability that it holds at the load of the plan; NaN: unknown

    def __repr__(self) -> str:
        return brief(self, "feasible", "worst_margin", "violated")

    @property
    def feasible(self) -> bool:
        """Whether every check passes."""
        return all(check.passed for check in self.checks)

    def solved(self, tolerance: float) -> bool:
        """Whether the recomputed optimality conditions hold to `SOLVED_FACTOR` times the solver's tolerance."""
        return self.kkt.worst <= SOLVED_FACTOR * tolerance

    @property
    def worst_margin(self) -> float:
        """Smallest contact margin over fingers, at first contact and at equilibrium."""
        return float(min(self.margins_initial.min(), self.margins_equilibrium.min()))

    @property
    def violated(self) -> tuple[str, ...]:
        """Names of the checks that fail."""
        return tuple(check.name for check in self.checks if not check.passed)


def solution(problem: Problem, start: Start, iterate: Iterate, nlp: Nlp) -> Solution:
    """The solution of an iterate, the end of a program `nlp`."""
    seed, c = (start.wrist, start.joints), problem.settings.contact.c
    at = posture(problem.hand, nlp.structure.at_contact, seed, iterate.x, c)
    g, t = recompute(problem, at)
    touching, squeeze = _closed(problem, at, g)
    links = np.delete(frames(problem.hand, at.wrist, touching)[1], problem.hand.tip_spheres, axis=0)
    op = Exact()
    initial = margins(g.forces, g.normals, g.friction, op)
    equilibrium = margins(g.forces_eq, g.normals_eq, g.friction, op)
    terms = np.array([float(term.value(g, op)) for term in problem.terms])
    radii = problem.hand.tip_radii * problem.settings.contact.pad
    return Solution(
        start=start.index,
        wrist=at.wrist,
        joints=at.joints,
        joints_contact=touching,
        joints_squeeze=squeeze,
        clearances_contact=problem.gpis.distance(links) - np.delete(g.radii, problem.hand.tip_spheres),
        c=at.c,
        arm=at.arm,
        grasp=g,
        translation_eq=t,
        contact_points=g.contacts - radii[:, None] * g.normals,
        margins_initial=initial,
        margins_equilibrium=equilibrium,
        energy=float(problem.weights() @ terms),
        energy_terms=terms,
        checks=feasibility(problem, g),
        kkt=iterate.kkt,
        status=iterate.status,
        iterations=iterate.iterations,
        seconds=iterate.seconds,
        history=iterate.history,
        violations=iterate.violations,
        closing=problem.settings.closing,
        motion=problem.settings.motion,
        obstacles=problem.surroundings.obstacles,
        ended=WarmStart(start, iterate.x, iterate.multipliers),
    )


def _closed(problem: Problem, at: Posture, g: Grasp) -> tuple[Array, Array]:
    """The joints w (n,) at first contact, and the squeeze setpoints w + Jᵀf/κ with the stiffness κ of a joint."""
    hand, closing = problem.hand, problem.settings.closing
    touching, torques = g.joints_contact, g.torques_eq if problem.settings.contact.metric == "spring" else g.torques
    if not closing.planned:
        touching = reached(hand, at.wrist, at.joints, g.contacts)
        forces = g.forces_eq if problem.settings.contact.metric == "spring" else g.forces
        torques = joint_torques(hand, at.wrist, touching, forces)
    return touching, touching + torques / closing.joint_stiffness


def feasibility(problem: Problem, g: Grasp) -> tuple[Check, ...]:
    """The checks of a feasible grasp: every constraint of the plan, the joint limits, a strictly stable equilibrium."""
    found = (_checked(problem, c, g) for c in problem.constraints if c.bounded)
    return (*(check for check in found if check), *_always(problem, g))


def _checked(problem: Problem, constraint: Constraint, g: Grasp) -> Check | None:
    rows = np.size(constraint.value(g, Exact()))
    return constraint.check(g, rows_of(problem.hand, constraint, rows))


def _always(problem: Problem, g: Grasp) -> Iterator[Check]:
    """The checks that are not constraints: bounds of the variables, and stability of the equilibrium."""
    hand, inf = problem.hand, float("inf")
    postures = np.stack([g.joints, g.joints_contact])
    room = np.minimum(postures - hand.lower, hand.upper - postures).min(axis=0)
    joint = int(room.argmin())
    row = f"joint_limits[{hand.joint_names[joint]}]"
    passed = bool(room[joint] >= -JOINT_SLACK)
    yield Check("joint_limits", float(room[joint]), 0.0, inf, JOINT_SLACK, "rad", passed, row)
    if hand.arm:
        yield from _arm(problem, hand.arm, g)
    if problem.settings.closing.planned:
        yield _way(problem, g)
    if problem.settings.contact.metric == "spring":
        rho = float(g.stiffness)
        yield Check("stable", 1e3 * rho, 1e3 * LEAST_STIFFNESS, inf, 0.0, "mN m", rho > LEAST_STIFFNESS)


def _arm(problem: Problem, arm: Arm, g: Grasp) -> Iterator[Check]:
    """Checks of the arm's joint limits, and of its effort under its own, the hand's and the object's weight."""
    ways = {"pregrasp": g.arm.joints, "standoff": g.arm.standoff, "lift": g.arm.lift}
    room = {place: np.minimum(q - arm.lower, arm.upper - q) for place, q in ways.items()}
    place, joint = min(((p, int(r.argmin())) for p, r in room.items()), key=lambda at: room[at[0]][at[1]])
    value = float(room[place][joint])
    row = f"arm_limits[{arm.joint_names[joint]} at {place}]"
    yield Check("arm_limits", value, 0.0, inf, JOINT_SLACK, "rad", value >= -JOINT_SLACK, row)
    hand, mass = pin.computeTotalMass(problem.hand.model), problem.settings.contact.mass
    root = pin.SE3(g.wrist_rotation, g.wrist_position)
    centre = hand * pin.centerOfMass(problem.hand.model, problem.hand.model.createData(), g.joints_contact)
    centre += mass * np.asarray(root.actInv(g.centre))
    weight = hand + mass
    torques = np.array([gravity_torques(arm, ways[p], weight, centre / weight) for p in ("pregrasp", "lift")])
    share = np.abs(torques / arm.effort).max(axis=0)
    worst = int(share.argmax())
    row = f"arm_effort[{arm.joint_names[worst]}]"
    yield Check("arm_effort", float(share[worst]), 0.0, 1.0, 0.0, "of the effort", bool(share[worst] <= 1.0), row)


def _way(problem: Problem, g: Grasp) -> Check:
    """The check of links against object and table at postures between the pregrasp and first contact."""
    hand, links = problem.hand, [i for i in range(len(g.radii)) if i not in problem.hand.tip_spheres]
    wrist = np.asarray(pin.SE3ToXYZQUAT(pin.SE3(g.wrist_rotation, g.wrist_position)))
    way = closing_way(hand, wrist, g.joints, g.joints_contact, problem.settings.closing.samples)[:, links]
    clearances = problem.gpis.distance(way.reshape(-1, 3)).reshape(way.shape[:2]) - g.radii[links]
    clearances = np.minimum(clearances, way[:, :, 2] - g.radii[links] - problem.table_height).min(axis=0)
    worst, value = int(clearances.argmin()), float(clearances.min())
    row = f"way[{hand.spheres[links[worst]].name}]"
    return Check("way", 1e3 * value, 0.0, float("inf"), 1e3 * CLEARANCE, "mm", value >= -CLEARANCE, row)


def torque_share(g: Grasp, metric: str) -> float:
    """The largest joint torque over the hand's effort, at first contact and, with springs, at equilibrium."""
    torques = [g.torques, g.torques_eq] if metric == "spring" else [g.torques]
    return float(np.max(np.abs(torques) / g.effort))


def rank(solutions: list[Solution], key: str) -> list[Solution]:
    """Sort feasible solutions first, then best first by `key`, one of `Settings.rank_by`; ties by start.

    If confidences are unknown or equal, the margin decides.
    """
    value = {
        "margin": lambda s: -s.worst_margin,
        "margin_initial": lambda s: -s.margins_initial.min(),
        "energy": lambda s: s.energy,
        "stiffness": lambda s: -s.grasp.stiffness,
        "confidence": lambda s: (inf if isnan(s.confidence) else -s.confidence, -s.worst_margin),
    }[key]
    return sorted(solutions, key=lambda s: (not s.feasible, value(s), s.start))
