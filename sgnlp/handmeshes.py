"""The meshes that a hand's URDF shows, and where they are."""

import functools
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sgnlp.errors import InputError
from sgnlp.hand import Hand
from sgnlp.meshes import Mesh, box, cylinder, unit_sphere

Array = NDArray[np.float64]

BALL_POINTS, SIDES = 100, 24
"""Vertices of a sphere and sides of a cylinder that a URDF has in the place of a mesh."""


@functools.lru_cache(maxsize=4)
def _geometry(hand: Hand) -> pin.GeometryModel:
    """What the URDF shows; `package://NAME/` is any folder above the URDF."""
    folders = [str(folder) for folder in hand.urdf.parents]
    try:
        model = pin.buildGeomFromUrdf(hand.model, str(hand.urdf), pin.GeometryType.VISUAL, package_dirs=folders)
    except (ValueError, RuntimeError) as error:
        raise InputError(f"a mesh of {hand.urdf.name} cannot be read: {' '.join(str(error).split())}") from None
    for shown in list(model.geometryObjects):
        if _mesh(shown.geometry) is None:
            model.removeGeometryObject(shown.name)
    return model


def _mesh(shape: Any) -> Mesh | None:
    """A geometry of Pinocchio as a mesh; None for what no URDF has."""
    if hasattr(shape, "tri_indices"):
        faces = np.array([[t[0], t[1], t[2]] for t in map(shape.tri_indices, range(shape.num_tris))])
        return Mesh(np.array(shape.vertices()), faces)
    if hasattr(shape, "halfSide"):
        return box(2 * np.array(shape.halfSide))
    if hasattr(shape, "halfLength"):
        return cylinder(shape.radius, 2 * shape.halfLength, SIDES)
    if hasattr(shape, "radius"):
        ball = unit_sphere(BALL_POINTS)
        return Mesh(shape.radius * ball.vertices, ball.faces)
    return None


def link_meshes(hand: Hand) -> tuple[list[Mesh], list[tuple[float, float, float]]]:
    """The L meshes of the links in their own frames [m], and their colours.

    Raises:
        InputError: a mesh of the URDF is not there, or is none.
    """
    meshes, colours = [], []
    for shown in _geometry(hand).geometryObjects:
        mesh = _mesh(shown.geometry)
        assert mesh is not None  # the others were removed
        meshes.append(mesh)
        red, green, blue, _ = map(float, shown.meshColor)
        colours.append((red, green, blue))
    return meshes, colours


def mesh_links(hand: Hand) -> list[str]:
    """The names of the links that the L meshes belong to."""
    return [hand.model.frames[shown.parentFrame].name for shown in _geometry(hand).geometryObjects]


def link_poses(hand: Hand, wrist: Array, joints: Array) -> Array:
    """Poses (L, 4, 4) of the meshes in the world, for the root link at `wrist` (7) and `joints` (n)."""
    geometry, data = _geometry(hand), hand.model.createData()
    places = geometry.createData()
    pin.updateGeometryPlacements(hand.model, data, geometry, places, np.asarray(joints, float))
    root = pin.XYZQUATToSE3(np.asarray(wrist, float))
    return np.array([(root * place).homogeneous for place in places.oMg])
