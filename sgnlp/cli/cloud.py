"""`sgnlp cloud`: from depth images with masks and calibrated cameras to a problem file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console

from sgnlp.base.checked import POSITIVE, Checked
from sgnlp.base.errors import InputError
from sgnlp.cli import codes
from sgnlp.cli.flags import check_problem_file
from sgnlp.perception import depth, depth_files
from sgnlp.planning import results


@dataclass(kw_only=True)
class Cloud(Checked):
    """Make a cloud of the marked pixels of depth images (.png, .tif, .npy), each a view, for `sgnlp solve`."""

    files: tyro.conf.Positional[tuple[Path, ...]]
    """the depth images; rectified, 0 or NaN where nothing was measured"""
    masks: tuple[Path, ...]
    """an image for each, not black where the object is"""
    label: tuple[int, ...] = ()
    """value of the object's pixels in masks of labels: one for all masks, or one for each"""
    cameras: tuple[Path, ...]
    """a JSON or YAML for each: K, its 9 intrinsics in pixels, and pose, the 16 numbers of the matrix from camera to
    world; or a file of Open3D, ROS, RealSense or BOP"""
    unit: Annotated[float | None, POSITIVE] = None
    """metres of a step of the depths: 0.001 for millimetres, which is assumed if not given, 1 for metres"""
    table_height: float | None = None
    """height of the table [m]; measured from the pixels around the object if not given"""
    out: Path = Path("object.npz")
    """the problem file"""

    def run(self, console: Console) -> int:
        """Read, unproject, save."""
        check_problem_file(self.out)
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
