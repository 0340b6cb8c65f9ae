"""The palm: the deepest link from which three or more chains of moving joints branch off."""

from sgnlp.base.errors import InputError
from sgnlp.hand.draft.skeleton import Skeleton
from sgnlp.hand.hand_file import MIN_FINGERS


def palm(skeleton: Skeleton) -> str:
    """The name of the only link that can be a palm.

    A chain is identified by its last joint; mimic joints count as moving.

    Raises:
        InputError: there is none, or several, as on a humanoid with two hands.
    """
    found = candidates(skeleton)
    if len(found) == 1:
        return found[0]
    if not found:
        ends = ", ".join(f"'{skeleton.model.names[end]}'" for end in skeleton.ends) or "none"
        raise InputError(
            f"no link of {skeleton.urdf.name} carries {MIN_FINGERS} chains of moving joints; chains end in {ends}; "
            "a hand has three fingers at least"
        )
    names = ", ".join(f"'{name}'" for name in found)
    raise InputError(f"{skeleton.urdf.name} has {len(found)} links that can be a palm: {names}; choose one by --palm")


def candidates(skeleton: Skeleton) -> list[str]:
    """All links that can be a palm, in the order of the model."""
    above = {end: list(skeleton.above(end)) for end in skeleton.ends}
    counts = {link: sum(link in line for line in above.values()) for line in above.values() for link in line}
    forks = {link for link, count in counts.items() if count >= MIN_FINGERS}
    deepest = [link for link in sorted(forks) if not any(link in _over(skeleton, other) for other in forks - {link})]
    return [skeleton.model.frames[link].name for link in deepest]


def _over(skeleton: Skeleton, link: int) -> set[int]:
    """The frames above a link."""
    found, frame = set(), link
    while frame := skeleton.model.frames[frame].parentFrame:
        found.add(frame)
    return found
