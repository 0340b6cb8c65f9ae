"""A planned grasp: everything recomputed from the solver's variables, and whether it is feasible."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sgnlp.planning.ipopt import Course, Iterate
from sgnlp.planning.kkt import SOLVED_FACTOR, Kkt
from sgnlp.planning.problem import Problem
from sgnlp.planning.recompute import recompute
from sgnlp.planning.starts import Start
from sgnlp.planning.violations import Violation
from sgnlp.program.grasp import Grasp
from sgnlp.program.nlp import grasp_variables
from sgnlp.program.ops import Exact
from sgnlp.program.terms import TERMS
from sgnlp.program.terms.spring import margins

Array = NDArray[np.float64]

MARGIN_SLACK = 1e-6
"""Rounding allowed to a margin: a solver meets its bounds to 1e-8."""
MAX_GAP = 2e-3
"""Largest |distance| of a pad to the surface that counts as contact [m]."""
MAX_PENETRATION = 1e-3
"""Largest penetration of a sphere that counts as clear [m]."""
FORCE_SHARE = 0.9
"""Share of f_min that a finger must give at least."""
MAX_RESIDUAL = 1e-3
"""Largest |Σ F| + |Σ (p - c_g) × F| that counts as force closure [N and N m]; a solver meets it to 1e-6."""
JOINT_SLACK = 1e-6
"""Rounding allowed to a joint limit [rad]."""


@dataclass(frozen=True)
class Check:
    """A condition of feasibility: `value` must be at least `least`, in `unit`."""

    name: str
    value: float
    least: float
    unit: str

    @property
    def passed(self) -> bool:
        """Whether it holds; NaN does not."""
        return bool(self.value >= self.least)


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
    course: Course
    violations: tuple[Violation, ...]  # rows of the solver's last program that are not met, worst first

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
    terms = np.array([float(term.value(g, op)) for term in TERMS])
    radii = np.array([finger.radius for finger in problem.hand.fingers]) * problem.settings.contact.pad
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
        checks=feasibility(problem, g, initial, equilibrium),
        kkt=iterate.kkt,
        status=iterate.status,
        iterations=iterate.iterations,
        seconds=iterate.seconds,
        course=iterate.course,
        violations=iterate.violations,
    )


def feasibility(problem: Problem, g: Grasp, initial: Array, equilibrium: Array) -> tuple[Check, ...]:
    """The conditions of a feasible grasp, each with its value: those of the metric, then those of every grasp."""
    hand, contact = problem.hand, problem.settings.contact
    limit = min((g.joints - hand.lower).min(), (hand.upper - g.joints).min())
    pads = g.pad_clearances if contact.c < 1 else g.pad_clearances[:0]  # without a pregrasp they touch
    clearance = np.concatenate([g.object_clearances, pads]).min()
    penetration = -1e3 * MAX_PENETRATION
    metric = _compliance(problem, g, equilibrium) if contact.metric == "spring" else _closure(problem, g)
    effort = problem.settings.limits.effort
    torque = Check("joint torque", -torque_share(g, contact.metric), -effort - MARGIN_SLACK, "of the effort")
    return (
        Check("margin at first contact", float(initial.min()), -MARGIN_SLACK, ""),
        *metric,
        *([torque] if effort > 0 else []),
        Check("contact distance", -1e3 * float(np.abs(g.gaps).max()), -1e3 * MAX_GAP, "mm"),
        Check("object clearance", 1e3 * float(clearance), penetration, "mm"),
        Check("table clearance", 1e3 * float(min(g.table_clearances.min(), g.pad_heights.min())), penetration, "mm"),
        Check("self clearance", 1e3 * float(g.pair_clearances.min(initial=np.inf)), penetration, "mm"),
        Check("joint limits", float(limit), -JOINT_SLACK, "rad"),
        Check("surface model", 1e3 * float(g.ball_clearances.min()), 0.0, "mm"),
    )


def torque_share(g: Grasp, metric: str) -> float:
    """The largest joint torque over the hand's effort, at first contact and, with springs, at equilibrium."""
    torques = [g.torques, g.torques_eq] if metric == "spring" else [g.torques]
    return float(np.max(np.abs(torques) / g.effort))


def _compliance(problem: Problem, g: Grasp, equilibrium: Array) -> tuple[Check, ...]:
    """A stable equilibrium that the contacts hold with enough force."""
    force = np.linalg.norm(g.forces_eq, axis=1)
    return (
        Check("margin at equilibrium", float(equilibrium.min()), -MARGIN_SLACK, ""),
        Check("force", float(force.min()), FORCE_SHARE * problem.settings.limits.force_min, "N"),
        Check("stiffness", 1e3 * float(g.stiffness), 1e-3, "mN m"),
    )


def _closure(problem: Problem, g: Grasp) -> tuple[Check, ...]:
    """Force closure at first contact; the equilibrium has no say."""
    press = -(g.forces * g.normals).sum(axis=1)
    return (
        Check("force closure", -float(np.linalg.norm(g.wrench, axis=1).sum()), -MAX_RESIDUAL, "N"),
        Check("normal force", float(press.min()), FORCE_SHARE * problem.settings.limits.force_min, "N"),
    )


def rank(solutions: list[Solution], key: str) -> list[Solution]:
    """Feasible first, then best first by `key`, one of `Settings.rank_by`; ties by start."""
    value = {
        "margin": lambda s: -s.worst_margin,
        "margin_initial": lambda s: -s.margins_initial.min(),
        "energy": lambda s: s.energy,
        "stiffness": lambda s: -s.grasp.stiffness,
    }[key]
    return sorted(solutions, key=lambda s: (not s.feasible, value(s), s.start))
