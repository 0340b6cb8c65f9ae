"""Repairs the triangles of a file to one closed surface, if they nearly are one, and notes what was repaired."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sgnlp.perception.synthetic.meshes import Mesh

WELD = 1e-4
"""Corners of an open mesh nearer than this share of its longest side are merged: 6 µm of 60 mm, far below what a depth
camera measures and far above single precision, which exporters write."""
MOST_LOST = 0.01
"""Largest share of the faces that welding may collapse: a mesh finer than `WELD` is left unchanged."""


def mended(mesh: Mesh) -> tuple[Mesh, list[str]]:
    """A mesh closed as far as possible by welding, removing double faces and flipping faces."""
    notes = []
    gap = WELD * float(np.ptp(mesh.vertices, axis=0).max())
    for better, note in (
        (lambda m: m.welded(gap), f"Corners within {gap:.1g} m of each other were welded."),
        (_without_doubles, "Faces that were there twice were left out."),
        (_turned_alike, "Some faces turned against their neighbours; they were turned over."),
    ):
        made = better(mesh) if mesh.open_edges else mesh
        if made.open_edges < mesh.open_edges and len(made.faces) >= (1 - MOST_LOST) * len(mesh.faces) / 2:
            mesh = made
            notes.append(note)
    return mesh, notes


def _without_doubles(mesh: Mesh) -> Mesh:
    """Each face once. Of two faces back to back one stays if that closes more edges than removing both."""
    corners, first, index, count = np.unique(
        np.sort(mesh.faces, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    once = Mesh(mesh.vertices, mesh.faces[np.sort(first)])
    turned = np.array([_parity(face) for face in mesh.faces.tolist()])
    balance = np.abs(np.bincount(index.reshape(-1), turned, len(corners)))
    walls = (balance < count) & (balance == 0)  # as many one way as the other: a wall inside
    without = Mesh(mesh.vertices, mesh.faces[np.sort(first[~walls])]).welded()
    return without if len(without.faces) and without.open_edges < once.open_edges else once


def _parity(face: list[int]) -> int:
    """Parity of a face's corner order: 1 if it is an even permutation of the sorted order, -1 if odd."""
    a, b, c = face
    return 1 if (a < b) + (b < c) + (c < a) == 2 else -1


def _turned_alike(mesh: Mesh) -> Mesh:
    """The mesh with faces flipped that turn against their neighbours; most faces of each part stay unchanged."""
    starts, ends = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    edge = np.minimum(starts, ends) * len(mesh.vertices) + np.maximum(starts, ends)
    order = np.argsort(edge, kind="stable")
    _, begin, count = np.unique(edge[order], return_index=True, return_counts=True)
    one, other = order[begin[count == 2]], order[begin[count == 2] + 1]  # sides of two faces on one edge
    against = (starts < ends)[one] == (starts < ends)[other]
    a, b, size = one // 3, other // 3, len(mesh.faces)
    # Each face is two nodes, as it is and turned over; edges join those that turn alike.
    ends_of_edges = np.r_[a, a + size], np.r_[b + size * against, b + size * ~against]
    graph = coo_array((np.ones(2 * len(a)), ends_of_edges), (2 * size, 2 * size))
    as_is, turned = connected_components(graph, directed=False)[1].reshape(2, size)
    over, part = as_is > turned, np.minimum(as_is, turned)
    over ^= (np.bincount(part, over) > 0.5 * np.bincount(part))[part]
    return Mesh(mesh.vertices, np.where(over[:, None], mesh.faces[:, ::-1], mesh.faces))
