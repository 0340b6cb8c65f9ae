"""Clearances of the hand from the object, from obstacles and from itself, at every sample of a motion.

The distance of a point x to the object is that of the surface model where the model is valid, within its ball. Outside
it, with x' the nearest point of the ball, |x - y|² ≥ |x - x'|² + |x' - y|² for every y of a convex body, so that

    d(x) ≥ √(|x - x'|² + max(d(x'), 0)²)

The object is assumed to end within `UNSEEN` of the box of its points. Farther than `NEAR` from there only this cheap
bound is used: such spheres are clear, and most spheres are there most of the time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.arm_kinematics import arm_spheres
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames
from sgnlp.planning.motion.trajectory import BETWEEN
from sgnlp.planning.problem import UNSEEN, Problem
from sgnlp.program.carried import far_spheres
from sgnlp.program.constraint import LENGTH, Check
from sgnlp.program.tolerances import CLEARANCE
from sgnlp.surface.gpis import Gpis
from sgnlp.surface.shape_field import ShapeField

INSIDE = 1 - 1e-9
"""Share of the ball's radius that counts as inside, to allow for rounding."""
NEAR = 0.04
"""[m] Larger than the spheres of a hand, whose radii are 1 to 3 cm."""
CHUNK = 2048
"""Number of points whose distance to the surface is computed at a time."""
ORIGIN = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Samples:
    """The spheres of a part of a motion: K samples of S spheres."""

    name: str
    times: Array  # (K,) [s]
    centres: Array  # (K, S, 3) [m]
    radii: Array  # (S,) [m]
    names: tuple[str, ...]  # (S,)

    def of(self, chosen: Sequence[int]) -> "Samples":
        """The samples of some of the spheres."""
        i = list(chosen)
        return Samples(self.name, self.times, self.centres[:, i], self.radii[i], tuple(self.names[j] for j in i))


def samples(hand: Hand, name: str, times: Array, wrist: Array, joints: Array, arm_joints: Array) -> Samples:
    """The hand's spheres at wrist poses (K, 7) and joints (K, n), followed by those of its arm at joints (K, a)."""
    postures, which = np.unique(joints, axis=0, return_inverse=True)
    local = np.array([frames(hand, ORIGIN, q)[1] for q in postures])[which.ravel()]
    roots = [pin.XYZQUATToSE3(pose) for pose in wrist]
    centres = np.array([x @ root.rotation.T + root.translation for x, root in zip(local, roots, strict=True)])
    spheres, arm = hand.spheres, hand.arm
    if arm is not None:
        spheres = (*spheres, *arm.spheres)
        centres = np.concatenate([centres, np.array([arm_spheres(arm, q) for q in arm_joints])], axis=1)
    return Samples(name, times, centres, np.array([s.radius for s in spheres]), tuple(s.name for s in spheres))


def moving(hand: Hand) -> list[int]:
    """Indices of the spheres of `samples` that can reach the table: all of the hand, and the moving ones of its arm."""
    found, arm = list(range(len(hand.spheres))), hand.arm
    return found if arm is None else [*found, *(len(found) + i for i in arm.free_spheres)]


def to_object(problem: Problem, samples: Samples) -> Check:
    """Spheres clear of the object."""
    clear = surface_distance(problem.gpis, problem.box, samples.centres.reshape(-1, 3))
    return _check(samples, "object", clear.reshape(samples.centres.shape[:2]), np.zeros(len(samples.radii)))


def to_obstacles(samples: Samples, field: ShapeField, margin: float) -> Check:
    """Spheres clear of obstacles by a margin [m]."""
    clear = field.distance(samples.centres.reshape(-1, 3)).reshape(samples.centres.shape[:2])

    def nearest(k: int, i: int) -> str:
        return f" to {field.nearest(samples.centres[k, i][None])[0]}"

    return _check(samples, "obstacles", clear, np.full(len(samples.radii), margin), nearest)


def to_table(samples: Samples, height: float, margins: Array) -> Check:
    """Spheres clear of the table at this height [m], by `margins` (S,) [m]."""
    return _check(samples, "table", samples.centres[:, :, 2] - height, margins)


def to_itself(hand: Hand, samples: Samples) -> Check:
    """Pairs of spheres clear of each other: within the hand, within its arm, and the hand to the arm's far spheres."""
    first, arm, pairs = len(hand.spheres), hand.arm, list(hand.pairs)
    if arm is not None:
        pairs += [(first + a, first + b) for a, b in arm.pairs]
        pairs += [(i, first + j) for i in range(first) for j in far_spheres(arm)]
    i, j = np.array(pairs, int).reshape(-1, 2).T
    names = tuple(f"{samples.names[a]} to {samples.names[b]}" for a, b in pairs)
    apart = np.linalg.norm(samples.centres[:, i] - samples.centres[:, j], axis=2)
    both = Samples(samples.name, samples.times, samples.centres[:, i], samples.radii[i] + samples.radii[j], names)
    return _check(both, "self", apart, np.zeros(len(i)))


def load_to_obstacles(name: str, times: Array, points: Array, rises: Array, field: ShapeField) -> Check:
    """Measured points (N, 3) of the object, lifted by `rises` (K,) [m], clear of obstacles."""
    up = np.array([0.0, 0.0, 1.0])
    clear = np.array([field.distance(points + rise * up).min(initial=inf) for rise in rises])[:, None]
    carried = Samples(name, times, np.zeros((len(times), 1, 3)), np.zeros(1), ("the object",))
    return _check(carried, "object and obstacles", clear, np.zeros(1))


def surface_distance(gpis: Gpis, box: Array, points: Array) -> Array:
    """The distance (K,) [m] of points (K, 3) to the object, or a lower bound if they are far away."""
    found = np.linalg.norm(np.maximum(np.maximum(box[0] - points, points - box[1]), 0.0), axis=1) - UNSEEN
    near = np.flatnonzero(found < NEAR)
    for part in np.split(near, range(CHUNK, len(near), CHUNK)):
        found[part] = _modelled(gpis, points[part])
    return found


def _modelled(gpis: Gpis, points: Array) -> Array:
    """Distances (K,) of points (K, 3) by the surface model: the distance inside its ball, the bound outside."""
    away = points - gpis.centre
    share = np.minimum(1.0, INSIDE * gpis.radius / np.maximum(np.linalg.norm(away, axis=1), np.finfo(float).tiny))
    inside = gpis.centre + away * share[:, None]
    found = gpis.distance(inside)
    return np.where(share < 1.0, np.hypot(np.linalg.norm(points - inside, axis=1), np.maximum(found, 0.0)), found)


def _check(
    samples: Samples, what: str, distances: Array, margins: Array, nearest: Callable[[int, int], str] | None = None
) -> Check:
    """The check of the worst of distances (K, S) [m] of sphere centres, with margins (S,) [m] for their surfaces."""
    name, clear = f"{samples.name}{BETWEEN}{what}", distances - samples.radii
    value, margin, where = inf, 0.0, ""
    if clear.size:
        k, i = (int(at) for at in np.unravel_index(np.argmin(clear - margins), clear.shape))
        value, margin = float(clear[k, i]), float(margins[i])
        where = f"{samples.names[i]}{nearest(k, i) if nearest else ''} at {samples.times[k]:.2f} s"
    passed, read = value - margin >= -CLEARANCE, LENGTH.reading
    return Check(name, read(value), read(margin), inf, read(CLEARANCE), LENGTH.symbol, passed, where)
