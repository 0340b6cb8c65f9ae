"""The true object, which is simulated; the plan saw only its cloud."""

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sgnlp.base.errors import InputError
from sgnlp.perception import clouds
from sgnlp.perception.observation import Observation
from sgnlp.perception.synthetic.meshes import Mesh

BESIDE = 0.02
"""A cloud may reach this far beyond the true surface [m]: ten times the error of a depth camera."""
OUTLIERS = 0.01
"""Share of the points on each side that are left out."""
LARGER, SMALLER = 10.0, 1.5
"""The true surface may be this many times as large as what was seen of it, and what was seen as the surface."""


@dataclass(frozen=True, eq=False)
class Body(Mesh):
    """A closed surface in the world frame, and the height of the table under it."""

    table_height: float = 0.0  # [m]
    name: str = "object"

    @property
    def digest(self) -> str:
        """SHA-256 of the surface."""
        arrays = (np.ascontiguousarray(self.vertices), np.ascontiguousarray(self.faces))
        return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


def body(vertices: ArrayLike, faces: ArrayLike, table_height: float = 0.0, name: str = "object") -> Body:
    """A body from vertices (V, 3) [m] and faces (F, 3). Raises `InputError` unless it is closed and faces outwards."""
    points, triangles = clouds.mesh(vertices, faces)
    made = Body(points, triangles.astype(np.int32), float(table_height), name)
    if made.open_edges:
        rule = "each edge must have a face on either side, turning the same way"
        raise InputError(f"the mesh of '{name}' is not closed: {rule}; repair it, and observe it again")
    if made.volume <= 0:
        raise InputError("the faces of the mesh must turn counter-clockwise seen from outside")
    return made


def true_body(observation: Observation) -> Body:
    """The true surface that comes with an observation; raises `InputError` if there is none."""
    if observation.mesh_vertices is None or observation.mesh_faces is None:
        rule = "its file needs mesh_vertices and mesh_faces"
        other = "without it, --estimated takes the surface of the plan (`from sgnlp.simulation import estimated`)"
        raise InputError(f"'{observation.name}' has no true surface: {rule}; {other}")
    made = body(observation.mesh_vertices, observation.mesh_faces, observation.table_height, observation.name)
    _check_place(made, observation)
    return made


def _check_place(made: Body, observation: Observation) -> None:
    """Raise `InputError` if the cloud is not where the surface is, or of another size."""
    low, high = made.vertices.min(axis=0), made.vertices.max(axis=0)
    least, most = np.quantile(observation.points, (OUTLIERS, 1 - OUTLIERS), axis=0)
    beside = float(np.maximum(low - least, most - high).max())
    rule = "the mesh must be in metres, in the frame of the cloud"
    if beside > BESIDE:
        raise InputError(f"the cloud of '{observation.name}' reaches {beside:.2f} m beyond its true surface; {rule}")
    larger = float(np.linalg.norm(high - low) / np.linalg.norm(most - least))
    if not 1 / SMALLER < larger < LARGER:
        raise InputError(
            f"the true surface of '{observation.name}' is {larger:.4g} times as large as its cloud; {rule}"
        )
