"""The true surface of an object, where a problem brings it along as a mesh: signed distances and samples.

Open3D measures, imported here alone and only when a distance is asked for.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CAST_RAYS = 5
"""Rays that vote whether a point is inside: one can slip through an edge between two triangles."""


def signed_distance(vertices: Array, faces: NDArray[np.int64], points: Array) -> Array:
    """Distance (Q,) [m] of points (Q, 3) to a watertight mesh (U, 3), (F, 3), negative inside; to 1e-7 of its size."""
    import open3d as o3d

    tensor = o3d.core.Tensor.from_numpy
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(tensor(vertices.astype(np.float32)), tensor(faces.astype(np.uint32)))
    queries = tensor(points.astype(np.float32))
    return scene.compute_signed_distance(queries, nthreads=1, nsamples=CAST_RAYS).numpy().astype(float)


def surface_samples(
    vertices: Array, faces: NDArray[np.int64], count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Points (count, 3) [m] spread evenly at random over a mesh, and the normals (count, 3) of their faces."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    chosen = rng.choice(len(faces), count, p=area / area.sum())
    u, v = np.sqrt(rng.random((count, 1))), rng.random((count, 1))  # (Osada et al. 2002, eq. 1)
    points = (1 - u) * a[chosen] + u * (1 - v) * b[chosen] + u * v * c[chosen]
    return points, normal[chosen] / area[chosen, None]
