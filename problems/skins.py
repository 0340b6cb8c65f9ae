"""Watertight skins: a tube over closed rings of points, and limbs that grow from openings in its side."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sgnlp.base.arrays import Array, IntArray
from sgnlp.perception.synthetic.meshes import Mesh


def bridge(first: IntArray, second: IntArray) -> IntArray:
    """Triangles (2n, 3) between two closed loops (n,) of vertices that turn about the way to the second."""
    a, b = first, second
    c, d = np.roll(a, -1), np.roll(b, -1)
    return np.concatenate([np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)])


def fan(loop: IntArray, apex: int) -> IntArray:
    """Triangles (n, 3) from a closed loop (n,) of vertices to an apex; the loop turns about the way to it."""
    return np.stack([loop, np.roll(loop, -1), np.full_like(loop, apex)], axis=1)


class Skin:
    """The skin over rings (k, n, 3) [m], each turning about the way to the next, with an apex (3,) at both ends."""

    def __init__(self, start: ArrayLike, rings: Array, end: ArrayLike) -> None:
        self.vertices = np.empty((0, 3))
        self.grid = self._add(rings.reshape(-1, 3)).reshape(rings.shape[:2])
        apexes = self._add(np.array([start, end]))
        self.faces = np.concatenate([fan(self.grid[0][::-1], apexes[0]), fan(self.grid[-1], apexes[1])])
        self._join(*self.grid)

    def mesh(self) -> Mesh:
        """The mesh without the vertices that openings have left unused."""
        used, faces = np.unique(self.faces, return_inverse=True)
        return Mesh(self.vertices[used], faces.reshape(-1, 3))

    def opening(self, rows: tuple[int, int], columns: tuple[int, int]) -> IntArray:
        """The grid's vertices (a + 1, b + 1) from the first to the last row and column; their cells are cut out."""
        around = np.arange(columns[0], columns[1] + 1) % self.grid.shape[1]
        block = self.grid[rows[0] : rows[1] + 1, around]
        self.faces = self.faces[~np.isin(self.faces, block).all(axis=1)]
        return block

    def limb(self, block: IntArray, rings: Array, tip: ArrayLike) -> None:
        """Grow a limb out of an opening over rings (k, n, 3), n the vertices of its rim, to a tip (3,)."""
        loops = self._add(rings.reshape(-1, 3)).reshape(rings.shape[:2])
        self._join(rim(block), *loops)
        self.faces = np.concatenate([self.faces, fan(loops[-1], self._add(np.array([tip]))[0])])

    def handle(self, first: IntArray, rings: Array, second: IntArray) -> None:
        """Join two openings, the second with its rows reversed, by a tube over rings (k, n, 3)."""
        loops = self._add(rings.reshape(-1, 3)).reshape(rings.shape[:2])
        self._join(rim(first), *loops, rim(second))

    def _add(self, points: Array) -> IntArray:
        """New vertices; their indices."""
        self.vertices = np.concatenate([self.vertices, points])
        return np.arange(len(self.vertices) - len(points), len(self.vertices))

    def _join(self, *loops: IntArray) -> None:
        self.faces = np.concatenate([self.faces, *(bridge(a, b) for a, b in pairwise(loops))])


def rim(grid: NDArray[np.generic]) -> NDArray[np.generic]:
    """The border (2 (a + b), ...) of a block (a + 1, b + 1, ...): along its columns first, outwards on its right."""
    return np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])


def outline(block: IntArray) -> Array:
    """Points (2 (a + b), 2) of the unit circle that belong to the rim of a block: along its rows, its columns."""
    rows, columns = (np.linspace(-1, 1, length) for length in block.shape)
    u, v = rim(np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1)).T
    return np.stack([u * np.sqrt(1 - v**2 / 2), v * np.sqrt(1 - u**2 / 2)], axis=1)


def ellipses(block: IntArray, centres: ArrayLike, radii: ArrayLike, along: ArrayLike, outwards: ArrayLike) -> Array:
    """Rings (k, n, 3) for a limb: ellipses at centres (k, 3) with radii (k, 2) along the skin and around it.

    `along` is the direction of the skin's rows, `outwards` that in which the limb leaves it; both (3,).
    """
    axes = np.stack([along, np.cross(along, outwards)])  # (2, 3)
    return np.asarray(centres)[:, None] + (outline(block) * np.asarray(radii)[:, None]) @ axes
