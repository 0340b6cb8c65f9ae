"""A planning problem: a hand, a fitted surface and settings, as numbers for the nonlinear program."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from pinocchio import exp3
from scipy.spatial.distance import cdist

from sgnlp.base.arrays import Array
from sgnlp.base.brief import brief
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Limits, Settings
from sgnlp.base.threads import one_thread
from sgnlp.hand.arm_kinematics import arm_spheres
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.clutter import upright_box
from sgnlp.perception.observation import Observation
from sgnlp.perception.shape import FAR, Shape
from sgnlp.planning.additions import NOTHING, Additions, phases_of, posed
from sgnlp.planning.surroundings import MOST_INSIDE, NOWHERE, Surroundings
from sgnlp.program.around import Around, Fields
from sgnlp.program.carried import POSTURES, UNIT
from sgnlp.program.constraint import Constraint
from sgnlp.program.formulation import Formulation, Phase
from sgnlp.program.nlp import Nlp
from sgnlp.program.structure import Structure
from sgnlp.program.terms import Term
from sgnlp.program.variables import variable_units
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.inside import centroid
from sgnlp.surface.training import training_set

Known = tuple[Gpis, Array]
"""A surface, and the object's centre of mass (3,) [m]."""
LEAST_C = 0.1
"""Least c of a finger that has its own: at 0 a finger touches at its target and does not press."""
UNSEEN = 0.02
"""The object is assumed to end within this distance of the box of its points [m], as most unseen parts do."""
MAX_TURN = 1.8
"""Bound of each angular coordinate of the wrist's tangent [rad], for a cube inside the ball |ω| < π."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A hand, a surface and settings, with the terms and constraints of the plan.

    `box` (2, 3) [m] are the corners of the observed points' box.
    """

    __repr__ = brief

    hand: Hand
    gpis: Gpis
    settings: Settings
    box: Array
    table_height: float
    com: Array  # (3,) [m], centre of mass, estimated from the surface
    terms: tuple[Term, ...]
    constraints: tuple[Constraint, ...]
    formulation: Formulation
    thing: Shape  # a box around the observed points
    surroundings: Surroundings = NOWHERE
    additions: Additions = NOTHING

    @property
    def around(self) -> Around:
        """The kinds of surroundings in its programs."""
        return self.surroundings.around(self.settings, self.hand.arm is not None)

    @cached_property
    def fields(self) -> Fields:
        """The distance fields of the surroundings."""
        return self.surroundings.fields(self.thing, self.table_height)

    @property
    def phases(self) -> tuple[Phase, ...]:
        """The programs that its formulation solves in turn."""
        return phases_of(self.formulation, self.settings.solver)

    def structure(self, formulation: Formulation) -> Structure:
        """The structure of the symbolic functions of a formulation of this problem."""
        return posed(self.settings, formulation, self.terms, self.constraints, self.around)

    def weights(self) -> Array:
        """The weights (T,) of the terms."""
        return np.array([term.weight for term in self.terms])

    @property
    def moves(self) -> bool:
        """Whether the object is to move on the way to the equilibrium: E_pose has a weight."""
        return self.settings.weights.pose > 0

    def numbers(self) -> dict[str, Any]:
        """The numbers of the problem that a grasp depends on, beside its variables: shapes and units as in `Grasp`.

        `displacement` (3,) [m] and `rotation_desired` (3, 3) are how the object is to move to the equilibrium.
        """
        contact = self.settings.contact
        return {
            "c": contact.c,
            "friction": contact.friction,
            "pad": float(contact.pad),
            "force_min": self.settings.limits.force_min,
            "displacement": np.array(contact.displacement) * self.moves,
            "rotation_desired": exp3(np.array(contact.rotation) * self.moves),
            "mass": contact.mass,
            "com": self.com,
            "table": self.table_height,
            "ball_centre": self.gpis.centre,
            "ball_radius": self.gpis.radius,
            "standoff": self.settings.motion.standoff,
            "lift": self.settings.motion.lift,
        }

    def parameters(self, nlp: Nlp, wrist: Array, joints: Array, arm: Array | None = None) -> Array:
        """The parameter vector for the seed pose `wrist` (7) and `joints` (n), and those of an arm (a) near it."""
        smoothing, numbers = self.settings.smoothing, self.numbers()
        weights = {term.name: term.weight for term in self.terms}
        if self.hand.arm and nlp.hand.arm:
            numbers |= {"base": self.hand.arm.base, "arm": self.hand.arm.home if arm is None else arm}
        return nlp.parameters.pack(
            numbers
            | {
                "rotation_desired": numbers["rotation_desired"].ravel(order="F"),
                "wrist": wrist,
                "joints": joints,
                "weights": np.array([weights[term.name] for term in nlp.structure.terms]),
                "foot": float(nlp.structure.formulation.exact_feet),
                "distance": smoothing.distance,
                "collision": smoothing.collision,
                "log_width": smoothing.log,
                "force": smoothing.force,
                "deviation": smoothing.deviation,
                "exponent": smoothing.exponent,
                "elastic": self.settings.solver.elastic_weight,
            }
        )

    def variable_bounds(self, nlp: Nlp, joints: Array) -> tuple[Array, Array]:
        """Bounds (nx,) of the scaled variables for the seed `joints` (n)."""
        limits, m = self.settings.limits, len(self.hand.fingers)
        side = self.gpis.radius / np.sqrt(3)  # half the edge of the cube inside the surface model's ball
        wrist = np.repeat([limits.wrist_travel, MAX_TURN], 3)
        gains = self.gain_bounds()
        targets = np.tile(self.gpis.centre, m)
        low = [-wrist, self.hand.lower - joints, targets - side, gains[0]]
        high = [wrist, self.hand.upper - joints, targets + side, gains[1]]
        own_low, own_high = nlp.structure.formulation.variable_bounds(nlp, self.row_bounds(nlp))
        contact_low, contact_high = self._contact_bounds(nlp)
        units = variable_units(self.hand)
        return (
            np.concatenate([np.concatenate(low) / units, contact_low, own_low]),
            np.concatenate([np.concatenate(high) / units, contact_high, own_high]),
        )

    def _contact_bounds(self, nlp: Nlp) -> tuple[Array, Array]:
        """Bounds of the variables of the hand at first contact, if it is planned, and of an arm."""
        at, hand, freedom = nlp.structure.at_contact, nlp.hand, self.settings.closing.c_freedom
        c, m = self.settings.contact.c, len(hand.fingers)
        fingers = np.tile([[max(c - freedom, LEAST_C)], [min(c + freedom, 1.0)]], m if at.c else 0)
        joints = np.stack([hand.lower, hand.upper])[:, : len(hand.lower) if at.joints else 0]
        arm = np.tile(np.stack([hand.arm.lower, hand.arm.upper]) / UNIT, POSTURES) if hand.arm else np.zeros((2, 0))
        low, high = np.hstack([fingers, joints, arm])
        return low, high

    def gain_bounds(self) -> tuple[Array, Array]:
        """Bounds (m,) of the gains [N/m]: those of the settings, for free gains, within those of the hand."""
        limits, low, high = self.settings.limits, self.hand.gain_lower, self.hand.gain_upper
        flags = "--limits.gain-min and --limits.gain-max leave"
        if limits.gain_fixed > 0:
            flags = "--limits.gain-fixed leaves"
            low = np.maximum(low, limits.gain_fixed * self.hand.gain_initial)
            high = np.minimum(high, limits.gain_fixed * self.hand.gain_initial)
        elif self.settings.contact.heuristic == 0:
            low, high = np.maximum(low, limits.gain_min), np.minimum(high, limits.gain_max)
        if (low > high).any():
            spans = f"{self.hand.gain_lower.min():g} to {self.hand.gain_upper.max():g} N/m"
            raise InputError(f"{flags} nothing of the hand's gains, {spans}")
        return low, high

    def row_bounds(self, nlp: Nlp) -> tuple[Array, Array]:
        """Bounds (ng,) of the scaled rows: those of the plan's constraints, and of the formulation's own."""
        known = {c.name for c in nlp.structure.constraints}
        rows = nlp.structure.formulation.constraints([c for c in self.constraints if c.name in known])
        bounds = [np.array((c.lower, c.upper)) / c.scale for c in rows]
        each = np.repeat(np.array(bounds).reshape(-1, 2), nlp.row_sizes, axis=0)
        return each[:, 0], each[:, 1]


