"""Planned grasps as arrays, best first: the content of a result file, and all that a robot needs."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from numbers import Integral
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array, BoolArray, IntArray, StrArray
from sgnlp.base.brief import brief
from sgnlp.base.checked import Typed
from sgnlp.base.errors import InputError
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import TIPS_OFF, tips_off
from sgnlp.hand.model import NORM_OFF
from sgnlp.planning.solution import Solution
from sgnlp.program.carried import POSTURES
from sgnlp.program.terms import Term
from sgnlp.program.variables import Posture


@dataclass(frozen=True, eq=False)
class Grasps(Typed):
    """G grasps of a hand with m fingers, n joints and S spheres, in the world frame, sorted best first.

    Feasible ones come first. `meta` has how they were made: versions, settings, seed, hand, input, timings.
    """

    called = "grasps"
    __repr__ = brief

    wrist: Array  # (G, 7) pose of the hand's root link, x y z [m] qx qy qz qw
    joints: Array  # (G, n) [rad], in the order of joint_names
    joints_contact: Array  # (G, n) [rad], at first contact
    joints_squeeze: Array  # (G, n) [rad], setpoints that press as planned where joints are under position control
    arm: Array  # (G, 3, a) [rad], an arm at the pregrasp, at the stand-off and lifted; a = 0 without one
    arm_joint_names: StrArray  # (a,)
    joint_names: StrArray  # (n,)
    finger_names: StrArray  # (m,)
    tips_pregrasp: Array  # (G, m, 3) [m], tip centres a_i at the pregrasp
    contacts: Array  # (G, m, 3) [m], tip centres p_i at first contact
    contact_points: Array  # (G, m, 3) [m], p_i - r n_i on the surface
    targets: Array  # (G, m, 3) [m], o_i
    gains: Array  # (G, m) [N/m], k_i
    c: Array  # (G, m), contact at o_i + c (a_i - o_i)
    normals: Array  # (G, m, 3), outward, at first contact
    rotation_eq: Array  # (G, 3, 3), motion of the object to the equilibrium
    translation_eq: Array  # (G, 3) [m]
    contacts_eq: Array  # (G, m, 3) [m], tip centres at equilibrium
    forces_initial: Array  # (G, m, 3) [N]
    forces_eq: Array  # (G, m, 3) [N]
    torques_initial: Array  # (G, n) [N m], of the joints at first contact
    torques_eq: Array  # (G, n) [N m]
    stiffness: Array  # (G,) [N m], ρ of the equilibrium
    margins_initial: Array  # (G, m)
    margins_equilibrium: Array  # (G, m)
    contact_distance: Array  # (G, m) [m], of the pads to the surface
    contact_deviation: Array  # (G, m) [m], of the surface at the contacts
    object_clearance: Array  # (G, S - m) [m], of every sphere but the pads
    pad_clearance: Array  # (G, m) [m], of the pads from the object at the pregrasp
    table_clearance: Array  # (G, S - m) [m], of every sphere but the pads
    pad_height: Array  # (G, m) [m], of the pads over the table at the pregrasp
    object_clearance_contact: Array  # (G, S - m) [m], as object_clearance, at first contact
    energy: Array  # (G,), exact and weighted
    energy_terms: Array  # (G, T), exact and unweighted
    term_names: StrArray  # (T,)
    feasible: BoolArray  # (G,)
    confidence: Array  # (G,), probability that the grasp holds at the load of the plan; NaN: unknown
    violated: StrArray  # (G,), names of the failed checks, separated by "; "
    kkt: Array  # (G, 3) dual, primal and complementarity residuals of the scaled problem
    status: StrArray  # (G,), status in the solver's own words
    iterations: IntArray  # (G,)
    solve_seconds: Array  # (G,)
    start: IntArray  # (G,), index of the initial guess
    meta: dict[str, Any]

    def __len__(self) -> int:
        return len(self.energy)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the plan: of its arrays, and of what it was planned for, but for computing times."""
        asked = {name: self.meta.get(name) for name in OF_PLAN}
        found = hashlib.sha256(json.dumps(asked, sort_keys=True).encode())
        for name in names_but("meta", "solve_seconds"):
            array = getattr(self, name)
            found.update(f"{name} {array.dtype.str} {array.shape}".encode() + array.tobytes())
        return found.hexdigest()

    def posture(self, rank: int = 0) -> Posture:
        """The grasp of this rank as the program's variables. Raises `InputError` if there is none."""
        if not isinstance(rank, Integral) or rank not in range(len(self)):
            raise InputError(f"the rank of a grasp must be 0 to {len(self) - 1}, not {rank!r:.60}")
        names = ("wrist", "joints", "targets", "gains", "c", "joints_contact")
        own = {name: getattr(self, name)[rank] for name in names}
        return Posture(**own, arm=self.arm[rank] if len(self.arm_joint_names) else None)


OF_PLAN = ("object", "input_digest", "hand", "settings", "seed", "starts", "tried")
"""What of `meta` tells plans apart."""
OF_SOLUTIONS = (
    "wrist",
    "joints",
    "joints_contact",
    "joints_squeeze",
    "contact_points",
    "c",
    "translation_eq",
    "margins_initial",
    "margins_equilibrium",
    "energy",
    "energy_terms",
    "feasible",
    "confidence",
    "status",
    "iterations",
    "start",
)
"""Fields that a solution has under the same name."""
PER_HAND = ("joint_names", "arm_joint_names", "finger_names", "term_names")
"""Fields that are not per grasp."""
CLEARANCES = ("object_clearance", "table_clearance", "object_clearance_contact")
"""Fields per sphere of the hand but the pads."""
POSED = ("wrist", "joints", "tips_pregrasp")
"""Fields that the kinematics of the hand tie together."""
FINITE = ("wrist", "joints", "tips_pregrasp", "contacts", "targets", "gains")
"""Fields that are never NaN for a feasible grasp."""


