"""Fixed obstacles around the object: boxes, balls, cylinders and half-spaces."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sgnlp.perception.shape import FAR, Shape
from sgnlp.simulation.body import Body
from sgnlp.simulation.scene import OBJECT, SHOWN, add_object, compiled, empty_scene, touchable
from sgnlp.simulation.settings import SimulationSettings

OBSTACLE = "obstacle/"
"""Prefix of the bodies' names; several shapes may have the same name."""
OVERLAP = 1e-3
"""An obstacle does not touch the object if the object begins deeper in it than this [m]: it cannot really be there."""


def add_obstacles(spec: Any, obstacles: Sequence[Shape], body: Body, settings: SimulationSettings) -> None:
    """Add the shapes to a scene with the object, grown by their radius; their edges are sharp.

    They touch everything but each other, the table, and an object that they reach into: a box around what a camera saw
    is rounded outwards.
    """
    _add(spec, obstacles, settings)
    for i in _reaching(obstacles, body, settings) if obstacles else ():
        spec.add_exclude(bodyname1=f"{OBSTACLE}{i}", bodyname2=OBJECT)


def _add(spec: Any, obstacles: Sequence[Shape], settings: SimulationSettings) -> None:
    for i, shape in enumerate(obstacles):
        solid = spec.worldbody.add_body(name=f"{OBSTACLE}{i}", **_place(shape))
        touchable(solid.add_geom(name=f"{OBSTACLE}{i}", group=SHOWN, **_form(shape)), settings)


def _reaching(obstacles: Sequence[Shape], body: Body, settings: SimulationSettings) -> list[int]:
    """Indices of the obstacles that the object begins in."""
    import mujoco

    spec = empty_scene(body, settings)
    add_object(spec, body, settings)
    _add(spec, obstacles, settings)
    model = compiled(spec)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    places = {model.geom(f"{OBSTACLE}{i}").id: i for i in range(len(obstacles))}
    deep = (data.contact[i] for i in range(data.ncon) if data.contact[i].dist < -OVERLAP)
    return sorted({places[geom] for contact in deep for geom in contact.geom.tolist() if geom in places})


def _place(shape: Shape) -> dict[str, Any]:
    import mujoco

    turn, middle = np.zeros(4), np.asarray(shape.centre, float)
    mujoco.mju_mat2Quat(turn, np.ascontiguousarray(shape.rotation, float).ravel())
    if _endless(shape):
        middle = middle + shape.rotation[:, 2] * (shape.half[2] + shape.radius)
    return {"pos": middle, "quat": turn}


def _form(shape: Shape) -> dict[str, Any]:
    import mujoco

    kind, half = mujoco.mjtGeom, shape.half + shape.radius
    if shape.circular:
        return {"type": kind.mjGEOM_CYLINDER, "size": [half[0], half[2], 0.0]}
    if _endless(shape):
        return {"type": kind.mjGEOM_PLANE, "size": [FAR, FAR, 1.0]}
    if not shape.half.any():
        return {"type": kind.mjGEOM_SPHERE, "size": [shape.radius, 0.0, 0.0]}
    return {"type": kind.mjGEOM_BOX, "size": half}


def _endless(shape: Shape) -> bool:
    """Whether it is a half-space."""
    return not shape.circular and bool((shape.half >= FAR).all())
