"""What to be wary of before a plan is trusted: each caution computed from the result, with its threshold and why.

A caution takes the result and returns a sentence, or "" where there is no reason for one.
"""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sgnlp.kkt import SOLVED_FACTOR
from sgnlp.observation import Observation
from sgnlp.refit import Reopened
from sgnlp.starts import starts

Array = NDArray[np.float64]

FEASIBLE_SHARE = 0.5
"""Least share of the starts that end feasible: 98 % do on the problem set, so that fewer than half is unusual."""
UNSEEN = 0.02
"""Contacts farther than this from every measured point are on the unseen side [m]: seen ones are within 14 mm."""
UNSEEN_ERROR_MM = 14
"""By how much the surface is too near where one camera does not see it (`results/calibration`)."""
CALIBRATION = 0.36
"""Factor on σ_d with which its intervals hold (`results/calibration`)."""
TRAVEL_SHARE, AT_BOUND = 0.5, 0.99
"""Of the wrist's allowed travel: from half on the start was no guess at this grasp; from the other on it is stopped."""
CLOSE = 0.01
"""Difference of margins that ranks nothing: a degree of the angle between a force and the edge of its cone."""
SAME = 2e-3
"""Grasps whose contacts agree to this are the same [m]: a contact counts as one within it."""
WALL_NOISES = 2.0
"""Walls thinner than this many deviations of a measured point cannot be told from one surface."""
WALL_SHARE = 0.1
"""Share of the points that must lie on such walls: edges and corners of solid bodies have up to 3 %, a cup 35 %."""
WALL_POINTS, WALL_NEIGHBOURS = 500, 60
"""Points that are looked at, and neighbours that give the normal of one."""
OPPOSITE = -0.8
"""Cosine between the normals of the two sides of a wall, at most."""


def cautions(result: Reopened) -> list[str]:
    """Every sentence there is reason for."""
    return [said for caution in CAUTIONS if (said := caution(result))]


def alike(contacts: Array) -> list[int]:
    """For each of the grasps with contacts (G, m, 3) [m], best first, the rank of the first that is the same."""
    firsts: list[int] = []
    for rank, p in enumerate(contacts):
        near = (r for r in dict.fromkeys(firsts) if np.linalg.norm(contacts[r] - p, axis=1).max() <= SAME)
        firsts.append(next(near, rank))
    return firsts


def missing(result: Reopened) -> str:
    """The cloud is not there any more."""
    return result.missing and f"Without cloud and surface, and cautions that need them: {result.missing}."


def no_feasible(result: Reopened) -> str:
    """No start ended feasible, or few did."""
    count, all_ = int(result.grasps.feasible.sum()), int(result.grasps.meta["starts"])
    if count == 0:
        return "No start ended feasible. What is shown is the least bad of them, and not to be carried out."
    few = f"Only {count} of {all_} starts ended feasible: the hand hardly gets at this object as it lies."
    return few if count < FEASIBLE_SHARE * all_ else ""


def stopped(result: Reopened) -> str:
    """Starts that gave nothing."""
    lost = int(result.grasps.meta["starts"]) - len(result.grasps)
    return f"{lost} of the starts gave nothing: see why in their table." if lost else ""


def unsolved(result: Reopened) -> str:
    """The first choice is not an optimum."""
    worst = float(result.grasps.kkt[0].max())
    limit = SOLVED_FACTOR * float(result.grasps.meta["settings"]["solver"]["tolerance"])
    said = f"The first choice is not an optimum: its KKT residual is {worst:.0e} and should be {limit:.0e} at most."
    return "" if worst <= limit else said


def few_points(result: Reopened) -> str:
    """Fewer points than the surface is fitted to."""
    wanted = int(result.grasps.meta["settings"]["gpis"]["surface_points"])
    if result.cloud is None or len(result.cloud.points) >= wanted:
        return ""
    return f"The cloud has {len(result.cloud.points)} points, fewer than the {wanted} that a surface is fitted to."


def one_view(result: Reopened) -> str:
    """Everything was seen from one side."""
    if result.cloud is None or len(result.cloud.view_names) > 1:
        return ""
    far = f"its far side is guessed, on average {UNSEEN_ERROR_MM} mm too near in the calibration study"
    return f"All points are of one view: if that was one camera, the object may be shallower than planned; {far}."


def table_assumed(result: Reopened) -> str:
    """The table's height was not given."""
    if result.cloud is None or not any(note.startswith("Assumed the table") for note in result.cloud.notes):
        return ""
    height = f"{result.cloud.table_height:.4f} m"
    return (
        f"The table's height, {height}, is that of the lowest points; a cloud cropped above the table has it too high."
    )


def thin_walls(result: Reopened) -> str:
    """Two sides of a wall are nearer than their noise lets them be told apart."""
    noise = float(result.grasps.meta["settings"]["gpis"]["surface_noise"])
    share = 0.0 if result.cloud is None else wall_share(result.cloud, WALL_NOISES * noise)
    if share < WALL_SHARE:
        return ""
    thick = f"{1e3 * WALL_NOISES * noise:.0f} mm, twice the deviation of a measured point"
    return f"{share:.0%} of the cloud lie on walls thinner than {thick}: the surface fills them, and what they hold."


