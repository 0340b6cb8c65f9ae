"""`sgnlp observe`: makes a problem file from a mesh with simulated depth cameras."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console
from scipy.spatial.transform import Rotation

from sgnlp.base.checked import NOT_NEGATIVE, POSITIVE, Checked, Positive
from sgnlp.base.errors import InputError
from sgnlp.cli import codes
from sgnlp.cli.flags import check_problem_file
from sgnlp.perception import open3d_files
from sgnlp.perception.synthetic import scenes
from sgnlp.perception.synthetic.cameras import DepthCamera
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.scenes import Ring
from sgnlp.perception.synthetic.settling import random_orientation, settled
from sgnlp.planning import results

DROPS = 20  # random orientations that are tried before giving up on a body that does not come to rest


@dataclass
class Observe(Checked):
    """Make a problem of a mesh (.obj .stl .ply .off .glb .gltf): put it on a table before simulated depth cameras."""

    file: tyro.conf.Positional[Path]
    """the mesh, with z up (glTF: y up, as its standard says), in metres"""
    out: Path | None = None
    """the problem file; NAME.npz here if not given"""
    views: Annotated[int, POSITIVE] = scenes.VIEWS
    """cameras, evenly spaced around the table"""
    seed: Annotated[int, NOT_NEGATIVE] = 0
    """seed of everything random"""
    yaw_deg: float = 0.0
    """rotation of the object about the vertical [deg]"""
    settle: bool = False
    """drop it from a random orientation and use its pose at rest; needs MuJoCo (pip install 'sgnlp[sim]')"""
    scale: Positive = 1.0
    """factor to metres: 0.001 for a mesh in millimetres"""
    mass: Positive = 0.1
    """mass of the object for a simulation [kg]"""
    friction: Positive = 1.0
    """friction coefficient between fingertip and object, for a simulation"""
    ring: Ring = field(default_factory=Ring)
    """where the cameras stand"""
    camera: DepthCamera = field(default_factory=DepthCamera)
    """image size, intrinsics and noise of each camera; a RealSense D415 by default"""

    def run(self, console: Console) -> int:
        """Read the mesh, place it, simulate the cameras, save."""
        out = self.out or Path(f"{self.file.resolve().stem}.npz")
        check_problem_file(out)
        rng = np.random.default_rng(self.seed)
        try:
            mesh, notes = scenes.body(*open3d_files.triangles(self.file), scale=self.scale)
            arrays = scenes.scene(
                self._placed(mesh, rng),
                out.stem,
                rng,
                mass=self.mass,
                friction=self.friction,
                views=self.views,
                ring=self.ring,
                camera=self.camera,
            )
        except InputError as error:
            raise InputError(f"{self.file}: {error}") from error
        results.write_arrays(out, arrays)
        for note in notes:
            console.print(note, style="dim")
        size = " x ".join(f"{1e3 * side:.0f}" for side in np.ptp(arrays["mesh_vertices"], axis=0))
        console.print(
            f"{out.stem}: {size} mm, points from each view: {', '.join(map(str, np.bincount(arrays['view'])))}"
        )
        console.print(f"written: {out}", soft_wrap=True)
        return codes.FEASIBLE

    def _placed(self, mesh: Mesh, rng: np.random.Generator) -> Mesh:
        """The mesh in its pose on the table."""
        if self.settle:
            drops = (settled(mesh, random_orientation(rng)) for _ in range(DROPS))
            rest = next((quaternion for quaternion in drops if quaternion is not None), None)
            if rest is None:
                raise InputError(f"does not come to rest in {DROPS} drops; leave out --settle")
            mesh = mesh.turned(rest)
        return mesh.turned(Rotation.from_euler("z", self.yaw_deg, degrees=True).as_quat()).standing()
