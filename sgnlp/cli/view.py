"""`sgnlp view`: shows planned grasps in the browser, in a file or in a picture."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console

from sgnlp.base.errors import InputError
from sgnlp.cli import codes
from sgnlp.planning import reopen, results
from sgnlp.planning.motion.files import load_trajectory
from sgnlp.planning.motion.trajectory import Trajectory
from sgnlp.show import web_page
from sgnlp.show.png import picture
from sgnlp.show.scene import scene
from sgnlp.show.scene_parts import Scene


@dataclass
class View:
    """Look at planned grasps: hand, cloud, surface with its deviation, contacts, springs. Needs the extra `view`."""

    folder: tyro.conf.Positional[Path]
    """a result of `sgnlp solve`"""
    html: Path | None = None
    """write one HTML file that opens offline, and serve nothing"""
    png: Path | None = None
    """write a picture from three sides, and serve nothing"""
    rank: int = 0
    """rank of the grasp in the picture; 0 is the best"""
    object: Path | None = None
    """the file that was solved, if it is elsewhere now"""
    hand: str | None = None
    """folder of the hand, if `sgnlp hands` does not list it"""
    port: int = 8080
    """port of the page: http://localhost:PORT"""

    def run(self, console: Console) -> int:
        """Read the result, rebuild its problem, draw."""
        check_names(self.html, self.png)
        shown = _scene(reopen.reopen(self.folder, self.object, self.hand), _motion(self.folder))
        for note in shown.notes:
            console.print(note, style="dim", soft_wrap=True)
        if not 0 <= self.rank < len(shown.views):
            raise InputError(f"--rank must be between 0 and {len(shown.views) - 1}")
        write(console, shown, self.html, self.png, self.rank, 1)
        if self.html is None and self.png is None:
            with web_page.server(web_page.page(shown), self.port) as server:
                console.print(f"open http://localhost:{server.server_port} in a browser; Ctrl-C ends", soft_wrap=True)
                server.serve_forever()
        return codes.FEASIBLE


def check_names(html: Path | None, png: Path | None) -> None:
    """Raise `InputError`, before any work, for a file whose name ends otherwise than what is written into it."""
    for flag, file, suffix in (("--html", html, ".html"), ("--png", png, ".png")):
        if file is not None and file.suffix.lower() != suffix:
            raise InputError(f"{flag} must end in {suffix}; found '{file}'")


def write(console: Console, shown: Scene, html: Path | None, png: Path | None, rank: int, stage: int) -> None:
    """Write the page of a scene, and the picture of one stage, if a file is given for it."""
    if html is not None:
        results.write_text(html, web_page.page(shown))
        console.print(f"written: {html}", soft_wrap=True)
    if png is not None:
        results.write_bytes(png, picture(shown, rank, stage))
        console.print(f"written: {png}", soft_wrap=True)


def _motion(folder: Path) -> Trajectory | None:
    """The trajectory beside the grasps; None for older results and for those without a feasible grasp."""
    file = (folder if folder.is_dir() else folder.parent) / results.MOTION[0]
    return load_trajectory(file) if file.is_file() else None


def _scene(result: reopen.Reopened, motion: Trajectory | None) -> Scene:
    if result.cloud is None:
        notes = [f"Without cloud and surface: {result.missing}."]
        return scene(result.grasps, result.hand, None, np.zeros((0, 3)), notes, motion)
    return scene(result.grasps, result.hand, result.problem, result.cloud.points, (), motion)
