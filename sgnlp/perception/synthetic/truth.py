"""The true surface of an object, where a problem brings it along as a mesh: signed distances and samples.

Open3D measures, imported here alone and only when a distance is asked for.
"""

import numpy as np
from numpy.typing import NDArray

from sgnlp.perception.synthetic.meshes import Mesh

Array = NDArray[np.float64]

CAST_RAYS = 5
"""Rays that vote whether a point is inside: one can slip through an edge between two triangles."""


def signed_distance(mesh: Mesh, points: Array) -> Array:
    """Distance (Q,) [m] of points (Q, 3) to a watertight mesh, negative inside; in single precision, to 3 µm."""
    import open3d as o3d

    tensor = o3d.core.Tensor.from_numpy
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(tensor(mesh.vertices.astype(np.float32)), tensor(mesh.faces.astype(np.uint32)))
    queries = tensor(points.astype(np.float32))
    return scene.compute_signed_distance(queries, nthreads=1, nsamples=CAST_RAYS).numpy().astype(float)


def surface_samples(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Points (count, 3) [m] spread evenly at random over a mesh, and the normals (count, 3) of their faces."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    chosen = rng.choice(len(mesh.faces), count, p=area / area.sum())
    u, v = np.sqrt(rng.random((count, 1))), rng.random((count, 1))  # (Osada et al. 2002, eq. 1)
    points = (1 - u) * a[chosen] + u * (1 - v) * b[chosen] + u * v * c[chosen]
    return points, normal[chosen] / area[chosen, None]
