"""Cautions about a plan's grasps: each function gives a sentence, or "" if there is no reason for one."""

from collections import Counter

import numpy as np
import pinocchio as pin
from scipy.spatial import QhullError, cKDTree

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.settings import Settings
from sgnlp.planning.cautions.measures import outside
from sgnlp.planning.cautions.planned import Planned
from sgnlp.planning.kkt import SOLVED_FACTOR
from sgnlp.planning.recompute import recompute
from sgnlp.planning.solution import torque_share
from sgnlp.planning.starts import starts
from sgnlp.planning.widening import narrow
from sgnlp.program.constraint import is_own
from sgnlp.program.constraints import preset_constraints
from sgnlp.program.terms import preset_terms

FEASIBLE_SHARE = 0.5
"""Least share of the starts that end feasible: 95 % do on the problem set (`results/feasible`), so fewer than half is
unusual."""
NAMED = 3
"""Largest number of constraints that are named if starts fail."""
WORDS = {"way": "links clear on the way to the contacts", "joint_limits": "joints within their limits"}
"""Checks that are not constraints, in words."""
UNSEEN = 0.04
"""Contacts farther than this from every measured point [m] are guesses: those on seen sides are within 14 mm, and three
quarters of the problem set's plans from two cameras have none farther away."""
BESIDE, TARGET_BESIDE = 0.03, 0.0
"""Contacts and targets farther than this outside the hull of the cloud and its copy on the table count as beside the
object [m]: an unseen side bulges by less, and targets lie inside."""
CALIBRATION = {"thin_plate": 0.43}
"""Factor on σ_d by kernel, fitted to the cloud alone, with which its intervals hold on the problem set. With free space
they hold without a factor (`results/calibration`)."""
TRAVEL_SHARE, AT_BOUND = 0.5, 0.99
"""Shares of the wrist's allowed travel: above the first the start was no guess at this grasp; above the second the
bound stops the wrist."""
CLOSE = 0.01
"""Difference of margins too small to rank by: about one degree between a force and the edge of its cone."""
SAME = 2e-3
"""Grasps whose contacts agree to this are the same [m]; it is the tolerance of a contact."""


def alike(contacts: Array) -> list[int]:
    """For each grasp with contacts (G, m, 3) [m], best first, the rank of the first grasp that is the same."""
    firsts: list[int] = []
    for rank, p in enumerate(contacts):
        near = (r for r in dict.fromkeys(firsts) if np.linalg.norm(contacts[r] - p, axis=1).max() <= SAME)
        firsts.append(next(near, rank))
    return firsts


def no_feasible(result: Planned) -> str:
    """No start is feasible, or few are."""
    count, all_ = int(result.grasps.feasible.sum()), _tried(result)
    if count == 0:
        return f"No start ended feasible: do not carry out what is shown, the least bad grasp.{_obstacles(result)}"
    few = f"Only {count} of {all_} starts ended feasible: the hand hardly reaches this object as it lies."
    return f"{few}{_obstacles(result)}" if count < FEASIBLE_SHARE * all_ else ""


def moves(result: Planned) -> str:
    """The object may move more than it usually may on its way to the equilibrium."""
    meta = result.grasps.meta
    if not meta.get("widened"):
        return ""
    settings = Settings.restored(meta["settings"])
    wide, usual = settings.limits, narrow(settings).limits
    return (
        f"No start was feasible with an object that moves by {usual.rotation_deg:g}° and {1e3 * usual.shift:g} mm at "
        f"most while it is grasped. This grasp lets it move by {wide.rotation_deg:g}° and {1e3 * wide.shift:g} mm; "
        "--no-widen leaves such grasps out."
    )


def _tried(result: Planned) -> int:
    """The number of starts that were not left out; those of which there are grasps, where nothing is said of others."""
    meta = result.grasps.meta
    return int(meta.get("tried", len(result.grasps))) - int(meta.get("left", 0))


def _obstacles(result: Planned) -> str:
    """The constraints that most infeasible starts violate, in words."""
    failed = Counter(name for text in result.grasps.violated for name in str(text).split("; ") if name)
    about = WORDS | {c.name: c.about for c in (result.problem.constraints if result.problem else ()) if c.about}
    most = [f"{about.get(name, name)} ({name}, {count})" for name, count in failed.most_common(NAMED)]
    return f" Constraints that fail most, with the number of starts: {'; '.join(most)}." if most else ""


def stopped(result: Planned) -> str:
    """Starts without a solution."""
    lost = _tried(result) - len(result.grasps)
    return f"{lost} of the starts gave no solution: the table of starts says why." if lost else ""


def unsolved(result: Planned) -> str:
    """The first choice is not an optimum."""
    worst = float(result.grasps.kkt[0].max())
    limit = SOLVED_FACTOR * float(result.grasps.meta["settings"]["solver"]["tolerance"])
    said = f"The first choice is not an optimum: its KKT residual is {worst:.0e}, above {limit:.0e}."
    return "" if worst <= limit else said


def unseen_contacts(result: Planned) -> str:
    """Contacts far from every measured point."""
    if result.cloud is None:
        return ""
    distance = np.asarray(cKDTree(result.cloud.points).query(result.grasps.contact_points[0])[0])
    found = _fingers(result, distance > UNSEEN, 1e3 * distance, "mm")
    far = f"Contacts lie more than {1e3 * UNSEEN:.0f} mm from any measured point, where the surface is guessed"
    return f"{far}: {found}." if found else ""


