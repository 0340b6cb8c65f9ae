"""An MJCF as MuJoCo reads and compiles it."""

from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.base.errors import InputError, NotInstalledError

CORNERS, FACES = np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
"""A tetrahedron."""


def compiled(file: Path) -> tuple[Any, Any]:
    """The file as a `mujoco.MjSpec` and as a `mujoco.MjModel`, with every body kept.

    In the model, a small solid replaces each mesh of which only the pose is needed: reading a mesh takes a second.

    Raises:
        InputError: MuJoCo is not installed, or cannot read the file.
    """
    try:
        import mujoco
    except ImportError:
        command = "pip install 'sgnlp[sim]'"
        raise NotInstalledError(f"it is an MJCF, which MuJoCo reads: {command}", command) from None
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        light = spec.copy()
        light.compiler.fusestatic, light.compiler.discardvisual = False, False
        needed = _needed(light)
        for mesh in light.meshes:
            if mesh.file and mesh.name not in needed:
                mesh.file, mesh.scale, mesh.refpos, mesh.refquat = "", np.ones(3), np.zeros(3), [1, 0, 0, 0]
                mesh.uservert, mesh.userface = CORNERS.ravel(), FACES.ravel()
        return spec, light.compile()
    except (ValueError, RuntimeError) as error:
        raise InputError(f"MuJoCo cannot read it: {' '.join(str(error).split())}") from None


def _needed(spec: Any) -> set[str]:
    """The meshes that a body's inertia, or the size of a solid, is made from."""
    import mujoco

    always = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    fitted = mujoco.mjtGeom.mjGEOM_MESH
    return {
        geom.meshname
        for body in spec.bodies
        for geom in body.geoms
        if geom.meshname and (always or not body.explicitinertial or geom.type != fitted)
    }
