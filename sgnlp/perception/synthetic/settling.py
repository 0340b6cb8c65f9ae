"""Drops a body onto a table in MuJoCo and finds its resting orientation."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.perception.synthetic.meshes import Mesh


@dataclass(frozen=True)
class Drop:
    """The physics of a drop.

    The body touches the table with all corners of its convex hull, the only points that can touch a plane. MuJoCo's own
    contact of a mesh with a plane uses four at a time, on which a round rim would rock forever.
    """

    height: float = 0.005  # [m] initial height of the lowest point above the table
    friction: float = 0.5  # of the table
    torsion: float = 0.005  # [m] friction torque about the normal over the normal force
    rolling: float = 0.0005  # [m] the same about the tangents, which stops a round body
    timestep: float = 0.002  # [s]
    stiffness: float = 0.004  # [s] time constant of a contact, at least two steps: it gives way by about 0.02 mm
    speed: float = 5e-4  # [m/s] a body slower than this
    spin: float = 5e-3  # [rad/s] and this
    quiet: float = 0.25  # [s] for so long is at rest
    timeout: float = 10.0  # [s]


DROP = Drop()
TOUCH = 1e-5
"""[m] Radius of the contact spheres in the corners."""


def random_orientation(rng: np.random.Generator) -> Array:
    """A quaternion (4,), xyzw, drawn from all orientations alike."""
    direction = rng.standard_normal(4)
    return direction / np.linalg.norm(direction)


def settled(mesh: Mesh, quaternion: ArrayLike, drop: Drop = DROP) -> Array | None:
    """The resting orientation of a body that is dropped in another one; None if it does not come to rest in time.

    Both are unit quaternions (4,), xyzw. The body is uniform; if its mesh is not watertight, its convex hull is used
    as its volume. Raises `InputError` if MuJoCo is not installed, or the mesh is not a solid.
    """
    try:
        import mujoco
    except ImportError as error:
        raise InputError("letting a body settle needs MuJoCo: pip install 'sgnlp[sim]'") from error
    model = _model(mujoco, mesh, drop)
    data = mujoco.MjData(model)
    turned = mesh.turned(quaternion)
    data.qpos[:] = [0, 0, drop.height - turned.vertices[:, 2].min(), *np.roll(quaternion, 1)]  # MuJoCo's are wxyz
    quiet = 0.0
    while quiet < drop.quiet and data.time < drop.timeout:
        mujoco.mj_step(model, data)
        slow = np.linalg.norm(data.qvel[:3]) < drop.speed and np.linalg.norm(data.qvel[3:]) < drop.spin
        quiet = quiet + drop.timestep if slow else 0.0
    return np.roll(data.qpos[3:], -1) if quiet >= drop.quiet else None


def _model(mujoco: Any, mesh: Mesh, drop: Drop) -> Any:
    """The MuJoCo model of a free body above a plane."""
    spec = mujoco.MjSpec()
    spec.option.timestep = drop.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    touch = {
        "friction": [drop.friction, drop.torsion, drop.rolling],
        "solref": [drop.stiffness, 1.0],
        "condim": 6,  # sliding, torsion and rolling
    }
    shape = mujoco.mjtGeom
    spec.worldbody.add_geom(type=shape.mjGEOM_PLANE, size=[1, 1, 0.1], **touch)
    asset = spec.add_mesh(name="solid", uservert=mesh.vertices.ravel(), userface=mesh.faces.ravel())
    inertia = mujoco.mjtMeshInertia
    asset.inertia = inertia.mjMESH_INERTIA_CONVEX if mesh.open_edges else inertia.mjMESH_INERTIA_EXACT
    body = spec.worldbody.add_body()
    body.add_freejoint()
    body.add_geom(type=shape.mjGEOM_MESH, meshname="solid", contype=0, conaffinity=0)
    try:
        for corner in mesh.vertices[ConvexHull(mesh.vertices).vertices]:
            body.add_geom(type=shape.mjGEOM_SPHERE, size=[TOUCH, 0, 0], pos=corner, mass=0, conaffinity=0, **touch)
        return spec.compile()
    except (ValueError, QhullError) as error:
        raise InputError(f"the mesh is no solid to settle: {str(error).splitlines()[0]}") from error
