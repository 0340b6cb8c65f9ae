"""The meshes that a hand's URDF shows, and where they are."""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sgnlp.hand import Hand
from sgnlp.meshes import Mesh

Array = NDArray[np.float64]


def _geometry(hand: Hand) -> pin.GeometryModel:
    """What the URDF shows; `package://NAME/` is any folder above the URDF."""
    folders = [str(folder) for folder in hand.urdf.parents]
    model = pin.buildGeomFromUrdf(hand.model, str(hand.urdf), pin.GeometryType.VISUAL, package_dirs=folders)
    for shown in list(model.geometryObjects):
        if not hasattr(shown.geometry, "tri_indices"):  # boxes and cylinders of a URDF without meshes
            model.removeGeometryObject(shown.name)
    return model


def link_meshes(hand: Hand) -> tuple[list[Mesh], list[tuple[float, float, float]]]:
    """The L meshes of the links in their own frames [m], and their colours."""
    meshes, colours = [], []
    for shown in _geometry(hand).geometryObjects:
        shape = shown.geometry
        faces = np.array([[t[0], t[1], t[2]] for t in map(shape.tri_indices, range(shape.num_tris))])
        meshes.append(Mesh(np.array(shape.vertices()), faces))
        red, green, blue, _ = map(float, shown.meshColor)
        colours.append((red, green, blue))
    return meshes, colours


def link_poses(hand: Hand, wrist: Array, joints: Array) -> Array:
    """Poses (L, 4, 4) of the meshes in the world, for the root link at `wrist` (7) and `joints` (n)."""
    geometry, data = _geometry(hand), hand.model.createData()
    places = geometry.createData()
    pin.updateGeometryPlacements(hand.model, data, geometry, places, np.asarray(joints, float))
    root = pin.XYZQUATToSE3(np.asarray(wrist, float))
    return np.array([(root * place).homogeneous for place in places.oMg])