def build_problem(
    observation: Observation,
    hand: str | Hand,
    settings: Settings,
    seed: int = 0,
    additions: Additions = NOTHING,
    surroundings: Surroundings = NOWHERE,
    known: Known | None = None,
) -> Problem:
    """Fit the surface of an observation, unless it is known, and build the problem of grasping it.

    Obstacles that the observation itself has seen become shapes and are added to the surroundings.
    """
    hand = load_hand(hand, settings.spheres) if isinstance(hand, str) else hand
    box = np.stack([observation.points.min(axis=0), observation.points.max(axis=0)])
    gpis, com = known or _known(observation, settings, seed, additions, box)
    surroundings.check(observation)
    _check_base(hand, observation.points)
    surroundings = surroundings.and_seen(observation)
    around = surroundings.around(settings, hand.arm is not None)
    return Problem(
        hand=hand,
        gpis=gpis,
        settings=settings,
        box=box,
        table_height=observation.table_height,
        com=com,
        terms=additions.all_terms(settings, around),
        constraints=_constraints(settings, hand, gpis, additions, around),
        formulation=additions.chosen(settings),
        thing=upright_box(observation.points, observation.table_height, "object"),
        surroundings=surroundings,
        additions=additions,
    )


def _check_base(hand: Hand, points: Array) -> None:
    """Raise `InputError` for an arm that stands far from the observed points (N, 3) [m], in other units, or in them."""
    if hand.arm is None:
        return
    arm, asked = hand.arm, "is it in metres, in the frame of the cloud (base in its arm.yaml, or --arm-base)?"
    away = float(np.linalg.norm(arm.base[:3] - (points.min(axis=0) + points.max(axis=0)) / 2))
    if away > FAR:
        where = f"is {away:.0f} m from the object, more than {FAR:g} m"
        raise InputError(f"the base of the arm '{arm.name}' {where}; {asked}")
    still = [i for i in range(len(arm.spheres)) if i not in arm.free_spheres]  # the others keep clear of the object
    gaps = cdist(points, arm_spheres(arm, arm.home)[still]) - [arm.spheres[i].radius for i in still]
    inside = float((gaps < 0).any(axis=1).mean())
    if inside > MOST_INSIDE:
        raise InputError(f"the arm '{arm.name}' stands in {inside:.0%} of the object's points; {asked}")


