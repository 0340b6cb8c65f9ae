"""Names of variables and rows of a nonlinear program: `target.thumb.x`, `contact[ring]`, `table[middle_distal]`."""

from collections.abc import Sequence
from functools import lru_cache

from sgnlp.base.errors import unknown
from sgnlp.hand.hand import Hand
from sgnlp.program.carried import far_spheres, near_spheres
from sgnlp.program.constraint import Constraint

AXES = ("x", "y", "z")


@lru_cache(maxsize=8)
def labels(hand: Hand) -> dict[str, tuple[str, ...]]:
    """Labels of rows by the values of `Constraint.over`; every sphere but the pads is a `link`."""
    spheres, arm = tuple(sphere.name for sphere in hand.spheres), hand.arm
    return {
        "": ("",),
        "finger": tuple(finger.name for finger in hand.fingers),
        "joint": hand.joint_names,
        "link": tuple(name for i, name in enumerate(spheres) if i not in hand.tip_spheres),
        "sphere": spheres,
        "pair": tuple(f"{spheres[i]}-{spheres[j]}" for i, j in hand.pairs),
        "axis": AXES,
        "arm_turn": arm_names(hand)[len(arm.joint_names) :] if arm else (),
        "pose": tuple(f"{kind}{axis}" for kind in ("", "r") for axis in AXES),
        "arm": tuple(arm.spheres[i].name for i in arm.free_spheres) if arm else (),
        "arm_pair": tuple(f"{arm.spheres[i].name}-{arm.spheres[j].name}" for i, j in arm.pairs) if arm else (),
        "arm_palm": tuple(f"{arm.spheres[j].name}-{spheres[i]}" for i in near_spheres(hand) for j in far_spheres(arm))
        if arm
        else (),
        "tip": tuple(f"{finger.name}.{axis}" for axis in AXES for finger in hand.fingers),
    }


def variable_names(hand: Hand) -> tuple[str, ...]:
    """A name for each variable (nx,): the wrist's tangent, the joints by their own names, targets and gains."""
    fingers = [finger.name for finger in hand.fingers]
    wrist = [f"wrist.{kind}{axis}" for kind in ("", "r") for axis in AXES]
    targets = [f"target.{finger}.{axis}" for finger in fingers for axis in AXES]
    return (*wrist, *(f"joint.{name}" for name in hand.joint_names), *targets, *(f"gain.{name}" for name in fingers))


def contact_names(hand: Hand, c: bool, joints: bool) -> tuple[str, ...]:
    """A name for each variable of the hand at first contact: c of each finger and the joints, if they are variables."""
    fingers = [f"c.{finger.name}" for finger in hand.fingers] if c else []
    return (*fingers, *(f"contact.{name}" for name in hand.joint_names if joints))


def arm_names(hand: Hand) -> tuple[str, ...]:
    """A name for each variable of an arm that carries the hand; none without one."""
    joints = hand.arm.joint_names if hand.arm else ()
    return tuple(f"{place}.{name}" for place in ("arm", "standoff", "lift") for name in joints)


def row_names(hand: Hand, constraints: Sequence[Constraint], sizes: Sequence[int]) -> tuple[str, ...]:
    """A name for each row (ng,): its constraint's, with that of the finger, joint, sphere, pair or axis in brackets.

    Rows that do not belong to parts of the hand are numbered, if there are several.
    """
    return tuple(name for c, size in zip(constraints, sizes, strict=True) for name in rows_of(hand, c, size))


def rows_of(hand: Hand, constraint: Constraint, size: int) -> list[str]:
    """The names of the `size` rows of a constraint."""
    known = labels(hand)
    if constraint.over not in known:
        raise unknown(
            f"parts of constraint '{constraint.name}', over", constraint.over, [name for name in known if name]
        )
    over = known[constraint.over]
    if len(over) != size:
        over = tuple(map(str, range(size))) if size != 1 else ("",)
    return [f"{constraint.name}[{label}]" if label else constraint.name for label in over]
