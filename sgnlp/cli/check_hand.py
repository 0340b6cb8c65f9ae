"""`sgnlp check-hand`: checks whether plans can use a hand's folder, and draws its spheres over its meshes."""

from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console
from rich.text import Text

from sgnlp.cli import codes, view
from sgnlp.hand import check
from sgnlp.show.scene_hand import hand_scene

STYLES = {"ok": "green", "look": "yellow", "wrong": "red"}
WIDTH = max(map(len, STYLES)) + 2


@dataclass
class CheckHand:
    """Examine a hand's folder, and draw its spheres over its meshes. The pictures need the extra `view`."""

    folder: tyro.conf.Positional[Path]
    """holds hand.yaml"""
    spheres: str = "cover"
    """preset of spheres"""
    png: Path | None = None
    """write a picture of the spheres over the meshes at the reference pose, from three sides"""
    html: Path | None = None
    """write the same as one HTML file that opens offline, with the poses at the joint limits"""

    def run(self, console: Console) -> int:
        """Examine, print, draw."""
        view.check_names(self.html, self.png)
        examination = check.examine(self.folder, self.spheres)
        tell(console, examination)
        if examination.hand is not None and (self.png or self.html):
            view.write(console, hand_scene(examination.hand, examination), self.html, self.png, 0, 0)
        return codes.BAD_INPUT if examination.wrong else 0


def tell(console: Console, examination: check.Examination) -> None:
    """Print the findings and how many there are."""
    for found in examination.findings:
        console.print(_line(found), soft_wrap=True)
    looks = sum(finding.verdict == "look" for finding in examination.findings)
    console.print(f"{len(examination.findings)} checks: {examination.wrong} wrong, {looks} to look at")


def _line(finding: check.Finding) -> Text:
    verdict = finding.verdict.ljust(WIDTH), STYLES[finding.verdict]
    return Text.assemble(verdict, f"{finding.check}: {finding.found}", (f"  ({finding.valid})", "dim"))
