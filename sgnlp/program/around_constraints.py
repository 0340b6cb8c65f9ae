"""The constraints of obstacles and regions, and of an arm that carries the hand."""

from math import inf, log
from typing import Any

from sgnlp.base.settings import Settings
from sgnlp.program.around import Around
from sgnlp.program.carried import POSTURES
from sgnlp.program.constraint import ANGLE, LENGTH, RATIO, Constraint, Rows
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.tolerances import CLEARANCE, DEXTERITY, REACHED, ROUNDING

SPHERES: dict[str, Any] = {"over": "sphere", "unit": LENGTH, "tolerance": CLEARANCE}
CONTACTS: dict[str, Any] = SPHERES | {"over": "finger"}
OF_ARM: dict[str, Any] = SPHERES | {"of_arm": True}
POSE: dict[str, Any] = {"over": "pose", "unit": LENGTH, "tolerance": REACHED, "always": True, "of_arm": True}


def _approach(g: Grasp, op: Ops) -> Any:
    """The least clearance of each sphere from obstacles, over the postures from the stand-off to the pregrasp."""
    S, gaps = g.spheres.shape[0], g.obstacle_clearances_approach
    return op.closest(g.obstacle_clearances, *(gaps[k : k + S] for k in range(0, gaps.shape[0], S)))


def _arm_way(g: Grasp, op: Ops) -> Any:
    """The least clearance of each free sphere of the arm, over stand-off, pregrasp and lift."""
    gaps = g.arm.clearances
    A = gaps.shape[0] // POSTURES
    return op.closest(*(gaps[k * A : (k + 1) * A] for k in range(POSTURES)))


def _contact_and_lift(g: Grasp, op: Ops) -> Any:
    return op.closest(g.obstacle_clearances_contact, g.obstacle_clearances_lift)


def _turns(g: Grasp, op: Ops) -> Any:
    return op.stack(g.arm.standoff - g.arm.joints, g.arm.lift - g.arm.joints)


AROUND: tuple[Constraint, ...] = (
    Constraint(
        "obstacles",
        _approach,
        **SPHERES,
        about="hand clear of obstacles on the straight way from the stand-off to the pregrasp",
    ),
    Constraint(
        "obstacles_contact",
        _contact_and_lift,
        **SPHERES,
        about="hand clear of obstacles at first contact, and when it has risen with the object",
    ),
    Constraint(
        "arm", _arm_way, **OF_ARM | {"over": "arm"}, about="arm clear of obstacles, table and object on the whole way"
    ),
    Constraint("arm_self", Rows("arm.pair_clearances"), **OF_ARM | {"over": "arm_pair"}, about="arm clear of itself"),
    Constraint("arm_hand", Rows("arm.hand_clearances"), **OF_ARM | {"over": "arm_palm"}, about="arm clear of the palm"),
    Constraint(
        "wrist",
        Rows("arm.wrist_error"),
        **POSE,
        about="arm at the pregrasp off the wrist; a turn of 1 rad counts as 10 cm",
    ),
    Constraint(
        "standoff",
        Rows("arm.standoff_error"),
        **POSE,
        about="arm at the stand-off off the straight way; a turn of 1 rad counts as 10 cm",
    ),
    Constraint(
        "lift",
        Rows("arm.lift_error"),
        **POSE,
        about="arm with the object lifted off the straight way; a turn of 1 rad counts as 10 cm",
    ),
    Constraint(
        "dexterity",
        Rows("arm.dexterity"),
        unit=RATIO,
        tolerance=DEXTERITY,
        of_arm=True,
        about="manipulability of the arm over that at home",
    ),
    Constraint("avoid", Rows("avoid_distances"), **CONTACTS, about="contact points off the regions to avoid"),
    Constraint("touch", Rows("touch_distances"), **CONTACTS, about="contact points in the regions to touch"),
    Constraint(
        "arm_turn",
        _turns,
        over="arm_turn",
        unit=ANGLE,
        tolerance=ROUNDING,
        of_arm=True,
        about="turn of the arm's joints to the stand-off, and up: it keeps its elbow",
    ),
)
"""These constraints without their bounds, in the order of the rows of g."""


def around_bounds(s: Settings, around: Around) -> dict[str, tuple[float, float]]:
    """The bounds of these constraints, for the kinds of surroundings in the program."""
    bounds: dict[str, tuple[float, float]] = {}
    if around.obstacles:
        clear = s.limits.obstacle_margin, inf
        bounds |= {"obstacles": clear, "obstacles_contact": clear}
    if around.carried:
        clear = s.limits.obstacle_margin, inf
        bounds |= dict.fromkeys(("arm", "arm_self", "arm_hand"), clear)
        bounds |= dict.fromkeys(("wrist", "standoff", "lift"), (0.0, 0.0))
        bounds["dexterity"] = log(s.limits.dexterity), inf
        bounds["arm_turn"] = -s.limits.arm_turn, s.limits.arm_turn
    if around.avoid:
        bounds["avoid"] = (s.limits.region_margin, inf)
    if around.touch:
        bounds["touch"] = (-inf, -s.limits.region_margin)
    return bounds
