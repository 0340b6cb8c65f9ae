"""The joints of a description: fixed, or moving between limits."""

import xml.etree.ElementTree as ElementTree

from sgnlp.base.errors import InputError

MOVING = ("revolute", "prismatic")


def bare(joint: ElementTree.Element) -> None:
    """Remove what only describes motion from a fixed joint: some programs write an axis of 0 0 0 there."""
    for tag in ("axis", "mimic", "limit"):
        for left in joint.findall(tag):
            joint.remove(left)


def check_joint(name: str, joint: ElementTree.Element) -> None:
    """Check that a joint is fixed or has limits. Its effort comes from the hand's file; its velocity is not needed."""
    kind, limit = joint.get("type", ""), joint.find("limit")
    if kind == "fixed":
        return
    if kind == "continuous":
        ends = f"give it ends [rad] in the hand's file, limits: {{{name}: [lower, upper]}}"
        raise InputError(f"joint '{name}' is continuous, without an end; {ends}")
    if kind not in MOVING:
        instead = "make it fixed; the wrist's pose is planned beside the joints"
        raise InputError(
            f"joint '{name}' is {kind or 'of no type'}; only revolute, prismatic and fixed ones work: {instead}"
        )
    if limit is None:
        raise InputError(f"joint '{name}' has no <limit>; give it one with lower and upper, or make the joint fixed")
    for key in ("lower", "upper", "effort", "velocity"):
        limit.set(key, limit.get(key, "0"))  # the last two are not used
    low, high, *powers = (float(limit.get(key, "")) for key in ("lower", "upper", "effort", "velocity"))
    if min(powers) < 0:
        raise InputError(f"joint '{name}' has a negative effort or velocity in its <limit>; write 0 or more")
    if not low < high:
        change = "swap them" if low > high else "write lower and upper, or make the joint fixed"
        raise InputError(f"joint '{name}' has the limits [{low:g}, {high:g}]; lower must be below upper: {change}")
