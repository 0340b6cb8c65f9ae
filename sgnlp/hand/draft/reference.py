"""The relaxed posture: the one in which the pads stand around a ball in front of the palm best.

With a_i the centres of the pads, r_i their radii and w_i where they look, and a ball of radius R about s, the joints q,
s and R minimise a sum of squares. The pads stand off the ball, |a_i - s| = R + r_i + gap. They look at it, w_i = -e_i
with e_i = (a_i - s) / |a_i - s|, and move to it as the fingers close. The thumb t opposes the others,
e_t = -Σ e_i / |Σ e_i|. Other spheres are outside of the ball, pads apart, joints near the middle of their ranges, and
the ball nearly as large as is asked.
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
"""Radius of the ball that is asked for, in lengths of a finger: 34 mm for an Allegro hand, an orange."""
SMALLEST, LEAST, LARGEST = 0.01, 0.025, 0.04
"""Least radius of the ball, and bounds of what is asked for [m]: hands are made for objects of 5 to 8 cm."""
SMALLER = 0.01
"""By how much [m] a ball is smaller that weighs as much as a `LENGTH`: the hand may not open wider."""
GAP = 0.1
"""Between ball and pads, in lengths of a finger: the Allegro's relaxed posture leaves 15 mm."""
LENGTH = 0.005
"""A distance [m] that weighs as much as a pad that looks half a radian off, or a thumb a quarter."""
LOOK, CLOSE, OPPOSE, MIDDLE = 0.5, 1.5, 2.0, 0.3
"""Weights: 1 / rad where pads look, where a finger of one joint moves as it closes, for the thumb, and for half a range
off its middle. One of two joints can move in a plane, one of three anywhere: its way of closing weighs less."""
ROOM = 0.1
"""How far the joints stay from their limits, in ranges."""
BENT, DRAWS = (0.15, 0.3, 0.45), 2
"""How far closed the hand is at the starts of the search, in ranges, and starts beside these, drawn at random."""
TOLERANCE, STEPS = 1e-3, 50
"""Where a search ends: at a relative decrease, or after so many steps."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The posture, the ball, and the chain that opposes the others."""

    joints: Array  # (n,) [rad or m]
    ball: Array  # (3,) [m] in the root's frame
    radius: float  # [m]
    thumb: int
    cost: float


def reference(body: Body) -> Reference:
    """The best of several searches. Where no chain is named the thumb, each is tried as one."""
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
    """The velocity (n,) of the joints when the hand closes: 1 or -1, or 0 of those that spread."""
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
    """What is to be made small, for one finger as the thumb and the radius [m] that is asked for."""
    model, m = body.skeleton.model, len(body.chains)
    q, s, radius = ca.SX.sym("q", model.nq), ca.SX.sym("s", 3), ca.SX.sym("radius")
    chain = placements(model, q, "model walk")  # of a hand that is new, there is no compiled one
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
    """A vector over its length, which is kept off zero by a nanometre."""
    return vector / ca.sqrt(ca.sumsqr(vector) + 1e-18)


def _short(distance: ca.SX, least: ca.SX | float) -> ca.SX:
    """By how much a distance [m] is less than it must be."""
    return ca.fmax(least - distance, 0)
