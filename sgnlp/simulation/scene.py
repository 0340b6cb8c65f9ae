"""Table and object in MuJoCo: solver, contact and the true shape."""

from typing import Any

import numpy as np

from sgnlp.base.errors import InputError
from sgnlp.simulation.body import Body
from sgnlp.simulation.pieces import pieces
from sgnlp.simulation.settings import SimulationSettings

TABLE, OBJECT = "table", "object"
TABLE_HALF = 0.5
"""Half the side of the drawn table [m]; for contacts it is infinite."""
SHOWN, HIDDEN = 1, 3
"""Groups of geoms and sites: MuJoCo draws the first and not the second."""
PATCH_SHARE = 3 * np.pi / 16
"""Torsional friction torque of a fully slipping Hertzian patch, over μ · force · radius a of the patch: the integral of
μ p r over the patch with the pressure p ∝ √(1 - (r/a)²)."""
ITERATIONS, TOLERANCE = 200, 1e-16
"""Tolerance of Newton's method, near rounding. At 1e-10 the residual moves pads across the surface by 1 cm in 3 s, and
a grasp takes five times longer, because nothing comes to rest."""
DEPTH = 0.001
"""MuJoCo's width of the impedance [m]; without effect where the impedance does not depend on the depth."""


def empty_scene(body: Body, settings: SimulationSettings) -> Any:
    """A `mujoco.MjSpec` with the options and the table."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    option = spec.option
    option.timestep = settings.timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = settings.friction_impedance
    option.iterations, option.tolerance = ITERATIONS, TOLERANCE
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # a run that diverges is reported, not restarted
    plane, height = mujoco.mjtGeom.mjGEOM_PLANE, body.table_height
    table = spec.worldbody.add_geom(name=TABLE, type=plane, size=[TABLE_HALF, TABLE_HALF, 1], pos=[0, 0, height])
    touchable(table, settings)
    return spec


def add_object(spec: Any, body: Body, settings: SimulationSettings) -> None:
    """Add the free object: the true mesh gives mass and inertia, its convex pieces collide.

    The body's frame is the world's, so its pose is its motion from the given mesh.
    """
    import mujoco

    thing = spec.worldbody.add_body(name=OBJECT)
    thing.add_freejoint(name=OBJECT)
    mesh = spec.add_mesh(name=OBJECT, uservert=body.vertices.ravel(), userface=body.faces.ravel())
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    kind = mujoco.mjtGeom.mjGEOM_MESH
    thing.add_geom(name=OBJECT, type=kind, meshname=OBJECT, mass=settings.mass, contype=0, conaffinity=0, group=SHOWN)
    for i, piece in enumerate(pieces(body, settings.piece_error)):
        name = f"{OBJECT}/{i}"
        spec.add_mesh(name=name, uservert=piece.ravel())
        touchable(thing.add_geom(name=name, type=kind, meshname=name, mass=0, group=HIDDEN), settings)


def touchable(geom: Any, settings: SimulationSettings) -> None:
    """Set the same contact parameters for all: condim 4 is friction against sliding in two directions and against
    twist."""
    geom.contype = geom.conaffinity = 1
    geom.condim = 4
    geom.friction = [settings.friction, settings.friction * PATCH_SHARE * settings.pad_patch, 0.0]
    geom.solref = [settings.contact_time, 1.0]  # critically damped
    geom.solimp = impedance(settings.contact_impedance)


def impedance(value: float) -> list[float]:
    """MuJoCo's five numbers for an impedance that does not depend on the depth."""
    return [value, value, DEPTH, 0.5, 2.0]


def compiled(spec: Any) -> Any:
    """The `mujoco.MjModel`; raises `InputError` if MuJoCo refuses it."""
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo refuses the model: {' '.join(str(error).split())}") from None
