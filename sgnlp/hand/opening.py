"""The size of object that a hand can hold between its pads, and the force of its motors there."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import forward, tip_jacobian, tips

ORIGIN = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
GIVE = 0.01
"""A pad touches the ball if it is within this of it [m]: fingers of one motor do not all close on one circle."""
OPPOSED = 0.866
"""Cosine of the largest angle, 30°, between the last finger and the line through the others' middle."""
TRIES = 6
LEAST = 1e-9
"""With a shorter lever arm [m] a joint's bearing holds any force."""
BEGIN = 0.06  # diameter of the ball that the search begins with [m]


@dataclass(frozen=True, eq=False)
class Opening:
    """The largest ball that all pads touch: its diameter [m], its centre (3,) [m] from the root link, joints (n,)."""

    diameter: float
    centre: Array
    joints: Array


def opening(hand: Hand, seed: int = 0) -> Opening | None:
    """The largest ball that the pads can touch, the last finger opposite the others, clear of all other spheres.

    max D over the joints q and the centre c, with 0 ≤ |a_i(q) - c| - r_i - D/2 ≤ `GIVE` for the pads,
    |s_j(q) - c| - ρ_j - D/2 ≥ 0 for the other spheres, and (a_m - c)·b ≤ -`OPPOSED` |a_m - c| |b| with
    b = Σ_{i<m} (a_i - c). It is the best of `TRIES` local solutions by Ipopt, from the reference and from seeded random
    joints; None if there is none.
    """
    n = len(hand.joint_names)
    q, c, D = ca.SX.sym("q", n), ca.SX.sym("c", 3), ca.SX.sym("D")
    f = forward(hand, ca.SX(ORIGIN), ca.SX.zeros(n), ca.vertcat(ca.SX.zeros(6), q))
    others = [i for i in range(len(hand.spheres)) if i not in hand.tip_spheres]
    pads = _gaps(f.tips, c, D, hand.tip_radii)
    links = _gaps(f.spheres[others, :], c, D, np.array([hand.spheres[i].radius for i in others]))
    thumb, rest = f.tips[-1, :].T - c, ca.sum1(f.tips[:-1, :]).T - (f.tips.shape[0] - 1) * c
    aside = ca.dot(thumb, rest) + OPPOSED * ca.norm_2(thumb) * ca.norm_2(rest)
    rows, x = ca.vertcat(pads, links, aside), ca.vertcat(q, c, D)
    upper = [*[GIVE] * len(hand.fingers), *[np.inf] * len(others), 0.0]
    lower = [*[0.0] * (len(hand.fingers) + len(others)), -np.inf]
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": 300}
    solver = ca.nlpsol("opening", "ipopt", {"x": x, "f": -D, "g": rows}, quiet)
    rng, found = np.random.default_rng(seed), []
    for joints in [hand.reference, *rng.uniform(hand.lower, hand.upper, (TRIES - 1, n))]:
        begin = [*joints, *tips(hand, ORIGIN, joints).mean(axis=0), BEGIN]
        ended = solver(
            x0=begin,
            lbx=[*hand.lower, *[-np.inf] * 3, 0.0],
            ubx=[*hand.upper, *[np.inf] * 4],
            lbg=lower,
            ubg=upper,
        )
        if solver.stats()["success"]:
            z = np.array(ended["x"]).ravel()
            found.append(Opening(float(z[-1]), z[n : n + 3], z[:n]))
    return max(found, key=lambda one: one.diameter, default=None)


def _gaps(points: ca.SX, c: ca.SX, D: ca.SX, radii: Array) -> ca.SX:
    """|x_i - c| - r_i - D/2 of points (k, 3)."""
    return ca.vertcat(*(ca.norm_2(points[i, :].T - c) - radii[i] - D / 2 for i in range(points.shape[0])))


def press(hand: Hand, at: Opening) -> float:
    """The force [N] with which the last finger and the others press the ball between them, within all efforts.

    A finger can press with f towards the centre if |J_iᵀ u_i| f is within the effort of every joint. The forces on one
    side add up, and the weaker side decides.
    """
    J = tip_jacobian(hand, ORIGIN, at.joints).reshape(len(hand.fingers), 3, -1)
    towards = at.centre - tips(hand, ORIGIN, at.joints)
    u = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    torques = np.abs(np.einsum("ikn,ik->in", J, u))
    limits = np.divide(hand.effort, torques, where=torques > LEAST, out=np.full_like(torques, np.inf))
    forces = limits.min(axis=1)
    return float(min(forces[-1], forces[:-1].sum()))
