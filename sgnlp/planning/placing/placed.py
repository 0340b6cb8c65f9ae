"""The wrist pose of a start, chosen among many near it, with the fingers before their contacts.

A finger of four joints reaches a place and has one left to press from another side: the program makes a grasp of nearly
every start. Fingers of fewer joints meet the object where their way ends on it, and press along that way. Whether the
forces can then be balanced inside the friction cones depends on the pose of the wrist, and from a bad one the program
ends in an infeasible place. So `CANDIDATES` poses are drawn near each start of such a hand, and judged:

    |what is left of the best balance of the forces| + `COST` Σ (too near or too far) + `OFF` Σ (off the cone)

Each finger touches where its way meets the surface. Too far is a pad that nowhere meets it. Too near is a pad that is
inside the object when the hand is open, a contact too near the table, and a link inside its gap from object or table.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array, IntArray
from sgnlp.hand.kinematics import frames
from sgnlp.planning.placing.balance import balance
from sgnlp.planning.placing.closing import STEP, Closing, closing, nudged
from sgnlp.planning.placing.poses import others
from sgnlp.planning.problem import Problem, place_error
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.surface.gpis import MEAN_JET, MIN_SLOPE, VARIANCE_JET
from sgnlp.surface.native import raw_jets

CANDIDATES = 100
"""Poses for each start."""
COST, OFF = 100.0, 10.0
"""A centimetre counts as 1 N, and so does a cosine too small by 0.1."""
FINEST = 10
"""The links are looked at for so many of the best candidates: that takes longer than the rest."""
BEHIND = 0.002
"""The tips begin by this more than the gap from their contacts [m]."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A start near which the fingers can hold the object: wrist pose (7,), joints (n,), targets (m, 3), gains (m,)."""

    wrist: Array
    joints: Array
    targets: Array
    gains: Array


@dataclass(frozen=True, eq=False)
class _Touch:
    """Where the fingers of C poses meet the object, and what is wrong with it."""

    places: Array  # (C, m), on the way of closing
    contacts: Array  # (C, m, 3) [m], of the tips
    forces: Array  # (C, m, 3) [N]
    cost: Array  # (C,)


