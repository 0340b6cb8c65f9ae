"""A planned grasp: everything recomputed from the solver's variables, and whether it is feasible."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.settings import Closing
from sgnlp.hand.hand import Hand
from sgnlp.planning.kkt import SOLVED_FACTOR, Kkt
from sgnlp.planning.planner import History, Iterate
from sgnlp.planning.problem import Problem
from sgnlp.planning.recompute import recompute
from sgnlp.planning.starts import Start
from sgnlp.planning.violations import Violation
from sgnlp.program.constraint import Check, Constraint
from sgnlp.program.grasp import Grasp
from sgnlp.program.names import rows_of
from sgnlp.program.nlp import grasp_variables
from sgnlp.program.ops import Exact
from sgnlp.program.terms.spring import margins

Array = NDArray[np.float64]

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
    violations: tuple[Violation, ...]  # rows of the solver's last program that are not met, worst first
    hand: Hand | None = None  # that of the plan
    joints_contact: Array | None = None  # (n,) [rad] at first contact
    joints_squeeze: Array | None = None  # (n,) [rad] to which position control closes
    c: float = 1.0  # of the pregrasp
    closing: Closing = field(default_factory=Closing)

    @property
    def feasible(self) -> bool:
        """Whether every check passes."""
        return all(check.passed for check in self.checks)

    def solved(self, tolerance: float) -> bool:
        """Whether the recomputed optimality conditions hold to `SOLVED_FACTOR` times the solver's tolerance."""
        return self.kkt.worst <= SOLVED_FACTOR * tolerance

    @property
    def worst_margin(self) -> float:
        """Smallest contact margin over fingers and states."""
        return float(min(self.margins_initial.min(), self.margins_equilibrium.min()))

    @property
    def violated(self) -> tuple[str, ...]:
        """Names of the checks that fail."""
        return tuple(check.name for check in self.checks if not check.passed)


def solution(problem: Problem, start: Start, iterate: Iterate, units: Array) -> Solution:
    """The solution that an iterate stands for."""
    wrist, joints, targets, gains = grasp_variables(problem.hand, start.wrist, start.joints, iterate.x * units)
    g, t = recompute(problem, wrist, joints, targets, gains)
    op = Exact()
    initial = margins(g.forces, g.normals, g.friction, op)
    equilibrium = margins(g.forces_eq, g.normals_eq, g.friction, op)
    terms = np.array([float(term.value(g, op)) for term in problem.terms])
    radii = problem.hand.tip_radii * problem.settings.contact.pad
    return Solution(
        start=start.index,
        wrist=wrist,
        joints=joints,
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
        c=problem.settings.contact.c,
        closing=problem.settings.closing,
    )


def feasibility(problem: Problem, g: Grasp) -> tuple[Check, ...]:
    """The checks of a feasible grasp: every constraint of the plan, the joint limits, a strictly stable equilibrium."""
    found = (_checked(problem, c, g) for c in problem.constraints if c.bounded)
    return (*(check for check in found if check), *_always(problem, g))


def _checked(problem: Problem, constraint: Constraint, g: Grasp) -> Check | None:
    rows = np.size(constraint.value(g, Exact()))
    return constraint.check(g, rows_of(problem.hand, constraint, rows))


def _always(problem: Problem, g: Grasp) -> Iterator[Check]:
    """The checks that are no constraints, but bounds of the variables and what makes an equilibrium one."""
    hand, inf = problem.hand, float("inf")
    room = np.minimum(g.joints - hand.lower, hand.upper - g.joints)
    joint = int(room.argmin())
    row = f"joint_limits[{hand.joint_names[joint]}]"
    passed = bool(room[joint] >= -JOINT_SLACK)
    yield Check("joint_limits", float(room[joint]), 0.0, inf, JOINT_SLACK, "rad", passed, row)
    if problem.settings.contact.metric == "spring":
        rho = float(g.stiffness)
        yield Check("stable", 1e3 * rho, 1e3 * LEAST_STIFFNESS, inf, 0.0, "mN m", rho > LEAST_STIFFNESS)


def torque_share(g: Grasp, metric: str) -> float:
    """The largest joint torque over the hand's effort, at first contact and, with springs, at equilibrium."""
    torques = [g.torques, g.torques_eq] if metric == "spring" else [g.torques]
    return float(np.max(np.abs(torques) / g.effort))


def rank(solutions: list[Solution], key: str) -> list[Solution]:
    """Feasible first, then best first by `key`, one of `Settings.rank_by`; ties by start."""
    value = {
        "margin": lambda s: -s.worst_margin,
        "margin_initial": lambda s: -s.margins_initial.min(),
        "energy": lambda s: s.energy,
        "stiffness": lambda s: -s.grasp.stiffness,
    }[key]
    return sorted(solutions, key=lambda s: (not s.feasible, value(s), s.start))
