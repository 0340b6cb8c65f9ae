"""A planning problem: a hand, a fitted surface and settings, as numbers for the nonlinear program."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pinocchio import exp3
from threadpoolctl import threadpool_limits

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation
from sgnlp.planning.warm_start import added_bounds
from sgnlp.program.nlp import Nlp, variable_units
from sgnlp.program.structure import Structure, structure
from sgnlp.program.terms import TERMS
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.training import training_set

Array = NDArray[np.float64]

MAX_TURN = 1.8
"""Bound of each angular coordinate of the wrist's tangent [rad]: the cube inside the ball |ω| < π."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A hand, a surface and settings. `box` (2, 3) [m] are the corners of the observed points' box."""

    hand: Hand
    gpis: Gpis
    settings: Settings
    box: Array
    table_height: float
    com: Array  # (3,) [m], centre of mass: the middle of the box

    def structure(self, formulation: str) -> Structure:
        """The structure of the symbolic functions of a formulation, `penalty`, `constrained`, `elastic` or `lifted`."""
        return structure(self.settings, formulation)

    def weights(self) -> Array:
        """The weight of each of `energies.TERMS`; 0 for another metric and for the motion if E_pose replaces it."""
        metric = self.settings.contact.metric
        others = {t.name for t in TERMS if t.metric not in ("", metric)} | ({"reg_motion"} if self.moves else set())
        return np.array([0.0 if t.name in others else getattr(self.settings.weights, t.weight) for t in TERMS])

    @property
    def moves(self) -> bool:
        """Whether the object is to move on the way to the equilibrium: E_pose has a weight."""
        return self.settings.weights.pose > 0

    @property
    def displacement(self) -> Array:
        """Desired displacement (3,) [m] of the object's middle on the way to the equilibrium."""
        return np.array(self.settings.contact.displacement) * self.moves

    @property
    def turn(self) -> Array:
        """Desired rotation (3, 3) of the object about its middle."""
        return exp3(np.array(self.settings.contact.turn) * self.moves)

    def parameters(self, nlp: Nlp, wrist: Array, joints: Array) -> Array:
        """The parameter vector for the seed pose `wrist` (7) and `joints` (n)."""
        contact, smoothing = self.settings.contact, self.settings.smoothing
        return nlp.parameters.pack(
            {
                "wrist": wrist,
                "joints": joints,
                "weights": self.weights(),
                "c": contact.c,
                "friction": contact.friction,
                "pad": float(contact.pad),
                "foot": float(nlp.structure.formulation != "penalty"),
                "force_min": self.settings.limits.force_min,
                "displacement": self.displacement,
                "turn": self.turn.ravel(order="F"),
                "mass": contact.mass,
                "com": self.com,
                "table": self.table_height,
                "ball_centre": self.gpis.centre,
                "ball_radius": self.gpis.radius,
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
        side = self.gpis.radius / np.sqrt(3)  # of the cube inside the surface model's ball
        wrist = np.repeat([limits.wrist_travel, MAX_TURN], 3)
        gains = self.gain_bounds()
        targets = np.tile(self.gpis.centre, m)
        low = [-wrist, self.hand.lower - joints, targets - side, gains[0]]
        high = [wrist, self.hand.upper - joints, targets + side, gains[1]]
        added_low, added_high = added_bounds(nlp, self.row_bounds(nlp))
        units = variable_units(self.hand)
        return (
            np.concatenate([np.concatenate(low) / units, added_low]),
            np.concatenate([np.concatenate(high) / units, added_high]),
        )

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
        """Bounds (ng,) of the scaled rows."""
        bounds = [np.array(c.bounds(self.settings)) / c.scale for c in nlp.constraints]
        rows = np.repeat(np.array(bounds), nlp.row_sizes, axis=0)
        return rows[:, 0], rows[:, 1]


def pose(observation: Observation, hand: str | Hand, settings: Settings, seed: int = 0) -> Problem:
    """Fit the surface of an observation and pose the problem of grasping it."""
    hand = load_hand(hand, settings.spheres) if isinstance(hand, str) else hand
    with threadpool_limits(1):  # the bits of a factorisation depend on the number of threads
        gpis = fit(training_set(observation, settings.gpis, seed), settings.gpis.kernel)
    box = np.stack([observation.points.min(axis=0), observation.points.max(axis=0)])
    return Problem(hand, gpis, settings, box, observation.table_height, box.mean(axis=0))
