"""`sgnlp draft-hand`: a hand's folder from a URDF or MJCF."""

from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from sgnlp.base.errors import InputError
from sgnlp.cli import codes
from sgnlp.cli.check_hand import tell
from sgnlp.hand.check import examine
from sgnlp.hand.draft.draft import draft
from sgnlp.hand.draft.text import listed, text
from sgnlp.hand.hand import HAND_FILE
from sgnlp.planning import results
from sgnlp.show.png import drawable, picture
from sgnlp.show.scene_hand import hand_scene

PICTURE = "draft.png"


@dataclass
class DraftHand:
    """Draft a hand's folder from its URDF or MJCF, examine it, and draw it. The picture needs the extra `view`."""

    file: tyro.conf.Positional[Path]
    """the URDF or MJCF of the hand, alone or on an arm or a robot"""
    palm: str | None = None
    """link that the fingers branch off from; if not given, the only one with three chains of joints or more"""
    tips: tuple[str, ...] = ()
    """links of the fingertips, in the order of the fingers; if not given, the end of each chain"""
    couple: tuple[tuple[str, str, float], ...] = ()
    """joints that one motor moves: a joint, the one that it follows, and the factor, again and again for more joints"""
    mirror: bool = False
    """draft the mirror image: a left hand of a right one"""
    out: Path | None = None
    """folder of the hand; its name is the hand's; if not given, a folder here with the name in the URDF or MJCF"""
    force: bool = False
    """overwrite a hand that is in the folder already"""

    def run(self, console: Console) -> int:
        """Draft, write, examine, draw."""
        if self.out:
            self._check(self.out)
        drafted = draft(self.file, self.palm, self.tips, self.mirror, self.couple)
        folder = self.out or Path(drafted.name)
        self._check(folder)
        results.write_text(folder / HAND_FILE, text(drafted, folder))
        examination = examine(folder)
        tell(console, examination)
        if drafted.left:
            few = f"left out, having too few joints to touch an object together with the others: {listed(drafted.left)}"
            console.print(f"{few}; --tips names the fingers instead", soft_wrap=True)
        console.print(f"written: {folder / HAND_FILE}", soft_wrap=True)
        if examination.hand is not None:
            try:
                drawable()
            except InputError as error:
                console.print(f"no picture: {error}", style="dim", soft_wrap=True)
            else:
                results.write_bytes(folder / PICTURE, picture(hand_scene(examination.hand, examination), 0, 0))
                console.print(f"written: {folder / PICTURE}", soft_wrap=True)
        return codes.BAD_INPUT if examination.wrong else codes.FEASIBLE

    def _check(self, folder: Path) -> None:
        """Refuse a folder that cannot be written, or already has a hand."""
        if (folder / HAND_FILE).exists() and not self.force:
            raise InputError(f"'{folder}' has a {HAND_FILE} already; choose another --out, or --force")
        results.writable(folder)
