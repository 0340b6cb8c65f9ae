"""The true surface of an object, if a problem has it as a mesh: signed distances and samples.

Open3D computes the distances. It is imported only when one is needed.
"""

from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.perception.synthetic.meshes import Mesh

CAST_RAYS = 5
"""Number of rays that vote whether a point is inside: a single ray can pass through an edge between two triangles."""


def signed_distance(mesh: Mesh, points: Array) -> Array:
    """Distance (Q,) [m] of points (Q, 3) to a watertight mesh, negative inside; in single precision, to 3 µm."""
    found = raycasting(mesh).compute_signed_distance(points.astype(np.float32), nthreads=1, nsamples=CAST_RAYS)
    return np.asarray(found.numpy(), float)


def raycasting(mesh: Mesh) -> Any:
    """Open3D's scene of a mesh, for rays and distances in single precision."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
    return scene


def surface_samples(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Points (count, 3) [m] spread evenly at random over a mesh, and the normals (count, 3) of their faces."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    chosen = rng.choice(len(mesh.faces), count, p=area / area.sum())
    u, v = np.sqrt(rng.random((count, 1))), rng.random((count, 1))  # (Osada et al. 2002, eq. 1)
    points = (1 - u) * a[chosen] + u * (1 - v) * b[chosen] + u * v * c[chosen]
    return points, normal[chosen] / area[chosen, None]
