"""The visual meshes in the URDF of a hand or arm, and their poses."""

import functools
from pathlib import Path
from typing import Any, Protocol

import coal
import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.perception.synthetic.meshes import Mesh, box, cylinder, unit_sphere

MIN_THICKNESS = 1e-6
"""Least ratio of the third to the first singular value of a mesh's vertices, near single precision."""
BALL_POINTS, SIDES = 100, 24
"""Vertices of a sphere and sides of a cylinder that a URDF has instead of a mesh."""


class Described(Protocol):
    """Anything with a URDF: a hand, an arm, or the skeleton of a hand that is being drafted."""

    @property
    def urdf(self) -> Path:
        """Its file."""

    @property
    def description(self) -> str:
        """The text of the URDF for Pinocchio and MuJoCo."""

    @property
    def model(self) -> pin.Model:
        """The tree of its joints."""

    def __hash__(self) -> int:
        """Hash of the object, not of its values, so that its files are read once."""


@functools.cache
def _loader() -> coal.MeshLoader:
    """A loader that reads an unchanged file once, for all links, hands and arms: 5 to 20 MB for a hand."""
    return coal.CachedMeshLoader()


@functools.lru_cache(maxsize=4)
def _geometry(hand: Described) -> pin.GeometryModel:
    """The visual geometry of the URDF."""
    try:
        model = pin.buildGeomFromUrdfString(
            hand.model, hand.description, pin.GeometryType.VISUAL, package_dirs=[], mesh_loader=_loader()
        )
    except (ValueError, RuntimeError) as error:
        told = str(error).partition("message:")[2] or str(error)  # without the place in its source
        told = told.partition("Hint:")[0]
        raise InputError(
            f"a mesh of {hand.urdf.name} cannot be read: {' '.join(told.split())}; export it again"
        ) from None
    return model


@functools.lru_cache(maxsize=4)
def _meshes(hand: Described) -> tuple[Mesh, ...]:
    """The meshes of the visual geometry; a file that is used twice is read once."""
    known: dict[tuple[str, ...], Mesh] = {}
    found = []
    for i, shown in enumerate(_geometry(hand).geometryObjects):
        solid = not hasattr(shown.geometry, "tri_indices")
        key = (str(i),) if solid else (shown.meshPath, *map(str, shown.meshScale))
        if key not in known:
            known[key] = _mesh(shown)
            if fault := _fault(known[key]):
                raise InputError(f"the mesh {shown.meshPath} of {hand.urdf.name} {fault}")
        found.append(known[key])
    return tuple(found)


def _fault(mesh: Mesh) -> str:
    """Why a mesh cannot be the solid of a link; empty if it can."""
    if not len(mesh.faces):
        return "has no triangles; export it again"
    if not np.isfinite(mesh.vertices).all():
        return "has vertices that are not finite; export it again"
    if mesh.flatness < MIN_THICKNESS:
        return "is flat, so that nothing touches it; give it some thickness, or remove it"
    return ""


def _mesh(shown: pin.GeometryObject) -> Mesh:
    """A geometry of Pinocchio as a mesh: from a file, or of a box, a cylinder or capsule, or a sphere."""
    shape: Any = shown.geometry
    if hasattr(shape, "tri_indices"):
        faces = np.array([[t[0], t[1], t[2]] for t in map(shape.tri_indices, range(shape.num_tris))], int).reshape(
            -1, 3
        )
        return Mesh(np.array(shape.vertices()), faces[:, ::-1] if np.prod(shown.meshScale) < 0 else faces)
    if hasattr(shape, "halfSide"):
        return box(2 * np.array(shape.halfSide))
    if hasattr(shape, "halfLength"):
        return cylinder(shape.radius, 2 * shape.halfLength, SIDES)
    ball = unit_sphere(BALL_POINTS)
    return Mesh(shape.radius * ball.vertices, ball.faces)


def link_meshes(hand: Described) -> tuple[list[Mesh], list[tuple[float, float, float]]]:
    """The L meshes of the links in their own frames [m], and their colours.

    Raises:
        InputError: a mesh of the URDF is missing, or cannot be read.
    """
    colours = []
    for shown in _geometry(hand).geometryObjects:
        red, green, blue, _ = map(float, shown.meshColor)
        colours.append((red, green, blue))
    return list(_meshes(hand)), colours


def mesh_files(hand: Described) -> list[tuple[str, tuple[float, ...]]]:
    """For each of the L meshes, the path of its file ("" for a primitive of the URDF) and its scale."""
    return [(shown.meshPath, tuple(map(float, shown.meshScale))) for shown in _geometry(hand).geometryObjects]


def mesh_links(hand: Described) -> list[str]:
    """The names of the links that the L meshes belong to."""
    return [hand.model.frames[shown.parentFrame].name for shown in _geometry(hand).geometryObjects]


def link_places(hand: Described) -> list[tuple[int, Array]]:
    """For each of the L meshes, the joint of the model that moves it, and its pose (4, 4) in that joint's frame."""
    shown = _geometry(hand).geometryObjects
    return [(one.parentJoint, np.array(one.placement.homogeneous)) for one in shown]


def link_poses(hand: Described, wrist: Array, joints: Array) -> Array:
    """Poses (L, 4, 4) of the meshes, for the root link at `wrist` (7), which is an arm's `base`, and `joints` (n)."""
    geometry, data = _geometry(hand), hand.model.createData()
    places = geometry.createData()
    pin.updateGeometryPlacements(hand.model, data, geometry, places, np.asarray(joints, float))
    root = pin.XYZQUATToSE3(np.asarray(wrist, float))
    return np.array([(root * place).homogeneous for place in places.oMg])
