"""Tables of one grasp, as texts: fingers, energy, wrist and joints."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sgnlp.hand.hand import Hand
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.problem import Problem

PRISMATIC = "JointModelP"
"""How Pinocchio's names of joints that slide begin; of these, limits and positions are in metres."""


@dataclass(frozen=True)
class Sheet:
    """A table of texts, its first row the heads."""

    title: str
    rows: tuple[tuple[str, ...], ...]


def fingers(grasps: Grasps, rank: int) -> Sheet:
    """Fingers with their gains, forces, margins and the deviation at their contacts."""
    force = np.linalg.norm(grasps.forces_eq[rank], axis=1)
    columns = (grasps.gains[rank], force, grasps.margins_initial[rank], grasps.margins_equilibrium[rank])
    sigma = 1e3 * grasps.contact_deviation[rank]
    rows = [("finger", "gain [N/m]", "force [N]", "margin t0", "margin eq", "±σ [mm]")]
    for name, k, f, first, last, s in zip(grasps.finger_names, *columns, sigma, strict=True):
        rows.append((str(name), f"{k:.0f}", f"{f:.2f}", f"{first:.3f}", f"{last:.3f}", f"{s:.1f}"))
    return Sheet("Fingers", tuple(rows))


def energy(grasps: Grasps, rank: int, problem: Problem | None) -> Sheet:
    """The exact energy term by term; without its problem, no weights are known."""
    values = grasps.energy_terms[rank]
    rows = [("term", "value", "weight", "share")]
    weights = problem.weights() if problem is not None else np.full(len(values), np.nan)
    for name, value, w in zip(grasps.term_names, values, weights, strict=True):
        rows.append((str(name), f"{value:.4g}", f"{w:g}", f"{w * value:.2f}"))
    rows.append(("total", "", "", f"{grasps.energy[rank]:.2f}"))
    return Sheet("Energy, exact", tuple(rows))


def wrist(grasps: Grasps, rank: int, hand: Hand) -> Sheet:
    """The pose of the hand's root link in the world frame at the pregrasp; R = Rz(yaw) Ry(pitch) Rx(roll)."""
    pose = np.asarray(grasps.wrist[rank], float)
    angles = np.degrees(pin.rpy.matrixToRpy(pin.XYZQUATToSE3(pose).rotation))
    rows = (
        ("", "x", "y", "z", "w"),
        ("position [m]", *(f"{v:.4f}" for v in pose[:3]), ""),
        ("quaternion", *(f"{v:.5f}" for v in pose[3:])),
        ("roll, pitch, yaw [deg]", *(f"{v:.2f}" for v in angles), ""),
    )
    return Sheet(f"Wrist of grasp {rank}: link {hand.root} in the world frame", rows)


def joints(grasps: Grasps, rank: int, hand: Hand) -> Sheet:
    """Where the joints stand at the pregrasp, with their limits; those that turn in radians and degrees."""
    rows = [("joint", "position", "unit", "[deg]", "lower", "upper")]
    limits = dict(zip(hand.joint_names, zip(hand.lower, hand.upper, strict=True), strict=True))
    for name, q in zip(map(str, grasps.joint_names), grasps.joints[rank], strict=True):
        kind = hand.model.joints[hand.model.getJointId(name)].shortname()
        slides = kind.startswith(PRISMATIC)
        lower, upper = limits[name]
        angle = "" if slides else f"{np.degrees(q):.1f}"
        rows.append((name, f"{q:.4f}", "m" if slides else "rad", angle, f"{lower:.4f}", f"{upper:.4f}"))
    return Sheet(f"Joints of grasp {rank}", tuple(rows))
