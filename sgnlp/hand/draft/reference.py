"""The relaxed posture: the one in which the pads best surround a ball in front of the palm.

Let a_i be the centres of the pads, r_i their radii, w_i their directions, and R the radius of a ball about s. The
joints q, s and R minimise a sum of squares. The pads keep a gap to the ball, |a_i - s| = R + r_i + gap. They face it,
w_i = -e_i with e_i = (a_i - s) / |a_i - s|, and move towards it as the fingers close. The thumb t opposes the others,
e_t = -Σ e_i / |Σ e_i|. Other spheres are outside the ball, pads apart, joints near the middle of their ranges, and the
ball nearly as large as wanted.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from sgnlp.base.arrays import Array
from sgnlp.hand.draft.body import Body
from sgnlp.hand.draft.closing import sense
from sgnlp.hand.placements import Chain as Placements
from sgnlp.hand.placements import constant, placements

BALL = 0.25
"""Wanted radius of the ball, in lengths of a finger: 34 mm for an Allegro hand, an orange."""
SMALLEST, LEAST, LARGEST = 0.01, 0.025, 0.04
"""Least radius of the ball, and bounds of the wanted radius [m]: hands are made for objects of 5 to 8 cm."""
SMALLER = 0.01
"""A ball smaller than wanted by this [m] costs as much as an error of `LENGTH`: a hand may not open wider."""
GAP = 0.1
"""Gap between ball and pads, in lengths of a finger: 15 mm in the Allegro's relaxed posture."""
LENGTH = 0.005
"""A distance [m] that costs as much as a pad half a radian off its direction, or a thumb a quarter."""
LOOK, CLOSE, OPPOSE, MIDDLE = 0.5, 1.5, 2.0, 0.3
"""Weights: [1/rad] of the pads' directions, of the closing direction of a finger with one joint, and of the thumb; and
of half a range off the middle. A finger with two joints can move in a plane, one with three anywhere: its closing
direction has a smaller weight."""
ROOM = 0.1
"""Least distance of the joints from their limits, in ranges."""
BENT, DRAWS = (0.15, 0.3, 0.45), 2
"""Closing of the hand at the starts of the search, in ranges, and the number of additional random starts."""
TOLERANCE, STEPS = 1e-3, 50
"""End of a search: a relative decrease, or a number of steps."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The posture, the ball, and the chain that opposes the others."""

    joints: Array  # (n,) [rad or m]
    ball: Array  # (3,) [m] in the root's frame
    radius: float  # [m]
    thumb: int
    cost: float


def reference(body: Body) -> Reference:
    """The best of several searches. If no chain is named thumb, each is tried as the thumb."""
    named = [i for i, chain in enumerate(body.chains) if chain.name == "thumb"]
    found = [one for thumb in named or range(len(body.chains)) for one in _searches(body, thumb)]
    return min(found, key=lambda one: one.cost)


def finger_length(body: Body) -> float:
    """The median length [m] of the fingers, from the first joint to the pad along the joints between."""
    model = body.skeleton.model
    lengths = []
    for chain, pad in zip(body.chains, body.pads, strict=True):
        bones = [float(np.linalg.norm(model.jointPlacements[j].translation)) for j in chain.joints[1:]]
        lengths.append(sum(bones) + float(np.linalg.norm(pad.centre)))
    return float(np.median(lengths))


def _searches(body: Body, thumb: int) -> Iterator[Reference]:
    model, m = body.skeleton.model, len(body.chains)
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    radius = float(np.clip(BALL * finger_length(body), LEAST, LARGEST))
    misses = _misses(body, thumb, radius)
    room = ROOM * (high - low)
    bounds = np.r_[low + room, np.full(3, -np.inf), SMALLEST], np.r_[high - room, np.full(3, np.inf), LARGEST]
    for joints in _starts(body):
        begin = np.clip(np.r_[joints, body.centres(joints)[:m].mean(axis=0), radius], *bounds)
        done = least_squares(misses.value, begin, misses.jacobian, bounds=bounds, ftol=TOLERANCE, max_nfev=STEPS)
        yield Reference(done.x[:-4], done.x[-4:-1], float(done.x[-1]), thumb, float(done.cost))


