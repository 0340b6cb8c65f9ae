"""The hands that come with the package, including those whose description is in a package not installed."""

from dataclasses import dataclass

from sgnlp.base.errors import NotInstalledError
from sgnlp.hand import hand_file, library
from sgnlp.hand.hand import HAND_FILE, available_hands, load_hand


@dataclass(frozen=True)
class Listing:
    """A hand in the list."""

    name: str
    fingers: int
    joints: int
    """Number of joints with their own coordinate."""
    coupled: int | None
    """Number of mimic joints; None if the description is not installed."""
    package: str
    """The package with the description; empty if it is beside the hand's file."""
    command: str | None
    """The command that makes the hand usable; None if it is usable, empty if the command is not known."""


def listed_hands() -> tuple[Listing, ...]:
    """A listing for each name of `available_hands`."""
    return tuple(_listing(name) for name in available_hands())


def _listing(name: str) -> Listing:
    entries = hand_file.entries(hand_file.text(library.find("hand", name, HAND_FILE)))
    source = entries["urdf"]
    package = "" if isinstance(source, str) else source["package"]
    coupled, command = None, None
    try:
        coupled = len(load_hand(name).mimics)
    except NotInstalledError as error:
        command = error.command
    return Listing(name, len(entries["fingers"]), len(entries["reference"]), coupled, package, command)
