"""The probability that a grasp holds at the load of its plan, by a logistic model of features of the plan.

    p = 1/(1 + exp(-(b + Σ_j w_j φ_j))),   φ_j = clip(x_j, l_j, h_j)/u_j

x_j is a feature of the plan, u_j its unit, and l_j to h_j the range of the trials that the weights w_j were fitted to:
nothing is extrapolated. Held means the full score in simulation with the plan's own mass and friction.

The numbers of `MODEL` are those of the table "Coefficients" of `results/confidence`, which the command `sgnlp study
confidence problems/*.npz` makes: a fit with a ridge on the tuning half, judged on the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, isnan, nan

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import expit

from sgnlp.base.arrays import Array
from sgnlp.base.settings import Settings
from sgnlp.perception.observation import Observation
from sgnlp.planning.solution import Solution, torque_share

UNKNOWN = (
    "confidence unknown: only a feasible grasp by springs has one, where the hand at contact is planned "
    "(--closing.planned) and the surface is fitted with free space (--free-space.used, with the cameras known)"
)


@dataclass(frozen=True)
class Feature:
    """A feature of a planned grasp: `unit` divides its value, `low` to `high` is the range seen in the trials."""

    name: str
    about: str
    unit: float
    weight: float = 0.0
    low: float = -inf
    high: float = inf


@dataclass(frozen=True)
class Model:
    """An intercept b and F features with their weights."""

    intercept: float
    features: tuple[Feature, ...]

    def scaled(self, values: Array) -> Array:
        """φ (G, F) of the values x (G, F) of G grasps."""
        low, high, unit = np.array([(f.low, f.high, f.unit) for f in self.features]).T
        return np.asarray(np.clip(values, low, high) / unit)

    def probability(self, values: Array) -> Array:
        """p (G,) of the values x (G, F) of G grasps; NaN where a value is NaN."""
        return np.asarray(expit(self.intercept + self.scaled(values) @ [f.weight for f in self.features]))


MODEL = Model(
    intercept=-5.12,
    features=(
        Feature("margin", "worst contact margin", 0.05, 0.9761, 0.05, 0.1421),
        Feature("margin_mean", "mean contact margin over fingers and states", 0.05, 0.7085, 0.07209, 0.1424),
        Feature("deviation_mm", "mean σ_d at the contacts", 1.0, -0.248, 1.54, 15.55),
        Feature("deviation_max_mm", "largest σ_d at a contact", 1.0, -0.06497, 1.654, 40.32),
        Feature("link_mm", "least clearance of a link from the object at first contact", 5.0, -0.00623, 8.0, 12.69),
        Feature("torque_reserve", "1 less the largest joint torque over the effort", 0.1, 0.4525, -1.517e-09, 0.2202),
        Feature("way_mm", "least clearance of a link on the way to first contact", 5.0, 0.4525, 7.911, 13.55),
        Feature("unseen_mm", "largest distance of a contact from a measured point", 10.0, 0.4899, 0.9379, 82.49),
        Feature("shift_mm", "largest motion of a contact to the equilibrium", 5.0, -0.02076, 1.627, 2.998),
        Feature("log_stiffness", "log10 of the stiffness ρ of the equilibrium in mN m", 0.5, 0.6176, 1.427, 3.019),
    ),
)
"""Fitted to 274 grasps of 47 problems, of which 89 % held."""


def known(settings: Settings, free_space: bool) -> bool:
    """Whether plans with these settings have a confidence; `free_space` is whether the surface is fitted with it."""
    return settings.closing.planned and settings.contact.metric == "spring" and free_space


def values(s: Solution, points: cKDTree) -> Array:
    """The features x (F,) of `MODEL`, for a grasp whose hand at contact is planned; `points` are the measured ones."""
    g = s.grasp
    (way,) = (check.value for check in s.checks if check.name == "way")
    found = {
        "margin": s.worst_margin,
        "margin_mean": np.mean([s.margins_initial, s.margins_equilibrium]),
        "deviation_mm": 1e3 * g.contact_deviations.mean(),
        "deviation_max_mm": 1e3 * g.contact_deviations.max(),
        "link_mm": 1e3 * s.clearances_contact.min(),
        "torque_reserve": 1 - torque_share(g, "spring"),
        "way_mm": way,
        "unseen_mm": 1e3 * np.max(points.query(s.contact_points)[0]),
        "shift_mm": 1e3 * np.linalg.norm(g.contacts_eq - g.contacts, axis=1).max(),
        "log_stiffness": np.log10(1e3 * g.stiffness),
    }
    return np.array([found[feature.name] for feature in MODEL.features])


def with_confidence(
    solutions: Sequence[Solution], cloud: Observation, settings: Settings, free_space: bool
) -> list[Solution]:
    """The same solutions, each with its confidence; NaN if it is unknown or the grasp is not feasible."""
    if not known(settings, free_space):
        return list(solutions)
    points = cKDTree(cloud.points, compact_nodes=False, balanced_tree=False)  # quick to build, for few queries
    found = [float(MODEL.probability(values(s, points)[None])[0]) if s.feasible else nan for s in solutions]
    return [replace(s, confidence=p) for s, p in zip(solutions, found, strict=True)]


def words(confidence: float) -> str:
    """What a confidence means."""
    if isnan(confidence):
        return UNKNOWN
    return f"confidence {confidence:.2f}: of 100 such grasps, about {100 * confidence:.0f} held in simulation"


def refusal(confidence: float, least: float) -> str:
    """Why a grasp of this confidence is refused if at least `least` is required; "" if it is not refused.

    An unknown confidence is never enough, unless `least` is 0.
    """
    if least == 0 or confidence >= least:
        return ""
    return "its confidence is unknown" if isnan(confidence) else f"its confidence {confidence:.3g} is below {least:g}"
