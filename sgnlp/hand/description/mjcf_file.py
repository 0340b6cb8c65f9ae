"""An MJCF as MuJoCo reads and compiles it."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from sgnlp.base.errors import InputError, NotInstalledError

CORNERS, FACES = np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
"""A tetrahedron."""
TURN = 2 * np.pi
"""A hand has a hinge that turns by more degrees than this."""
REMEDIES = {
    "unrecognized attribute": "; MuJoCo no longer has it: delete it in the file",
    "could not find decoder": "; let the name of the file end in .xml",
    "unknown default class": "; it may be a part of another file: give the one that includes it",
}
"""What to do about an error of MuJoCo, by words in it."""


def compiled(file: Path) -> tuple[Any, Any]:
    """The file as a `mujoco.MjSpec` and as a `mujoco.MjModel`, with every body kept.

    In the model, a small solid replaces each mesh of which only the pose is needed: reading a mesh takes a second.

    Raises:
        InputError: MuJoCo is not installed, or cannot read the file.
    """
    try:
        spec = _read(file)
        spec.compiler.degree = spec.compiler.degree and not _small(spec)
        light = spec.copy()
        light.compiler.fusestatic, light.compiler.discardvisual = False, False
        needed = _needed(light)
        for mesh in light.meshes:
            if mesh.file and mesh.name not in needed:
                mesh.file, mesh.scale, mesh.refpos, mesh.refquat = "", np.ones(3), np.zeros(3), [1, 0, 0, 0]
                mesh.uservert, mesh.userface = CORNERS.ravel(), FACES.ravel()
        return spec, light.compile()
    except (ValueError, RuntimeError) as error:
        told = " ".join(str(error).split())
        remedy = next((remedy for words, remedy in REMEDIES.items() if words in told), "")
        raise InputError(f"MuJoCo cannot read it: {told}{remedy}") from None


def assumed_radians(file: Path) -> bool:
    """Whether `compiled` takes the angles of an MJCF as radians, although it says degrees or names no unit.

    MuJoCo reads degrees where a file names no unit. Parts that a larger file includes, which does, are in radians.
    """
    spec = _read(file)
    return bool(spec.compiler.degree) and _small(spec)


def _read(file: Path) -> Any:
    try:
        import mujoco
    except ImportError:
        command = "pip install 'sgnlp[sim]'"
        raise NotInstalledError(f"it is an MJCF, which MuJoCo reads: {command}", command) from None
    return mujoco.MjSpec.from_file(os.path.abspath(file))  # the paths of its meshes begin with it


def _small(spec: Any) -> bool:
    """Whether all ranges of the hinges are so small that they can be no degrees."""
    import mujoco

    hinges = [joint.range for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE and np.any(joint.range)]
    return bool(hinges) and float(np.abs(hinges).max()) <= TURN


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