def with_limits(problem: Problem, limits: Limits) -> Problem:
    """The same problem with other limits."""
    settings = replace(problem.settings, limits=limits)
    constraints = _constraints(settings, problem.hand, problem.gpis, problem.additions, problem.around)
    return replace(problem, settings=settings, constraints=constraints)


def place_error(limits: Limits, tight: bool) -> float:
    """The error of the hand's position [m] that the pregrasp allows for; `tight`: where a wide gap is hard to keep."""
    return min(limits.place_error, limits.place_error_tight) if tight else limits.place_error


def _constraints(
    settings: Settings, hand: Hand, gpis: Gpis, additions: Additions, around: Around
) -> tuple[Constraint, ...]:
    return additions.all_constraints(_with_gaps(settings, hand, gpis), around)


def _known(observation: Observation, settings: Settings, seed: int, additions: Additions, box: Array) -> Known:
    with one_thread():
        gpis = fit(training_set(observation, settings.gpis, seed, additions.kernel, settings.free_space))
    return gpis, _centre_of_mass(gpis, box, observation.table_height)


def _with_gaps(settings: Settings, hand: Hand, gpis: Gpis) -> Settings:
    """Settings with the gaps of this hand and surface: one without free space bulges outwards, a gap in itself."""
    bulges = settings.free_space.used and not gpis.free_space
    reserve = settings.free_space.reserve if bulges else 0.0
    gap = place_error(settings.limits, tight=bulges or hand.few_joints)
    gap, margin = (max(x - reserve, 0.0) for x in (gap, settings.closing.margin))
    limits, closing = replace(settings.limits, place_error=gap), replace(settings.closing, margin=margin)
    return replace(settings, limits=limits, closing=closing)


def _centre_of_mass(gpis: Gpis, box: Array, table: float) -> Array:
    """Centroid (3,) [m] of the surface's inside near the points' `box` (2, 3); the box's middle without free space.

    On the tuning half it is 3 to 6 mm off the true one, seen from above, and the middle of the box 5 to 9 mm.
    """
    low, high = np.append(box[0, :2] - UNSEEN, table), box[1] + UNSEEN
    found = centroid(gpis, low, high) if gpis.free_space else None
    return np.asarray(box.mean(axis=0)) if found is None else found