def same(a: Grasps, b: Grasps) -> bool:
    """Whether two results agree bit for bit, apart from their computing times."""
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in names_but("meta", "solve_seconds"))


def names_but(*names: str) -> list[str]:
    """The names of the fields of `Grasps`, but for these."""
    return [field.name for field in fields(Grasps) if field.name not in names]


def stack(hand: Hand, terms: Sequence[Term], solutions: Sequence[Solution], meta: dict[str, Any]) -> Grasps:
    """The arrays of a plan's solutions, in their order, with these terms; G = 0 without solutions."""
    rows = [_row(solution) for solution in solutions]
    arrays = {name: np.array([row[name] for row in rows]) for name in rows[0]} if rows else _no_rows(hand, len(terms))
    return Grasps(
        **arrays,
        joint_names=np.array(hand.joint_names),
        arm_joint_names=np.array(hand.arm.joint_names if hand.arm else (), str),
        finger_names=np.array([finger.name for finger in hand.fingers]),
        term_names=np.array([term.name for term in terms]),
        meta=meta,
    )


def unfit(grasps: Grasps, hand: Hand) -> str:
    """The first fault of the arrays as grasps of this hand, in words; "" if they fit it.

    Clearances are left out: they depend on the spheres of the hand, which may have been chosen anew since.
    """
    own = stack(hand, [], [], {})
    for name in ("joint_names", "finger_names", "arm_joint_names"):
        if not np.array_equal(getattr(grasps, name), getattr(own, name)):
            return f"{name} must be those of the hand '{hand.name}', in its order"
    for name, row in _no_rows(hand, grasps.term_names.size).items():
        array, shape = getattr(grasps, name), (grasps.energy.size, *row.shape[1:])
        if name not in CLEARANCES and array.shape != shape:
            return f"{name} must have the shape {shape} for the hand '{hand.name}', not {array.shape}"
        if not np.can_cast(array.dtype, row.dtype, "same_kind"):
            return f"{name} must be of type {row.dtype.name}, not {array.dtype.name}"
    for name in FINITE:
        if not np.isfinite(getattr(grasps, name)[grasps.feasible]).all():
            return f"{name} must be finite"
    if (np.abs(np.linalg.norm(grasps.wrist[:, 3:], axis=1) - 1) > NORM_OFF).any():
        return "the quaternions of wrist must have length 1"
    for wrist, joints, planned in zip(*(getattr(grasps, n)[grasps.feasible] for n in POSED), strict=True):
        if (off := tips_off(hand, wrist, joints, planned)) > TIPS_OFF:
            return f"tips are {1e3 * off:.0f} mm off those of the hand '{hand.name}': it was planned for another one"
    return ""


def _no_rows(hand: Hand, T: int) -> dict[str, Any]:
    n, m, S = len(hand.joint_names), len(hand.fingers), len(hand.spheres)
    points = ("tips_pregrasp", "contacts", "contact_points", "targets", "normals", "contacts_eq")
    numbers = (
        "gains",
        "c",
        "margins_initial",
        "margins_equilibrium",
        "contact_distance",
        "contact_deviation",
        "pad_clearance",
        "pad_height",
    )
    shapes = dict.fromkeys((*points, "forces_initial", "forces_eq"), (m, 3)) | dict.fromkeys(numbers, (m,))
    joints = ("joints", "joints_contact", "joints_squeeze", "torques_initial", "torques_eq")
    shapes |= dict.fromkeys(joints, (n,)) | dict.fromkeys(CLEARANCES, (S - m,))
    shapes |= {"wrist": (7,), "rotation_eq": (3, 3), "translation_eq": (3,), "kkt": (3,), "energy_terms": (T,)}
    shapes["arm"] = POSTURES, len(hand.arm.joint_names) if hand.arm else 0
    kinds = {"feasible": bool, "violated": str, "status": str, "iterations": np.int64, "start": np.int64}
    return {name: np.zeros((0, *shapes.get(name, ())), kinds.get(name, float)) for name in names_but(*PER_HAND, "meta")}


def _row(s: Solution) -> dict[str, Any]:
    g = s.grasp
    return {name: getattr(s, name) for name in OF_SOLUTIONS} | {
        "arm": np.zeros((POSTURES, 0)) if s.arm is None else s.arm,
        "tips_pregrasp": g.tips,
        "contacts": g.contacts,
        "targets": g.targets,
        "gains": g.gains,
        "normals": g.normals,
        "rotation_eq": g.rotation,
        "contacts_eq": g.contacts_eq,
        "forces_initial": g.forces,
        "forces_eq": g.forces_eq,
        "torques_initial": g.torques,
        "torques_eq": g.torques_eq,
        "stiffness": g.stiffness,
        "contact_distance": g.gaps,
        "contact_deviation": g.contact_deviations,
        "object_clearance": g.object_clearances,
        "pad_clearance": g.pad_clearances,
        "table_clearance": g.table_clearances,
        "pad_height": g.pad_heights,
        "object_clearance_contact": s.clearances_contact,
        "violated": "; ".join(s.violated),
        "kkt": [s.kkt.dual, s.kkt.primal, s.kkt.complementarity],
        "solve_seconds": s.seconds,
    }
