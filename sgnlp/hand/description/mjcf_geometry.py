"""The geoms of an MJCF body as visual and collision geometry of a URDF's link."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.errors import InputError
from sgnlp.hand.description.poses import add, place, pose, words

HIDDEN = 3
"""The first group of geoms that MuJoCo's viewer does not show: by custom, those that only collide."""

SAME = 1e-9
"""Relative difference of two matrices that counts as rounding."""


def show(link: ElementTree.Element, spec: Any, model: Any, body: int) -> None:
    """Add the geoms of a body: shown geoms without contact are visual, geoms with contact are collision geometry.

    Planes are left out: no part of a hand is infinite.
    """
    import mujoco

    first = int(model.body_geomadr[body])
    for geom in range(first, first + int(model.body_geomnum[body])):
        touches = model.geom_contype[geom] or model.geom_conaffinity[geom]
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE or not (touches or model.geom_group[geom] < HIDDEN):
            continue
        shown = add(link, "collision" if touches else "visual")
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            _mesh(shown, spec, model, geom)
        else:
            _solid(shown, model, geom, str(link.get("name")))
        colour = model.geom_rgba[geom] if model.geom_matid[geom] < 0 else model.mat_rgba[model.geom_matid[geom]]
        add(add(shown, "material", name=f"colour{geom}"), "color", rgba=words(*colour))


def _mesh(shown: ElementTree.Element, spec: Any, model: Any, geom: int) -> None:
    """Write the file of a mesh, its scale, and the pose of its origin.

    MuJoCo takes a vertex v of the file to w = D Qᵀ(v − p), with the mesh's scale D, `refquat` Q and `refpos` p, and w
    to M⁻¹ w, with the pose M of the mesh's principal axes. The geom's pose G is that of these axes. So v stands at
    G M⁻¹ (Qᵀ D v − D Qᵀ p), where D and Qᵀ may change places.
    """
    number = int(model.geom_dataid[geom])
    mesh = spec.mesh(model.mesh(number).name)
    if not mesh.file:
        raise InputError(f"mesh '{mesh.name}' has no file; write one, and name it")
    scale, turned = np.asarray(mesh.scale), pose(np.zeros(3), mesh.refquat).inverse()
    stretched = np.diag(scale) @ turned.rotation
    if not np.allclose(stretched, turned.rotation * scale, atol=SAME * np.abs(scale).max()):
        raise InputError(f"mesh '{mesh.name}' is turned by refquat and scaled unevenly; turn or scale its file")
    stands = pose(model.geom_pos[geom], model.geom_quat[geom])
    centred = pose(model.mesh_pos[number], model.mesh_quat[number])
    moved = pin.SE3(turned.rotation, -stretched @ mesh.refpos)
    add(shown, "origin", **place(stands * centred.inverse() * moved))
    file = Path(spec.modelfiledir) / mesh.compiler.meshdir / mesh.file
    add(add(shown, "geometry"), "mesh", filename=str(file), scale=words(*scale))


def _solid(shown: ElementTree.Element, model: Any, geom: int, link: str) -> None:
    """Write a solid of the same size. An ellipsoid becomes the smallest capsule around it, along its longest axis."""
    import mujoco

    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    stands = pose(model.geom_pos[geom], model.geom_quat[geom])
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        along = np.eye(3)[np.argmax(size)]
        stands = stands * pin.SE3(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along), np.zeros(3))
        _, radius, longest = np.sort(size)
        kind, size = mujoco.mjtGeom.mjGEOM_CAPSULE, np.array([radius, longest - radius])
    add(shown, "origin", **place(stands))
    geometry = add(shown, "geometry")
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        add(geometry, "box", size=words(*(2 * size)))
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        add(geometry, "cylinder", radius=words(size[0]), length=words(2 * size[1]))
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE and size[1] > 0:
        add(geometry, "capsule", radius=words(size[0]), length=words(2 * size[1]))
    elif kind in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE):
        add(geometry, "sphere", radius=words(size[0]))
    else:
        name = kind.name.removeprefix("mjGEOM_").lower()
        raise InputError(f"body '{link}' has a geom of the type {name}; write a mesh or a solid in its place")
