"""The true object: what is simulated, not what was seen."""

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sgnlp.base.errors import InputError
from sgnlp.perception.observation import Observation

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Body:
    """A closed surface in the world frame, and the height of the table under it."""

    vertices: Array  # (V, 3) [m]
    faces: NDArray[np.int32]  # (F, 3), counter-clockwise seen from outside
    table_height: float = 0.0  # [m]
    name: str = "object"

    @property
    def digest(self) -> str:
        """SHA-256 of the surface."""
        arrays = (np.ascontiguousarray(self.vertices), np.ascontiguousarray(self.faces))
        return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()

    @property
    def volume(self) -> float:
        """Volume inside [m³]: Σ a·(b × c)/6 over the faces."""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


def body(vertices: ArrayLike, faces: ArrayLike, table_height: float = 0.0, name: str = "object") -> Body:
    """A body from arrays (V, 3) [m] and (F, 3); raises `InputError` unless the surface is closed and faces outwards."""
    points, triangles = np.asarray(vertices, float), np.asarray(faces, np.int32)
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise InputError(f"a mesh needs vertices (V, 3) and faces (F, 3), not {points.shape} and {triangles.shape}")
    if not np.isfinite(points).all() or triangles.min() < 0 or triangles.max() >= len(points):
        raise InputError("the mesh has vertices that are not finite or faces of vertices that are not there")
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forth, back = (np.unique(pair, axis=0, return_counts=True) for pair in (edges, edges[:, ::-1]))
    if len(forth[0]) != len(edges) or not np.array_equal(forth[0], back[0]):
        rule = "each edge must have a face on either side, turning the same way"
        raise InputError(f"the mesh of '{name}' is not closed: {rule}; repair it, and observe it again")
    made = Body(points, triangles, float(table_height), name)
    if made.volume <= 0:
        raise InputError("the faces of the mesh must turn counter-clockwise seen from outside")
    return made


def true_body(observation: Observation) -> Body:
    """The true surface that comes with an observation; raises `InputError` if there is none."""
    if observation.mesh_vertices is None or observation.mesh_faces is None:
        raise InputError(f"'{observation.name}' has no true surface: its file needs mesh_vertices and mesh_faces")
    return body(observation.mesh_vertices, observation.mesh_faces, observation.table_height, observation.name)