class _Near:
    """The surface near the object: outside the cube in which it is valid, the way to the cube is added."""

    def __init__(self, problem: Problem):
        self._jets = raw_jets(problem.gpis, 0, problem.settings.solver.compiled)
        self._centre, self._side = problem.gpis.centre, problem.gpis.radius / np.sqrt(3)

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Distances (...) [m] and normals (..., 3) of points (..., 3) [m]."""
        inside = np.clip(points, self._centre - self._side, self._centre + self._side)
        flat = np.asfortranarray(inside.reshape(-1, 3))
        jets = np.zeros((len(flat), MEAN_JET))
        self._jets.values(flat, jets, np.zeros((0, VARIANCE_JET)))
        slopes = np.sqrt((jets[:, 1:4] ** 2).sum(axis=1) + MIN_SLOPE**2)
        away = np.linalg.norm(points - inside, axis=-1)
        normals = (jets[:, 1:4] / slopes[:, None]).reshape(points.shape)
        return (jets[:, 0] / slopes).reshape(away.shape) + away, normals


def chooses(problem: Problem) -> bool:
    """Whether the starts of a problem are chosen: of a hand with few joints, without an arm, that plans its contact."""
    hand, settings = problem.hand, problem.settings
    return hand.few_joints and hand.arm is None and settings.closing.planned and settings.contact.c < 1


def placed(problem: Problem, wrist: Array, poses: Array, seed: tuple[int, int]) -> Placed:
    """The best of the candidates for a start: its own pose (7,), and poses like those of the file (W, 7)."""
    surface, way, rng = _Near(problem), closing(problem.hand), np.random.default_rng(seed)
    wrists = np.vstack([wrist, others(poses, way.middle, problem.box, CANDIDATES - 1, rng)])
    touch = _touches(problem, surface, way, wrists)
    best = np.argsort(touch.cost, kind="stable")[:FINEST]
    costs = [touch.cost[i] + COST * _links(problem, surface, way, wrists[i], touch.places[i]) for i in best]
    chosen = best[int(np.argmin(costs))]
    return _before(problem, way, wrists[chosen], touch, chosen)


def _touches(problem: Problem, surface: _Near, way: Closing, wrists: Array) -> _Touch:
    hand, limits, contact = problem.hand, problem.settings.limits, problem.settings.contact
    rotations = np.array([pin.XYZQUATToSE3(wrist).rotation for wrist in wrists])
    tips = np.einsum("cij,kmj->ckmi", rotations, way.tips) + wrists[:, None, None, :3]
    clear = surface(tips)[0] - hand.tip_radii
    places, met = _meeting(clear)
    contacts = _along(tips, places)
    normals = surface(contacts)[1]
    spans = np.take_along_axis(way.spans[None], met[:, None, :, None, None], axis=1)[:, 0]
    spans = np.einsum("cij,cmjk,clk->cmil", rotations, spans, rotations)
    wrong = np.maximum(_along(clear, places), 0) + np.maximum(_gap(problem) - clear[:, 0], 0)
    wrong += np.maximum(problem.table_height + limits.table_margin + hand.tip_radii - contacts[..., 2], 0)
    wrong += _astray(problem, contacts - hand.tip_radii[:, None] * normals)
    weight, bounds = np.array([0, 0, contact.mass * GRAVITY]), np.array([limits.force_min, limits.force_max])
    held = balance(contacts - problem.com, normals, spans, contact.friction, bounds, weight)
    cost = held.left + COST * wrong.sum(axis=1) + OFF * held.off.sum(axis=1)
    return _Touch(places, contacts, held.forces, cost)


def _meeting(clear: Array) -> tuple[Array, IntArray]:
    """Where the way of each tip meets the surface (C, m), in steps, and the step after it, by the clearances (C, K, m).

    Where it does not, this is where it comes nearest.
    """
    met = np.where((clear <= 0).any(axis=1), (clear <= 0).argmax(axis=1), clear.argmin(axis=1))
    before = np.maximum(met - 1, 0)
    there, here = (np.take_along_axis(clear, k[:, None], axis=1)[:, 0] for k in (met, before))
    crossing = (there <= 0) & (here > 0)
    share = np.where(crossing, here / np.where(crossing, here - there, 1.0), 1.0)
    return before + share * (met - before), met


def _along(values: Array, places: Array) -> Array:
    """Values (C, K, m, ...) between their steps at places (C, m)."""
    low = np.minimum(places.astype(int), values.shape[1] - 2)
    rows, fingers = np.arange(len(values))[:, None], np.arange(places.shape[1])
    share = (places - low).reshape(places.shape + (1,) * (values.ndim - 3))
    return values[rows, low, fingers] * (1 - share) + values[rows, low + 1, fingers] * share


def _astray(problem: Problem, points: Array) -> Array:
    """By how much contact points (C, m, 3) are in regions to avoid and out of those to touch (C, m) [m]."""
    fields, margin, flat = problem.fields, problem.settings.limits.region_margin, points.reshape(-1, 3)
    wrong = np.maximum(margin - fields.avoid.distance(flat), 0)
    if fields.touch.shapes:
        wrong += np.maximum(margin + fields.touch.distance(flat), 0)
    return wrong.reshape(points.shape[:2])


def _gap(problem: Problem) -> float:
    """The gap [m] between pads and object at the pregrasp."""
    return problem.settings.limits.object_margin + place_error(problem.settings.limits, problem.hand.few_joints)


def _links(problem: Problem, surface: _Near, way: Closing, wrist: Array, places: Array) -> float:
    """By how much the links are too near object, table and obstacles [m], in all, at contact and before it."""
    hand, limits = problem.hand, problem.settings.limits
    links = np.delete(np.arange(len(hand.spheres)), hand.tip_spheres)
    radii = np.array([hand.spheres[i].radius for i in links])
    wrong, back = 0.0, (_gap(problem) + BEHIND) / STEP
    for at, least in ((places, problem.settings.closing.margin), (np.maximum(places - back, 0), _gap(problem))):
        centres = frames(hand, wrist, way.between(at))[1][links]
        wrong += np.maximum(least - surface(centres)[0] + radii, 0).sum()
        wrong += np.maximum(problem.table_height + limits.table_margin + radii - centres[:, 2], 0).sum()
        wrong += np.maximum(limits.obstacle_margin + radii - problem.fields.near.distance(centres), 0).sum()
    return float(wrong)


def _before(problem: Problem, way: Closing, wrist: Array, touch: _Touch, chosen: int) -> Placed:
    """The start before the contacts: each tip on the line of its force, and its target where the spring gives it."""
    forces, contacts, c = touch.forces[chosen], touch.contacts[chosen], problem.settings.contact.c
    sizes = np.linalg.norm(forces, axis=1)
    along, back = forces / sizes[:, None], _gap(problem) + BEHIND
    stretch = back * c / (1 - c)
    joints = way.between(np.maximum(touch.places[chosen] - back / STEP, 0))
    joints = nudged(problem.hand, wrist, joints, contacts - back * along)
    gains = np.clip(sizes / stretch, *problem.gain_bounds())
    return Placed(wrist, joints, contacts + stretch * along, gains)
