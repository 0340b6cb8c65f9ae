"""How nearly the fingers can hold an object: the forces within cones that balance its weight best.

Each finger presses with f_i = Σ_j λ_ij g_ij, λ ≥ 0. The g_ij are unit vectors on the edges of its friction cone and in
the cone's middle, each turned into the directions in which the finger's joints can move its tip: the tip goes from the
pregrasp to the contact, and its spring pulls on along that line. With f_min ≤ Σ_j λ_ij ≤ f_max, λ minimises

    |Σ f_i - m g e_z|² + |Σ (p_i - c) × f_i|² / l²
"""

from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array

EDGES = 6
INNER, OUTER = 0.75, 0.9
"""Width of the cone of the edges, and of that which turned vectors must be in, in widths of the friction cone: the
program asks for a margin."""
LEVER = 0.05
"""Length l [m]: a torque counts as the force that has it at this distance, half of an object's size."""
ALONG = 0.3
"""Least cosine between a vector and its turned one."""
STEPS = 200
"""Steps of projected gradients; twice as many change the sum by a hundredth."""


@dataclass(frozen=True, eq=False)
class Balance:
    """The balance of C sets of m contacts: what is left [N] (C,), the forces (C, m, 3) [N], and by how much the cosine
    of each finger's best direction with the normal is too small (C, m)."""

    left: Array
    forces: Array
    off: Array


def balance(contacts: Array, normals: Array, spans: Array, friction: float, bounds: Array, weight: Array) -> Balance:
    """The best balance for contacts from the centre of mass (C, m, 3) [m], with outward normals (C, m, 3).

    `spans` (C, m, 3, 3) are projections as in `Closing`, `bounds` (2,) those of a finger's force [N], and `weight` (3,)
    the force that carries the object [N].
    """
    turned, allowed, off = _directions(normals, spans, friction)
    wrenches = np.concatenate([turned, np.cross(contacts[:, :, None], turned) / LEVER], axis=-1) * allowed[..., None]
    wanted = np.concatenate([weight, np.zeros(3)])
    C, m, G, _ = wrenches.shape
    A = wrenches.reshape(C, m * G, 6)
    length = 2 / (A * A).sum(axis=(1, 2))  # of a step: the square is below the sum of squares
    shares = allowed / allowed.sum(axis=2, keepdims=True) * bounds.mean()
    for _ in range(STEPS):
        left = np.einsum("cgi,cg->ci", A, shares.reshape(C, -1)) - wanted
        down = np.einsum("cgi,ci,c->cg", A, left, length).reshape(C, m, G)
        shares = np.maximum(shares - down, 1e-9) * allowed
        total = shares.sum(axis=2, keepdims=True)
        shares *= np.clip(total, *bounds) / total
    left = np.einsum("cgi,cg->ci", A, shares.reshape(C, -1)) - wanted
    return Balance(np.linalg.norm(left, axis=1), np.einsum("cmg,cmgi->cmi", shares, turned), off)


def _directions(normals: Array, spans: Array, friction: float) -> tuple[Array, Array, Array]:
    """The g (C, m, G, 3), which of them are in the cone (C, m, G), and `Balance.off`.

    Of a finger that has none in its cone the one nearest to it counts.
    """
    flat = np.where(np.abs(normals[..., 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    across = np.cross(normals, flat)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    beside = np.cross(normals, across)
    angles = 2 * np.pi / EDGES * np.arange(EDGES)
    around = np.cos(angles)[:, None] * across[..., None, :] + np.sin(angles)[:, None] * beside[..., None, :]
    edges = INNER * friction * around - normals[..., None, :]
    edges = np.concatenate([-normals[..., None, :], edges / np.linalg.norm(edges, axis=-1, keepdims=True)], axis=-2)
    turned = np.einsum("cmij,cmgj->cmgi", spans, edges)
    sizes = np.linalg.norm(turned, axis=-1)
    turned = turned / np.maximum(sizes, ALONG)[..., None]
    cosines = np.where(sizes > ALONG, -np.einsum("cmgi,cmi->cmg", turned, normals), -1.0)
    least = 1 / np.hypot(1.0, OUTER * friction)
    best = cosines.argmax(axis=2)[..., None] == np.arange(EDGES + 1)
    allowed = np.where((cosines >= least).any(axis=2, keepdims=True), cosines >= least, best)
    return turned, allowed, np.maximum(least - cosines.max(axis=2), 0.0)
