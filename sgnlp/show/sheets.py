"""Tables of texts, for any page or terminal: fingers, energy, wrist and joints of a grasp, and simulations."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sgnlp.hand.hand import Hand
from sgnlp.hand.plausible import SLIDING, kind
from sgnlp.planning.cautions.plans import alike
from sgnlp.planning.grasps import Grasps

NOTHING = 1e-3
"""Smaller values are shown as 0, in the units of the tables, such as mm and N."""
BAR = re.compile(r"(?<!\\)\|")
"""A bar without an escape before it."""


@dataclass(frozen=True)
class Sheet:
    """A table of texts, its first row the heads."""

    title: str
    rows: tuple[tuple[str, ...], ...]


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, its first row the heads; bars inside cells are escaped."""
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "\n".join("| " + " | ".join(BAR.sub(r"\\|", cell) for cell in line) + " |" for line in lines)


def starts(summary: Mapping[str, Any], grasps: Grasps, apart: str = "; ") -> Sheet:
    """A row for each start of a plan, best first, from its summary; failures last. `apart` stands between checks."""
    heads = ("start", "feasible", "margin", "ρ [N m]", "energy", "KKT", "iterations", "time [s]", "same as", "fails")
    firsts, rows = alike(grasps.contacts), [heads]
    for s in summary["starts_table"]:
        if "failure" in s:
            rows.append((str(s["start"]), "no", *[""] * 7, s["failure"]))
            continue
        worst = max(_number(s["kkt"][name]) for name in ("dual", "primal", "complementarity"))
        margin, stiffness, energy, seconds = (_number(s[n]) for n in ("worst_margin", "stiffness", "energy", "seconds"))
        numbers = (f"{margin:.3f}", f"{stiffness:.3f}", f"{energy:.1f}", f"{worst:.0e}", str(s["iterations"]))
        first = firsts[s["rank"]]
        same = "" if first == s["rank"] else f"start {grasps.start[first]}"
        fails = apart.join(s["violated"])
        rows.append((str(s["start"]), "yes" if s["feasible"] else "no", *numbers, f"{seconds:.2f}", same, fails))
    return Sheet("Starts, best first", tuple(rows))


def _number(value: float | None) -> float:
    """A number of the summary; null stands for NaN, which JSON cannot hold."""
    return float("nan") if value is None else value


def _rounded(value: float) -> str:
    """A number with two digits behind the point; zero without a sign."""
    return f"{round(value, 2) + 0.0:.2f}"


def checks(found: Mapping[str, Mapping[str, Any]]) -> Sheet:
    """The feasibility checks of a grasp by name, each recomputed without smoothing."""
    rows = [("constraint", "worst at", "worst value", "demanded", "passed")]
    for name, check in found.items():
        value = f"{_number(check['value']):.3g}" if abs(_number(check["value"])) >= NOTHING else "0"
        row = check["row"].removeprefix(name).strip("[]")
        rows.append((name, row, value, check["demand"], "yes" if check["passed"] else "no"))
    return Sheet("Margins and checks", tuple(rows))


def fingers(grasps: Grasps, rank: int) -> Sheet:
    """Fingers with their gains, forces, margins, gaps between pad and surface, and targets."""
    names = ("gains", "forces_eq", "margins_initial", "margins_equilibrium", "contact_distance", "contact_deviation")
    columns = zip(grasps.finger_names, *(getattr(grasps, n)[rank] for n in (*names, "targets")), strict=True)
    rows = [("finger", "gain [N/m]", "force [N]", "margin t0, eq", "gap [mm]", "±σ [mm]", "target [mm]")]
    for name, k, f, first, last, gap, s, target in columns:
        numbers = (f"{k:.0f}", f"{np.linalg.norm(f):.2f}", f"{first:.3f} {last:.3f}", _rounded(1e3 * gap))
        rows.append((str(name), *numbers, f"{1e3 * s:.1f}", " ".join(f"{1e3 * c:+.0f}" for c in target)))
    return Sheet("Fingers", tuple(rows))


def energy(grasps: Grasps, rank: int, weights: ArrayLike | None) -> Sheet:
    """The exact energy term by term; `weights` is None where they are not known."""
    values = grasps.energy_terms[rank]
    known = np.full(len(values), np.nan) if weights is None else np.asarray(weights)
    rows = [("term", "value", "weight", "share")]
    for name, value, w in zip(grasps.term_names, values, known, strict=True):
        rows.append((str(name), f"{value:.4g}", f"{w:g}", _rounded(w * value)))
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
    """Joint positions at the pregrasp, with their limits; revolute joints in radians and degrees."""
    rows = [("joint", "position", "unit", "[deg]", "lower", "upper")]
    limits = dict(zip(hand.joint_names, zip(hand.lower, hand.upper, strict=True), strict=True))
    for name, q in zip(map(str, grasps.joint_names), grasps.joints[rank], strict=True):
        slides = kind(hand.model, name) == SLIDING
        lower, upper = limits[name]
        angle = "" if slides else f"{np.degrees(q):.1f}"
        rows.append((name, f"{q:.4f}", "m" if slides else "rad", angle, f"{lower:.4f}", f"{upper:.4f}"))
    return Sheet(f"Joints of grasp {rank}", tuple(rows))


def simulated(grasps: Sequence[Mapping[str, Any]]) -> Sheet:
    """One row for each simulated grasp of `simulation.json`.

    "moved" is the object's motion before the last pad touched. "off plan" is the distance of its equilibrium from the
    planned one. "touched" lists what hand, arm or object touched by mistake; the column is left out if there is none.
    """
    heads: tuple[str, ...] = ("grasp", "ending", "score", "strict", "rise", "slip", "pushes", "moved", "off plan")
    touched = [", ".join(sorted({k["hit"] for k in grasp.get("knocks", ())})) for grasp in grasps]
    rows: list[tuple[str, ...]] = [_simulated(rank, grasp) for rank, grasp in enumerate(grasps)]
    if any(touched):
        heads, rows = (*heads, "touched"), [(*row, names) for row, names in zip(rows, touched, strict=True)]
    return Sheet("Simulated; lengths in mm", (heads, *rows))


def _simulated(rank: int, grasp: Mapping[str, Any]) -> tuple[str, ...]:
    closing, lift, pushes = grasp["closing"], grasp["lift"], grasp["pushes"]
    held = f"{sum(push['held'] for push in pushes)}/{len(pushes)}" if pushes else ""
    ended = (str(rank), grasp["ending"], f"{grasp['score']:g}", f"{grasp['score_strict']:g}")
    rose = (lift and lift["rise"], lift and max(lift["slip"]))
    moved = (closing and closing["shift_before_contact"], closing and closing["shift_error"])
    return (*ended, *map(_mm, rose), held, *map(_mm, moved))


def _mm(length: float | None) -> str:
    return "" if length is None else f"{1e3 * length:.1f}"