def beside(result: Planned) -> str:
    """Contacts or targets beside the object."""
    if result.cloud is None:
        return ""
    points, g = result.cloud.points, result.grasps
    floor = points * [1, 1, 0] + [0, 0, result.cloud.table_height]
    try:
        away = [1e3 * outside(np.vstack([points, floor]), places[0]) for places in (g.contact_points, g.targets)]
    except QhullError:  # a cloud without volume
        return ""
    limits = (1e3 * BESIDE, 1e3 * TARGET_BESIDE)
    said = [_fingers(result, mm > limit, mm, "mm") for mm, limit in zip(away, limits, strict=True)]
    named = ((f"Contacts lie more than {limits[0]:.0f} mm", said[0]), ("Targets lie", said[1]))
    return " ".join(f"{what} outside the hull of the cloud and its table: {who}." for what, who in named if who)


def torques(result: Planned) -> str:
    """Joint torques that the hand cannot give."""
    if result.problem is None:
        return ""
    g, settings = result.grasps, result.problem.settings
    grasp, _ = recompute(result.problem, g.posture())
    share = torque_share(grasp, settings.contact.metric)
    over = f"A joint torque is {share:.2f} times the hand's effort: --limits.effort 1 keeps it within."
    return over if share > 1.0 else ""


def uncertain_contacts(result: Planned) -> str:
    """Contacts that may occur a fingertip's radius early or late."""
    radius = np.array([finger.radius for finger in result.hand.fingers])
    meta = result.grasps.meta  # no factor is known for other kernels
    factor = 1.0 if meta.get("free_space") else CALIBRATION.get(str(meta.get("kernel")), 0.0)
    deviation = factor * result.grasps.contact_deviation[0]
    found = _fingers(result, deviation > radius, 1e3 * deviation, "mm")
    reason = f"Contacts are uncertain by more than a fingertip's radius of {1e3 * radius.max():.0f} mm"
    calibrated = "" if factor == 1.0 else f" (calibrated deviation {factor:g} σ)"
    return f"{reason}{calibrated}: {found}." if found else ""


def far_start(result: Planned) -> str:
    """The wrist moved far from its start, or to the bound of its travel."""
    if result.problem is None:
        return ""
    meta, g = result.grasps.meta, result.grasps
    number = int(g.start[0])
    begin = starts(result.problem, number + 1, int(meta["seed"]))[number].wrist
    moved = pin.log6(pin.XYZQUATToSE3(begin).actInv(pin.XYZQUATToSE3(g.wrist[0]))).linear
    travel, bound = float(np.abs(moved).max()), float(meta["settings"]["limits"]["wrist_travel"])
    if travel >= AT_BOUND * bound:
        return f"The bound of its travel, {bound:g} m, stops the wrist: --limits.wrist-travel widens it."
    far = f"The wrist went {1e2 * travel:.0f} cm from its start, more than half of what it may: try more --starts."
    return far if travel > TRAVEL_SHARE * bound else ""


def foreign_mount(result: Planned) -> str:
    """The arm's file has mounts for other hands, but none for this one."""
    arm, name = result.hand.arm, result.hand.name
    if arm is None or len(arm.mounts) == 1 or name in arm.mounts:
        return ""
    return (
        f"The arm '{arm.name}' has no mount for the hand '{name}' and takes its default, which other hands have: "
        "say under `mount` of an arm.yaml of your own where yours is screwed to it, and name its folder by --arm."
    )


def replaced(result: Planned) -> str:
    """A term or constraint of the user's own has the name of a built-in one, and takes its place."""
    if result.problem is None:
        return ""
    added, settings = result.problem.additions, result.problem.settings
    builtin = [c.name for c in preset_constraints(settings)] + [t.name for t in preset_terms(settings)]
    own = [c.name for c in added.constraints if is_own(c.value)] + [t.name for t in added.terms if is_own(type(t))]
    names = [name for name in own if name in builtin]
    it = f"the built-in {', '.join(names)}, which {'are' if len(names) > 1 else 'is'} neither planned nor checked"
    return f"What you added takes the place of {it}: give it another name if you want both." if names else ""


def close_runner_up(result: Planned) -> str:
    """Another feasible grasp is ranked as good as the first."""
    g, key = result.grasps, str(result.grasps.meta["settings"]["rank_by"])
    first = np.minimum(g.margins_initial.min(axis=1), g.margins_equilibrium.min(axis=1))
    values = {"margin": first, "margin_initial": g.margins_initial.min(axis=1), "energy": g.energy}
    values["confidence"] = g.confidence
    value = values.get(key, g.stiffness)
    within = CLOSE if key.startswith("margin") else CLOSE * abs(float(value[0]))
    others = [rank for rank, same in enumerate(alike(g.contacts)) if same == rank and rank and g.feasible[rank]]
    near = [rank for rank in others if abs(value[rank] - value[0]) <= within]
    if not near or not g.feasible[0]:
        return ""
    apart = 1e3 * np.linalg.norm(g.contacts[near[0]] - g.contacts[0], axis=1).max()
    unlike = f"though its contacts lie up to {apart:.0f} mm elsewhere (energy {g.energy[near[0]] - g.energy[0]:+.1f})"
    return f"The choice is close: by {key.replace('_', ' ')}, start {g.start[near[0]]} is as good, {unlike}."


def _fingers(result: Planned, chosen: BoolArray, values: Array, unit: str) -> str:
    """The chosen fingers with their values, "" for none."""
    named = zip(result.grasps.finger_names, chosen, values, strict=True)
    return ", ".join(f"{name} {value:.0f} {unit}" for name, is_chosen, value in named if is_chosen)