def _starts(body: Body) -> list[Array]:
    """Joints (n,) where the searches begin: the hand closed by a part, and random ones."""
    model, rng = body.skeleton.model, np.random.default_rng(0)
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    bent = [(low + high) / 2 + _closing(body) * (share - 0.5) * (high - low) for share in BENT]
    return bent + [rng.uniform(low, high) for _ in range(DRAWS)]


def _closing(body: Body) -> Array:
    """The velocity (n,) of the joints when the hand closes: 1 or -1, or 0 for spreading joints."""
    model = body.skeleton.model
    own = [joint for joint in range(1, model.njoints) if model.joints[joint].nq]
    return np.array([float(sense(body.skeleton, joint)) for joint in own])


@dataclass(frozen=True)
class _Misses:
    """The residuals (K,) and their derivatives (K, n + 4) as functions of joints, ball and its radius (n + 4,)."""

    function: ca.Function

    def value(self, x: Array) -> Array:
        return np.array(self.function(x)[0]).ravel()

    def jacobian(self, x: Array) -> Array:
        return np.array(self.function(x)[1])


def _misses(body: Body, thumb: int, asked: float) -> _Misses:
    """The residuals to minimise, for one finger as the thumb and the wanted radius [m]."""
    model, m = body.skeleton.model, len(body.chains)
    q, s, radius = ca.SX.sym("q", model.nq), ca.SX.sym("s", 3), ca.SX.sym("radius")
    chain = placements(model, q, "model walk")  # a new hand has no compiled functions
    centres = [_place(chain, joint, ball.centre) for joint, ball in body.balls]
    gap = GAP * finger_length(body)
    closing = _closing(body)
    away = [_unit(centre - s) for centre in centres[:m]]
    rows: list[ca.SX] = []
    for i, pad in enumerate(body.pads):
        rows.append((ca.norm_2(centres[i] - s) - radius - pad.radius - gap) / LENGTH)
        rows.append(LOOK * (ca.mtimes(chain[body.chains[i].end][0], constant(pad.normal)) + away[i]))
        free = np.unique([model.idx_qs[joint] for joint in body.chains[i].joints])
        rows.append(CLOSE / len(free) * (_unit(ca.jtimes(centres[i], q, closing)) + away[i]))
    rows.append(OPPOSE * (away[thumb] + _unit(sum(one for i, one in enumerate(away) if i != thumb))))
    for i in range(m):
        for j in range(i):
            least = body.pads[i].radius + body.pads[j].radius + gap
            rows.append(_short(ca.norm_2(centres[i] - centres[j]), least) / LENGTH)
    rows += [_short(ca.norm_2(c - s), radius + r) / LENGTH for c, r in zip(centres[m:], body.radii[m:], strict=True)]
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    rows.append(MIDDLE * (2 * q - low - high) / (high - low))
    rows.append((radius - asked) / SMALLER)
    residuals, x = ca.vertcat(*rows), ca.vertcat(q, s, radius)
    return _Misses(ca.Function("misses", [x], [residuals, ca.jacobian(residuals, x)]))


def _place(chain: Placements, joint: int, point: Array) -> ca.SX:
    rotation, position = chain[joint]
    return position + ca.mtimes(rotation, constant(point))


def _unit(vector: ca.SX) -> ca.SX:
    """A vector over its length, which is bounded below by a nanometre."""
    return vector / ca.sqrt(ca.sumsqr(vector) + 1e-18)


def _short(distance: ca.SX, least: ca.SX | float) -> ca.SX:
    """The amount by which a distance [m] is too small."""
    return ca.fmax(least - distance, 0)
