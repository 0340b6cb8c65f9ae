"""Assembles a grasp from its parts, by the same lines for CasADi and NumPy.

CasADi and NumPy compute the parts independently: kinematics, surface and equilibrium. What follows from them by simple
algebra is written here once.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Protocol

import casadi as ca
import numpy as np

from sgnlp.hand.hand import Hand
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp


@dataclass(frozen=True)
class Parts:
    """What a grasp of m fingers and S spheres is assembled from; shapes as in `Grasp`."""

    wrist_position: Any  # (3,) [m]
    wrist_rotation: Any  # (3, 3)
    links: Mapping[str, Any]  # → (3,) [m]
    joints: Any  # (n,) [rad]
    joints_contact: Any  # (n,) [rad]
    arm: Any  # `Carried`, or None
    tips: Any  # (m, 3) [m]
    tip_errors: Any  # (m, 3) [m]
    reach_errors: Any  # (m, 3) [m]
    spheres: Any  # (S, 3) [m]
    spheres_contact: Any  # (S, 3) [m]
    torques: Callable[[Any], Any]  # forces (m, 3) [N] at the tips → joint torques (n,) [N m]
    targets: Any  # (m, 3) [m]
    gains: Any  # (m,) [N/m]
    contacts: Any  # (m, 3) [m]
    contacts_eq: Any  # (m, 3) [m]
    rotation: Any  # (3, 3), of the object to the equilibrium
    translation: Any  # (3,) [m]
    stiffness: Any  # () [N m]
    normals: Any  # (m, 3), at the contacts
    gaps: Any  # (m,) [m], metric distance of the pads
    contact_deviations: Any  # (m,) [m]
    path_distances: Any  # (m K,) [m], metric distance of the centres along the fingers' paths
    path_deviations: Any  # (m K,) [m]
    target_means: Any  # (m,) [m]
    sphere_distances: Any  # (S,) [m], metric distance of the spheres' centres
    link_distances_contact: Any  # (S - m,) [m], the same of every sphere but the pads, at first contact
    # ((3 + A) S,) [m], distances of the centres at the points of `around`; empty without obstacles
    obstacle_distances: Any
    avoid_distances: Any  # (m,) [m]
    touch_distances: Any  # (m,) [m]


TAKEN = (
    *("wrist_position", "wrist_rotation", "links", "joints", "joints_contact", "arm"),
    *("tips", "tip_errors", "reach_errors", "targets", "gains", "contacts", "contacts_eq", "rotation", "stiffness"),
    *("normals", "gaps", "contact_deviations", "path_deviations", "target_means", "avoid_distances", "touch_distances"),
)
"""The parts that a `Grasp` has as they are."""


class Arrays(Protocol):
    """The few operations in which arrays of CasADi and of NumPy differ."""

    def named(self, name: str, value: Any) -> Any: ...  # noqa: D102
    def rows(self, v: Any, m: int) -> Any: ...  # noqa: D102
    def scaled(self, k: Any, A: Any) -> Any: ...  # noqa: D102
    def each(self, v: Any, K: int) -> Any: ...  # noqa: D102
    def lengths(self, A: Any) -> Any: ...  # noqa: D102
    def wrench(self, forces: Any, arms: Any, load: Any) -> Any: ...  # noqa: D102


@dataclass(frozen=True)
class Symbolic:
    """The operations in CasADi; `lift` is that of `sgnlp.program.lifting`."""

    lift: Callable[[str, ca.SX], ca.SX]

    def named(self, name: str, value: ca.SX) -> ca.SX:
        """A quantity that much else depends on."""
        return self.lift(name, value)

    def rows(self, v: ca.SX, m: int) -> ca.SX:
        """v (3,) in each of m rows."""
        return ca.repmat(v.T, m, 1)

    def scaled(self, k: ca.SX, A: ca.SX) -> ca.SX:
        """Each row of A (m, 3) times its k (m,)."""
        return ca.repmat(k, 1, 3) * A

    def each(self, v: ca.SX, K: int) -> ca.SX:
        """Each of v (m,) K times, one after the other (m K,)."""
        return ca.vec(ca.repmat(ca.SX(v).T, K, 1))

    def lengths(self, A: ca.SX) -> ca.SX:
        """|a| row by row (m,)."""
        return ca.vertcat(*[ca.norm_2(A[i, :]) for i in range(A.shape[0])])

    def wrench(self, forces: ca.SX, arms: ca.SX, load: ca.SX) -> ca.SX:
        """Net force and torque (2, 3) of forces (m, 3) at arms (m, 3) against a weight [N]."""
        return ca.vertcat(ca.sum1(forces) - ca.horzcat(0, 0, load), ca.sum1(ca.cross(arms, forces, 2)))


class Numeric:
    """Those of NumPy."""

    def named(self, name: str, value: Any) -> Any:
        """A quantity that much else depends on."""
        return value

    def rows(self, v: Any, m: int) -> Any:
        """v (3,) in each of m rows."""
        return np.tile(v, (m, 1))

    def scaled(self, k: Any, A: Any) -> Any:
        """Each row of A (m, 3) times its k (m,)."""
        return k[:, None] * A

    def each(self, v: Any, K: int) -> Any:
        """Each of v (m,) K times, one after the other (m K,)."""
        return np.repeat(v, K)

    def lengths(self, A: Any) -> Any:
        """|a| row by row (m,)."""
        return np.linalg.norm(A, axis=1)

    def wrench(self, forces: Any, arms: Any, load: Any) -> Any:
        """Net force and torque (2, 3) of forces (m, 3) at arms (m, 3) against a weight [N]."""
        return np.stack([forces.sum(axis=0) - [0.0, 0.0, load], np.cross(arms, forces).sum(axis=0)])


def assemble(parts: Parts, hand: Hand, given: SimpleNamespace, samples: int, density: str, xp: Arrays) -> Grasp:
    """The grasp from its parts. `given` has the entries of `Problem.numbers`, as numbers or symbols."""
    m = len(hand.fingers)
    p, p_eq, R = parts.contacts, parts.contacts_eq, parts.rotation
    centre, weight = xp.rows(given.com, m), given.mass * GRAVITY
    arms, arms_eq = p - centre, p_eq - xp.rows(R @ given.com + parts.translation, m)
    forces = xp.named("forces", xp.scaled(parts.gains, parts.targets - p))
    forces_eq = xp.named("forces_eq", xp.scaled(parts.gains, parts.targets - p_eq))
    return Grasp(
        **{name: getattr(parts, name) for name in TAKEN},
        centre=given.com,
        reference=hand.reference,
        contacts_desired=centre + arms @ given.rotation_desired.T + xp.rows(given.displacement, m),
        rotation_desired=given.rotation_desired,
        forces=forces,
        forces_eq=forces_eq,
        torques=parts.torques(forces),
        torques_eq=parts.torques(forces_eq),
        effort=hand.effort,
        wrench=xp.wrench(forces, arms, weight),
        wrench_eq=xp.wrench(forces_eq, arms_eq, weight),
        normals_eq=xp.named("normals_eq", parts.normals @ R.T),
        friction=given.friction,
        force_min=given.force_min,
        path_samples=samples,
        density_share=density == "share",
        **_clearances(parts, hand, given, samples, xp),
        **_surroundings(parts, hand),
    )


def _clearances(parts: Parts, hand: Hand, given: SimpleNamespace, samples: int, xp: Arrays) -> dict[str, Any]:
    """The fields with distances to the object, to the table, between links, and inside the surface's ball."""
    a, s, w, m = parts.tips, parts.spheres, parts.spheres_contact, len(hand.fingers)
    radii, tip_radii = np.array([sphere.radius for sphere in hand.spheres]), hand.tip_radii
    pads, links = given.pad * tip_radii, [i for i in range(len(radii)) if i not in hand.tip_spheres]
    first, second = _columns(hand.pairs)
    clearances, heights = parts.sphere_distances - radii, s[:, 2] - radii - given.table
    return {
        "spheres": s,
        "radii": radii,
        "path_gaps": parts.path_distances - xp.each(pads, samples),
        "object_clearances": clearances[links],
        "pad_clearances": clearances[list(hand.tip_spheres)],
        "table_clearances": heights[links],
        "pad_heights": a[:, 2] - tip_radii - given.table,
        "pair_clearances": xp.lengths(s[first, :] - s[second, :]) - radii[first] - radii[second],
        "spheres_contact": w,
        "object_clearances_contact": parts.link_distances_contact - radii[links],
        "table_clearances_contact": w[links, 2] - radii[links] - given.table,
        "pair_clearances_contact": xp.lengths(w[first, :] - w[second, :]) - radii[first] - radii[second],
        "ball_clearances": given.ball_radius - xp.lengths(a - xp.rows(given.ball_centre, m)),
        "contact_heights": parts.contacts[:, 2] - pads - given.table,
        "contact_heights_eq": parts.contacts_eq[:, 2] - pads - given.table,
    }


def _surroundings(parts: Parts, hand: Hand) -> dict[str, Any]:
    """The clearances from obstacles, posture by posture."""
    radii, distances = np.array([sphere.radius for sphere in hand.spheres]), parts.obstacle_distances
    S, total = len(radii), distances.shape[0]
    gaps = distances - np.tile(radii, total // S)
    postures = {"": (0, S), "_contact": (S, 2 * S), "_approach": (2 * S, total - S), "_lift": (total - S, total)}
    return {f"obstacle_clearances{name}": gaps[low:high] if total else gaps for name, (low, high) in postures.items()}


def _columns(pairs: Sequence[tuple[int, int]]) -> tuple[list[int], list[int]]:
    return [i for i, _ in pairs], [j for _, j in pairs]