def unseen_contacts(result: Reopened) -> str:
    """Contacts far from every measured point."""
    if result.cloud is None:
        return ""
    distance = np.asarray(cKDTree(result.cloud.points).query(result.grasps.contact_points[0])[0])
    found = _fingers(result, distance > UNSEEN, 1e3 * distance, "mm")
    far = f"Contacts more than {1e3 * UNSEEN:.0f} mm from any measured point, where the surface is guessed"
    return f"{far}: {found}." if found else ""


def uncertain_contacts(result: Reopened) -> str:
    """Contacts that may come a fingertip's radius early or late."""
    radius = np.array([finger.radius for finger in result.hand.fingers])
    deviation = CALIBRATION * result.grasps.contact_deviation[0]
    found = _fingers(result, deviation > radius, 1e3 * deviation, "mm")
    reason = f"contact may come a fingertip's radius ({1e3 * radius.max():.0f} mm) early or late"
    return f"Uncertain contacts, by the calibrated deviation {CALIBRATION:g} σ: {found}; {reason}." if found else ""


def far_start(result: Reopened) -> str:
    """The wrist went far from its start, or as far as it may."""
    if result.problem is None:
        return ""
    meta, g = result.grasps.meta, result.grasps
    begin = starts(result.problem, int(meta["starts"]), int(meta["seed"]))[int(g.start[0])].wrist
    moved = pin.log6(pin.XYZQUATToSE3(begin).actInv(pin.XYZQUATToSE3(g.wrist[0]))).linear
    travel, bound = float(np.abs(moved).max()), float(meta["settings"]["limits"]["wrist_travel"])
    if travel >= AT_BOUND * bound:
        return f"The wrist is stopped by the bound of its travel, {bound:g} m: --limits.wrist-travel widens it."
    far = f"The wrist went {1e2 * travel:.0f} cm from its start, more than half of what it may"
    return (
        f"{far}: the start was far away, and others (--starts) may find better."
        if travel > TRAVEL_SHARE * bound
        else ""
    )


def close_runner_up(result: Reopened) -> str:
    """Another feasible grasp is ranked as good as the first."""
    g, key = result.grasps, str(result.grasps.meta["settings"]["rank_by"])
    first = np.minimum(g.margins_initial.min(axis=1), g.margins_equilibrium.min(axis=1))
    values = {"margin": first, "margin_initial": g.margins_initial.min(axis=1), "energy": g.energy}
    value = values.get(key, g.stiffness)
    within = CLOSE if key.startswith("margin") else CLOSE * abs(float(value[0]))
    others = [rank for rank, same in enumerate(alike(g.contacts)) if same == rank and rank and g.feasible[rank]]
    near = [rank for rank in others if abs(value[rank] - value[0]) <= within]
    if not near or not g.feasible[0]:
        return ""
    apart = 1e3 * np.linalg.norm(g.contacts[near[0]] - g.contacts[0], axis=1).max()
    unlike = f"though a contact of it lies {apart:.0f} mm elsewhere (energy {g.energy[near[0]] - g.energy[0]:+.1f})"
    return f"The choice is close: by {key.replace('_', ' ')}, start {g.start[near[0]]} is as good, {unlike}."


CAUTIONS: tuple[Callable[[Reopened], str], ...] = (
    missing,
    no_feasible,
    stopped,
    unsolved,
    few_points,
    one_view,
    table_assumed,
    thin_walls,
    unseen_contacts,
    uncertain_contacts,
    far_start,
    close_runner_up,
)


def wall_share(cloud: Observation, thickness: float) -> float:
    """Share of a cloud's points that have another one on the far side of a wall thinner than `thickness` [m].

    Normals are those of the planes through the neighbours, turned to the camera that saw the point; 0 without cameras.
    """
    if cloud.camera_positions is None:
        return 0.0
    chosen = np.linspace(0, len(cloud.points) - 1, min(WALL_POINTS, len(cloud.points))).astype(int)
    P = cloud.points[chosen]  # (n, 3)
    _, near = cKDTree(cloud.points).query(P, k=min(WALL_NEIGHBOURS, len(cloud.points)))
    Q = cloud.points[near] - cloud.points[near].mean(axis=1, keepdims=True)  # (n, k, 3)
    normal = np.linalg.eigh(np.einsum("nki,nkj->nij", Q, Q))[1][:, :, 0]
    towards = cloud.camera_positions[cloud.view[chosen]] - P
    normal *= np.sign((towards * normal).sum(axis=1, keepdims=True))
    offset = P[None] - P[:, None]  # (n, n, 3), from each to every other
    distance = np.linalg.norm(offset, axis=2)
    behind = -(offset * normal[:, None]).sum(axis=2) > distance / 2
    wall = (normal @ normal.T < OPPOSITE) & (distance < thickness) & behind & behind.T
    return float(wall.any(axis=1).mean())


def _fingers(result: Reopened, chosen: NDArray[np.bool_], values: Array, unit: str) -> str:
    """The chosen fingers with their values, "" for none."""
    named = zip(result.grasps.finger_names, chosen, values, strict=True)
    return ", ".join(f"{name} {value:.0f} {unit}" for name, is_chosen, value in named if is_chosen)
