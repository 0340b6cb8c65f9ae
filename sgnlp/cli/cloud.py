"""`sgnlp cloud`: from depth images or clouds of a scene to a problem file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console

from sgnlp.base.checked import POSITIVE, Checked
from sgnlp.base.errors import InputError
from sgnlp.cli import codes, segmenting
from sgnlp.cli.flags import check_problem_file
from sgnlp.perception import depth, depth_files
from sgnlp.perception.observation import UNTURNED, Up
from sgnlp.planning import results


@dataclass(kw_only=True)
class Cloud(Checked):
    """Make the cloud of an object, for `sgnlp solve`, from depth images (.png .tif .npy) or clouds of a whole scene.

    Without masks it finds the table and lists the objects on it. It writes the only object, or the chosen one. With
    masks it writes the marked pixels.
    """

    files: tyro.conf.Positional[tuple[Path, ...]]
    """depth images, rectified, 0 or NaN where nothing was measured; or clouds (.ply .pcd .npz .npy .xyz); each file is
    a view, and all share one world frame"""
    masks: tuple[Path, ...] = ()
    """a mask image for each depth image; the object is where it is not black"""
    label: tuple[int, ...] = ()
    """value of the object's pixels in masks of labels: one for all masks, or one for each"""
    cameras: tuple[Path, ...] = ()
    """a JSON or YAML file for each depth image: K, the 9 intrinsics in pixels, and pose, the 16 numbers of the matrix
    from camera to world (not needed for one image without a mask); or a file of Open3D, OpenCV, ROS, RealSense or
    BOP"""
    unit: Annotated[float | None, POSITIVE] = None
    """unit of the depths or coordinates in metres: 0.001 for millimetres, 1 for metres; if not given, 0.001 for depths
    and 1 for clouds"""
    table_height: float | None = None
    """height of the table in the world [m]; measured if not given"""
    key: str | None = None
    """name of the array of points in an npz, if it is not `points`"""
    up: Up = UNTURNED
    """without masks: axis of the cloud's frame that points up; it is turned to z"""
    pose: tuple[float, ...] | None = None
    """without masks: pose of the cloud's frame (such as a camera's) in the world: 16 numbers of a matrix in metres, row
    by row"""
    pick: tuple[int, ...] = ()
    """without masks: number of the cluster to write; several numbers are parts of one object"""
    near: tuple[float, float, float] | None = None
    """without masks: write the cluster nearest to this point of the world [m]"""
    pixel: tuple[int, int] | None = None
    """without masks: write the cluster at this column and row of the first image or organised cloud"""
    all_: Annotated[bool, tyro.conf.arg(name="all")] = False
    """without masks: write every object, each as a file in the folder --out"""
    png: Path | None = None
    """without masks: a picture of the scene with the numbers of the clusters"""
    out: Path = Path("object.npz")
    """the problem file, NAME.npz; with --all a folder, NAME or NAME.npz"""

    def run(self, console: Console) -> int:
        """Read the files, unproject or cluster, save."""
        check_problem_file(self._file)
        for out in (self.out, *([self.png] if self.png else [])):
            if any(file.exists() and out.exists() and file.samefile(out) for file in self.files):
                raise InputError(f"'{out}' is an input, which the output would replace; name another file")
        if self.png and self.png.suffix.lower() != ".png":
            raise InputError(f"--png must end in .png; found '{self.png}'")
        return self._marked(console) if self.masks else self._parted(console)

    @property
    def _file(self) -> Path:
        """The problem file; with --all what gives its name to the folder."""
        return self.out.with_name(f"{self.out.name}.npz") if self.all_ and not self.out.suffix else self.out

    def _parted(self, console: Console) -> int:
        if self.label:
            raise InputError("--label chooses in --masks, and there are none")
        source = segmenting.Source(
            files=self.files,
            cameras=self.cameras,
            unit=self.unit,
            key=self.key,
            up=self.up,
            pose=self.pose,
            table_height=self.table_height,
        )
        choice = segmenting.Choice(self.pick, self.near, self.pixel, self.all_)
        return segmenting.run(console, source, choice, self._file, self.png)

    def _marked(self, console: Console) -> int:
        others = ("key", "pose", "pick", "near", "pixel", "png")
        given = [name for name in others if getattr(self, name) not in (None, ())]
        given += ["all"] * self.all_ + ["up"] * (self.up != UNTURNED)
        if given:
            raise InputError(f"--{given[0]} is for scenes without --masks")
        if not len(self.files) == len(self.masks) == len(self.cameras):
            counts = f"{len(self.files)} images, {len(self.masks)} masks and {len(self.cameras)} cameras"
            raise InputError(f"every depth image needs a mask and a camera; found {counts}")
        if len(self.label) not in (0, 1, len(self.masks)):
            raise InputError(f"--label needs one value, or one for each mask; found {len(self.label)}")
        labels = self.label * len(self.masks) if len(self.label) == 1 else self.label or (None,) * len(self.masks)
        read = zip(self.files, self.masks, self.cameras, labels, strict=True)
        images = [depth_files.read(file, mask, camera, self.unit, label) for file, mask, camera, label in read]
        arrays = depth.arrays(images, self.table_height)
        for note in arrays["notes"]:
            console.print(note, style="dim", soft_wrap=True)
        results.write_arrays(
            self.out, arrays | {"name": np.array(self.out.stem), "notes": np.array(arrays["notes"], str)}
        )
        counts = ", ".join(map(str, np.bincount(arrays["view"])))
        console.print(f"{self.out.stem}: points from each view: {counts}")
        console.print(f"written: {self.out}", soft_wrap=True)
        return codes.FEASIBLE
