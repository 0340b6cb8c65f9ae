"""Triangle meshes of solid bodies: position, closedness, volume and centroid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, cKDTree
from scipy.spatial.transform import Rotation

from sgnlp.base.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh; faces turn counter-clockwise seen from outside."""

    vertices: Array  # (U, 3) [m]
    faces: IntArray  # (F, 3)

    @property
    def open_edges(self) -> int:
        """Number of edges that do not join exactly two faces of the same orientation; 0 if watertight."""
        first = self.faces.ravel()
        second = np.roll(self.faces, -1, axis=1).ravel()
        ways, count = np.unique(np.stack([first, second]), axis=1, return_counts=True)
        there, back = (low * len(self.vertices) + high for low, high in (ways, ways[::-1]))
        return int(np.sum((count > 1) | ~np.isin(there, back)))

    @property
    def volume(self) -> float:
        """Enclosed volume [m³] by the divergence theorem, Σ a·(b × c)/6; negative if the mesh is inside out."""
        return float(self._tetrahedra.sum())

    @property
    def centroid(self) -> Array:
        """Centre (3,) [m] of the enclosed volume: the centre of mass of a uniform body."""
        corners = self.vertices[self.faces].sum(axis=1) / 4  # (F, 3) centroids of the tetrahedra with the origin
        return self._tetrahedra @ corners / self.volume

    @property
    def _tetrahedra(self) -> Array:
        """Signed volumes (F,) [m³] of the tetrahedra between the faces and the origin."""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6

    @property
    def flatness(self) -> float:
        """Third over first singular value of the vertices about their mean: 0 if they lie in a plane."""
        spread = np.linalg.svd(self.vertices - self.vertices.mean(axis=0), compute_uv=False)  # descending
        return float(spread[2] / spread[0]) if len(spread) > 2 and spread[0] > 0 else 0.0

    def welded(self, gap: float = 0.0) -> "Mesh":
        """The mesh with vertices merged that are equal, or joined by steps of at most `gap` [m].

        Faces that lose a corner and vertices without a face are removed.
        """
        merged, index = np.unique(self.vertices, axis=0, return_inverse=True)
        if gap > 0:
            near = cKDTree(merged).query_pairs(gap, output_type="ndarray")
            steps = coo_array((np.ones(len(near)), near.T), (len(merged), len(merged)))
            _, group = connected_components(steps, directed=False)
            _, first = np.unique(group, return_index=True)
            merged, index = merged[first], group.astype(np.int64)[index.reshape(-1)]
        faces = index.reshape(-1)[self.faces]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        return Mesh(merged, faces).compact()

    def compact(self) -> "Mesh":
        """The mesh without the vertices of no face."""
        used, faces = np.unique(self.faces, return_inverse=True)
        return Mesh(self.vertices[used], faces.reshape(-1, 3))

    def parts(self) -> "list[Mesh]":
        """The parts that share no vertex, in the order of their first faces."""
        a, b = self.faces[:, [0, 1]].ravel(), self.faces[:, [1, 2]].ravel()
        joined = coo_array((np.ones(len(a)), (a, b)), (len(self.vertices), len(self.vertices)))
        part = connected_components(joined, directed=False)[1][self.faces[:, 0]]
        _, first = np.unique(part, return_index=True)
        return [Mesh(self.vertices, self.faces[part == part[i]]).compact() for i in np.sort(first)]

    def inverted(self) -> "Mesh":
        """The mesh with its faces turned over."""
        return Mesh(self.vertices, self.faces[:, ::-1])

    def turned(self, quaternion: ArrayLike) -> "Mesh":
        """The body turned about the origin by a quaternion (4,), xyzw."""
        return Mesh(Rotation.from_quat(np.asarray(quaternion, np.float64)).apply(self.vertices), self.faces)

    def standing(self, position: ArrayLike = (0.0, 0.0)) -> "Mesh":
        """The body moved so that its lowest point is at z = 0, the centre of its box above `position` (2,) [m]."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        place = np.asarray(position) - (low + high)[:2] / 2
        return Mesh(self.vertices + np.r_[place, -low[2]], self.faces)


def unit_sphere(count: int) -> Mesh:
    """The hull of `count` points on a Fibonacci spiral over the unit sphere."""
    i = np.arange(count) + 0.5
    z, angle = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    r = np.sqrt(1 - z * z)
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    return hull(points)


def cylinder(radius: float, length: float, sides: int) -> Mesh:
    """A prism with this many sides, inscribed in a cylinder along z about the origin."""
    angle = 2 * np.pi * np.arange(sides) / sides
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(sides, length / 2)], axis=1)
    return hull(np.vstack([rim, rim * [1, 1, -1]]))


def box(size: ArrayLike) -> Mesh:
    """A box with edges of `size` (3,) [m] about the origin."""
    corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return hull(corners * np.asarray(size, np.float64))


def hull(points: Array) -> Mesh:
    """The convex hull of points (U, 3) [m]; the origin must be inside."""
    found = ConvexHull(points).simplices
    corners = points[found]
    inward = np.einsum("fi,fi->f", np.cross(*np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0)), corners[:, 0]) < 0
    return Mesh(points, np.where(inward[:, None], found[:, ::-1], found).astype(int))
