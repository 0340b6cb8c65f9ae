"""The bodies in one closed mesh: which are inside others, which are inside out, and the union of all."""

from itertools import combinations
from typing import Any

import numpy as np

from sgnlp.base.errors import InputError
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import signed_distance

TOUCH = 1e-4
"""The corners of a body inside another may protrude by this share of the outer one's longest side, as in welding."""
OVERLAP = 1e-6
"""Bodies are united if they share at least this part of their volume, which is more than rounding."""
SHOWN = 3
"""Largest number of bodies that are listed with their sizes."""
WORDS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}
FLATNESS, WIDTH = 0.1, 2.0
"""The lowest body looks like a table if it is thinner than this share of its width, and this many times as wide as all
others together."""


def united(mesh: Mesh) -> tuple[Mesh, list[str]]:
    """The surface of the union of a closed mesh's parts, facing outwards, so that no volume counts twice.

    A part with the opposite orientation to the part around it is a cavity; all others are bodies. Raises `InputError`
    if overlapping bodies cannot be united.
    """
    pieces = mesh.parts()
    around = _around(pieces)
    over = [pieces[_outermost(around, i)].volume < 0 for i in range(len(pieces))]
    pieces = [piece.inverted() if turned else piece for piece, turned in zip(pieces, over, strict=True)]
    notes = ["The faces turned inwards; they were turned over."] if any(over) else []
    bodies = {i: [piece] for i, piece in enumerate(pieces) if piece.volume > 0}
    for i, piece in enumerate(pieces):
        if piece.volume <= 0:  # a cavity: only a part inside another can be one
            bodies[around[i]].append(piece)
    solids = [_joined(shells) for shells in bodies.values()]
    if len(solids) == 1:
        return _joined(pieces) if any(over) else mesh, notes
    union = _union(solids) if _may_overlap(solids) else None
    whole, own = _joined(solids), sum(solid.volume for solid in solids)
    if union is not None and own - union.volume > OVERLAP * own:
        notes.append(f"{_described(solids)}. They overlap; their union is taken, of {1e6 * union.volume:.1f} cm³.")
        return union, notes
    notes.append(f"{_described(solids)}, {1e6 * own:.1f} cm³ together. They do not overlap, and are moved as one.")
    return whole, notes


def _around(pieces: list[Mesh]) -> list[int]:
    """For each part the smallest other that it lies in; -1 if there is none."""
    low, high = (np.array([getattr(piece.vertices, end)(axis=0) for piece in pieces]) for end in ("min", "max"))
    found = []
    for i, piece in enumerate(pieces):
        best = -1
        for j, other in enumerate(pieces):
            room = TOUCH * float((high[j] - low[j]).max())
            smaller = best < 0 or abs(other.volume) < abs(pieces[best].volume)
            boxed = (low[j] - room <= low[i]).all() and (high[i] <= high[j] + room).all()
            if i != j and smaller and boxed and abs(other.volume) > abs(piece.volume):
                best = j if signed_distance(other, piece.vertices).max() <= room else best
        found.append(best)
    return found


def _outermost(around: list[int], i: int) -> int:
    return i if around[i] < 0 else _outermost(around, around[i])


def _joined(meshes: list[Mesh]) -> Mesh:
    """Meshes as one."""
    begin = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + first for mesh, first in zip(meshes, begin[:-1], strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def _may_overlap(solids: list[Mesh]) -> bool:
    """Whether the bounding boxes of two bodies overlap."""
    boxes = [(solid.vertices.min(axis=0), solid.vertices.max(axis=0)) for solid in solids]
    return any((a[0] < b[1]).all() and (b[0] < a[1]).all() for a, b in combinations(boxes, 2))


def _union(solids: list[Mesh]) -> Mesh:
    """The union of the bodies, by Manifold."""
    import manifold3d

    def solid(mesh: Mesh) -> Any:
        corners = np.ascontiguousarray(mesh.vertices, np.float64)
        return manifold3d.Manifold(manifold3d.Mesh64(corners, np.ascontiguousarray(mesh.faces, np.uint64)))

    union = manifold3d.Manifold.batch_boolean([solid(mesh) for mesh in solids], manifold3d.OpType.Add)
    if union.status() != manifold3d.Error.NoError or union.is_empty():
        raise InputError(f"holds {len(solids)} bodies that cannot be united; unite them where the mesh was made")
    made = union.to_mesh64()
    return Mesh(np.array(made.vert_properties)[:, :3], np.array(made.tri_verts, np.int64))


def _described(solids: list[Mesh]) -> str:
    """How many bodies there are, and how large the largest are."""
    sides = [1e3 * np.ptp(solid.vertices, axis=0) for solid in sorted(solids, key=lambda s: -s.volume)]
    sizes = ", ".join(" x ".join(f"{side:.0f}" for side in size) + " mm" for size in sides[:SHOWN])
    more = ", ..." if len(solids) > SHOWN else ""
    table = "; the lowest looks like a table, which has no place in it" if _on_table(solids) else ""
    return f"The mesh holds {WORDS.get(len(solids), str(len(solids)))} bodies, {sizes}{more}{table}"


def _on_table(solids: list[Mesh]) -> bool:
    """Whether the lowest body is a wide slab under all others."""
    lowest, *others = sorted(solids, key=lambda solid: float(solid.vertices[:, 2].min()))
    size = np.ptp(lowest.vertices, axis=0)
    rest = np.concatenate([solid.vertices for solid in others])
    under = rest[:, 2].min() >= lowest.vertices[:, 2].max() - TOUCH * size.max()
    wide = size[:2].min() > WIDTH * float(np.ptp(rest[:, :2], axis=0).max())
    return bool(under and wide and size[2] < FLATNESS * size[:2].min())
